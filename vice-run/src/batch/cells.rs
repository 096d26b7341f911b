//! The cells of a manifest, whatever it is written in.

use std::collections::BTreeMap;

use vice_core::error::{DataError, DataResult, ErrorKind};

use super::field::{self, Cell};

/// Cells of a row by their place in a request, each with its line.
#[derive(Clone, Debug, Default)]
pub(super) struct Cells(BTreeMap<String, (Cell, u64)>);

/// A row as it stands in the file.
pub(super) struct RawRow {
    pub(super) line: u64,
    pub(super) cells: Cells,
}

pub(super) fn wrong(line: u64, what: impl Into<String>) -> DataError {
    DataError::of_kind(ErrorKind::Usage, what).line(line)
}

impl Cells {
    /// Adds a cell of a column.
    pub(super) fn add(&mut self, column: &str, cell: Cell, line: u64) -> DataResult<()> {
        let place = field::place(column).map_err(|e| wrong(line, e))?;
        match self.0.insert(place.clone(), (cell, line)) {
            None => Ok(()),
            Some(_) => Err(wrong(line, format!("{} is given twice", field::option(&place)))),
        }
    }

    pub(super) fn get(&self, place: &str) -> Option<&Cell> {
        self.0.get(place).map(|(cell, _)| cell)
    }

    pub(super) fn remove(&mut self, place: &str) {
        self.0.remove(place);
    }

    /// The cells with those of a row in place of these.
    pub(super) fn overlaid(&self, row: &Self) -> Self {
        let mut cells = self.clone();
        cells.0.extend(row.0.clone());
        cells
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (&String, &(Cell, u64))> {
        self.0.iter()
    }

    /// A cell that is one text.
    pub(super) fn text(&self, place: &str) -> DataResult<Option<String>> {
        match self.0.get(place) {
            None => Ok(None),
            Some((Cell::Text(text), _)) => Ok(Some(text.clone())),
            Some((Cell::List(_), line)) => {
                Err(wrong(*line, format!("{} is one value, not a list", field::option(place))))
            }
        }
    }
}
