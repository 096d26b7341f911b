//! A manifest as CSV: a heading of columns, one run a row, and a row `defaults`.

use vice_core::error::DataResult;

use super::cells::{Cells, RawRow, wrong};
use super::field::{self, Cell, RUN_ID};

/// The run_id of the row that all others start from.
const DEFAULTS: &str = "defaults";

/// Rows with their lines, and the defaults.
pub(super) fn read(text: &str) -> DataResult<(Cells, Vec<RawRow>)> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(text.as_bytes());
    let mut heading: Option<csv::StringRecord> = None;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| {
            let line = e.position().map_or(0, csv::Position::line);
            wrong(line, format!("is no CSV: {e}"))
        })?;
        let line = record.position().map_or(0, |p| line_from(text, p));
        let Some(names) = &heading else {
            for name in &record {
                field::place(name.trim_start_matches('\u{feff}')).map_err(|e| wrong(line, e))?;
            }
            heading = Some(record);
            continue;
        };
        if record.iter().all(str::is_empty) {
            continue;
        }
        if record.len() != names.len() {
            return Err(wrong(line, format!("has {} cells under {} columns", record.len(), names.len()))
                .hint("put what has commas in it in double quotes"));
        }
        let mut cells = Cells::default();
        for (name, value) in names.iter().zip(&record) {
            let name = name.trim_start_matches('\u{feff}');
            if !value.is_empty() {
                cells.add(name, Cell::Text(value.to_string()), line)?;
            }
        }
        rows.push(RawRow { line, cells });
    }
    Ok(part_defaults(rows))
}

/// The row `defaults`, and the others.
pub(super) fn part_defaults(rows: Vec<RawRow>) -> (Cells, Vec<RawRow>) {
    let is_defaults = |row: &RawRow| row.cells.get(RUN_ID) == Some(&Cell::Text(DEFAULTS.to_string()));
    let (defaults, rows): (Vec<RawRow>, Vec<RawRow>) = rows.into_iter().partition(is_defaults);
    let mut defaults = defaults.into_iter().next_back().map(|row| row.cells).unwrap_or_default();
    defaults.remove(RUN_ID);
    (defaults, rows)
}

/// The line that a record begins in: the reader counts from the end of the one before, blank lines and comments not yet
/// passed.
fn line_from(text: &str, position: &csv::Position) -> u64 {
    let rest = text.get(position.byte() as usize..).unwrap_or_default();
    let passed = rest.lines().take_while(|l| l.trim().is_empty() || l.starts_with('#')).count();
    position.line() + passed as u64
}
