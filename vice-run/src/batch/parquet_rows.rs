//! A manifest as Parquet: the columns of one in CSV, a row a run. Text and numbers only; lists are text with commas.

use std::path::Path;

use vice_core::error::DataResult;

use super::cells::{Cells, RawRow, wrong};
use super::csv_rows::part_defaults;
use super::field::Cell;
use vice_files::tables::{self, Values};

/// Rows with their numbers, from 1, and the defaults.
pub(super) fn read(path: &Path) -> DataResult<(Cells, Vec<RawRow>)> {
    let table = tables::read(path)?;
    let mut rows = Vec::new();
    for at in 0..table.iter().map(|(_, values)| values.len()).min().unwrap_or(0) {
        let line = at as u64 + 1;
        let mut cells = Cells::default();
        for (column, values) in &table {
            let text = match values {
                Values::Text(values) => values[at].as_deref().map(str::to_string),
                Values::Numbers(values) => values[at].filter(|v| !v.is_nan()).map(|v| v.to_string()),
                Values::Counts(values) => values[at].map(|v| v.to_string()),
            };
            if let Some(text) = text.filter(|t| !t.is_empty()) {
                cells.add(column, Cell::Text(text), line)?;
            }
        }
        rows.push(RawRow { line, cells });
    }
    if table.is_empty() {
        return Err(wrong(0, "has no columns"));
    }
    Ok(part_defaults(rows))
}
