//! A manifest as TOML: a table `defaults`, and a table `run` for each run.

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use vice_core::error::DataResult;

use super::cells::{Cells, RawRow, wrong};
use super::field::Cell;

/// Rows with their lines, and the defaults.
pub(super) fn read(text: &str) -> DataResult<(Cells, Vec<RawRow>)> {
    let line_of = |at: usize| text.bytes().take(at).filter(|b| *b == b'\n').count() as u64 + 1;
    let wrong = |at: usize, what: String| wrong(line_of(at), what);
    let document = DeTable::parse(text)
        .map_err(|e| wrong(e.span().map_or(0, |s| s.start), format!("is no TOML: {}", e.message())))?;
    let (mut defaults, mut rows) = (Cells::default(), Vec::new());
    for (name, value) in document.get_ref() {
        match (name.get_ref().as_ref(), value.get_ref()) {
            ("defaults", DeValue::Table(table)) => flatten(table, "", &line_of, &mut defaults)?,
            ("run", DeValue::Array(list)) => {
                for item in list {
                    let at = item.span().start;
                    let DeValue::Table(table) = item.get_ref() else {
                        return Err(wrong(at, "a run is a table: [[run]]".to_string()));
                    };
                    let mut cells = Cells::default();
                    flatten(table, "", &line_of, &mut cells)?;
                    rows.push(RawRow { line: line_of(at), cells });
                }
            }
            (other, _) => {
                let what = format!("`{other}` is not known: a manifest has [defaults] and [[run]]");
                return Err(wrong(name.span().start, what));
            }
        }
    }
    Ok((defaults, rows))
}

/// Tables inside of tables as names with dots.
fn flatten(
    table: &DeTable<'_>,
    before: &str,
    line_of: &dyn Fn(usize) -> u64,
    cells: &mut Cells,
) -> DataResult<()> {
    for (name, value) in table {
        let column = format!("{before}{}", name.get_ref());
        let line = line_of(name.span().start);
        match value.get_ref() {
            DeValue::Table(inner) => flatten(inner, &format!("{column}."), line_of, cells)?,
            DeValue::Array(list) => {
                let parts = list.iter().map(|v| scalar(v, &column, line)).collect::<DataResult<_>>()?;
                cells.add(&column, Cell::List(parts), line)?;
            }
            _ => cells.add(&column, Cell::Text(scalar(value, &column, line)?), line)?,
        }
    }
    Ok(())
}

fn scalar(value: &Spanned<DeValue<'_>>, column: &str, line: u64) -> DataResult<String> {
    Ok(match value.get_ref() {
        DeValue::String(text) => text.to_string(),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Boolean(true) => "on".to_string(),
        DeValue::Boolean(false) => "off".to_string(),
        _ => {
            let what = format!("{column}: expected text, a number, true, false, or a list of these");
            return Err(wrong(line, what));
        }
    })
}
