//! `results.csv` and `results.parquet`.

use std::path::Path;
use std::sync::Arc;

use serde::Serialize;
use serde_json::{Map, Value, json};
use vice_core::error::{DataError, DataResult, ErrorKind};

use super::results::{ResultRow, SCHEMA};
use crate::error::RunResult;
use crate::report::csv::{cell, finished};
use vice_files::tables::{self, Column, Values, is_parquet};

/// How a column is read off a row.
#[derive(Clone, Copy)]
enum Get {
    Text(fn(&ResultRow) -> &str),
    Number(fn(&ResultRow) -> Option<f64>),
    Count(fn(&ResultRow) -> Option<i64>),
}

/// The columns, in the order of the fields of a row (a test compares them).
const COLUMNS: [(&str, Get); 38] = [
    ("schema", Get::Text(|r| &r.schema)),
    ("run_id", Get::Text(|r| &r.run_id)),
    ("group", Get::Text(|r| &r.group)),
    ("flight", Get::Text(|r| &r.flight)),
    ("dataset", Get::Text(|r| &r.dataset)),
    ("key", Get::Text(|r| &r.key)),
    ("status", Get::Text(|r| &r.status)),
    ("exit_code", Get::Count(|r| r.exit_code.map(i64::from))),
    ("error", Get::Text(|r| &r.error)),
    ("vice_version", Get::Text(|r| &r.vice_version)),
    ("format", Get::Text(|r| &r.format)),
    ("camera", Get::Text(|r| &r.camera)),
    ("stream", Get::Text(|r| &r.stream)),
    ("estimator", Get::Text(|r| &r.estimator)),
    ("role", Get::Text(|r| &r.role)),
    ("depth", Get::Text(|r| &r.depth)),
    ("rmse_3d_m", Get::Number(|r| r.rmse_3d_m)),
    ("aoe_rad", Get::Number(|r| r.aoe_rad)),
    ("roe_rad", Get::Number(|r| r.roe_rad)),
    ("poses", Get::Count(|r| r.poses.map(|n| n as i64))),
    ("align", Get::Text(|r| &r.align)),
    ("mean_1_px", Get::Number(|r| r.mean_1_px)),
    ("std_1_px", Get::Number(|r| r.std_1_px)),
    ("mean_2_px", Get::Number(|r| r.mean_2_px)),
    ("std_2_px", Get::Number(|r| r.std_2_px)),
    ("mean_3_px", Get::Number(|r| r.mean_3_px)),
    ("std_3_px", Get::Number(|r| r.std_3_px)),
    ("mean_4_px", Get::Number(|r| r.mean_4_px)),
    ("std_4_px", Get::Number(|r| r.std_4_px)),
    ("pooled_px", Get::Number(|r| r.pooled_px)),
    ("held_px", Get::Number(|r| r.held_px)),
    ("low_95_px", Get::Number(|r| r.low_95_px)),
    ("high_95_px", Get::Number(|r| r.high_95_px)),
    ("scored", Get::Count(|r| r.scored.map(|n| n as i64))),
    ("skipped", Get::Count(|r| r.skipped.map(|n| n as i64))),
    ("skipped_percent", Get::Number(|r| r.skipped_percent)),
    ("carried_away_percent", Get::Number(|r| r.carried_away_percent)),
    ("suspicions", Get::Count(|r| r.suspicions.map(|n| n as i64))),
];

fn columns_of(rows: &[ResultRow]) -> Vec<Column> {
    let column = |(name, get): &(&str, Get)| {
        let values = match get {
            Get::Text(get) => Values::Text(
                rows.iter().map(|r| Some(get(r)).filter(|t| !t.is_empty()).map(Arc::from)).collect(),
            ),
            Get::Number(get) => Values::Numbers(rows.iter().map(get).collect()),
            Get::Count(get) => Values::Counts(rows.iter().map(get).collect()),
        };
        ((*name).to_string(), values)
    };
    COLUMNS.iter().map(column).collect()
}

/// Writes `results.parquet`.
///
/// # Errors
/// [`RunError`](crate::error::RunError) with the path if it cannot be written.
pub(super) fn write_parquet(path: &Path, rows: &[ResultRow]) -> RunResult<()> {
    let table = columns_of(rows);
    tables::write(path, &table, |add| Ok(add(&table)?))
}

/// `results.csv`; texts that a spreadsheet would calculate are guarded.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if a text is none.
pub(super) fn results_csv(rows: &[ResultRow]) -> RunResult<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(COLUMNS.iter().map(|(name, _)| *name))?;
    for row in rows {
        writer.write_record(COLUMNS.iter().map(|(_, get)| match get {
            Get::Text(get) => cell(get(row)),
            Get::Number(get) => get(row).map_or_else(String::new, |v| v.to_string()),
            Get::Count(get) => get(row).map_or_else(String::new, |v| v.to_string()),
        }))?;
    }
    finished(writer)
}

/// Rows as CSV with a heading.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if a text is none.
pub(super) fn to_csv(rows: &[impl Serialize]) -> RunResult<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    finished(writer)
}

/// Reads a `results.csv` or `results.parquet`.
///
/// # Errors
/// [`DataError`] with path and line for what is none, or of another version.
pub(super) fn read(path: &Path) -> DataResult<Vec<ResultRow>> {
    let rows = if is_parquet(path) { read_parquet(path)? } else { read_csv(path)? };
    match rows.iter().find(|row| row.schema != SCHEMA) {
        Some(row) => {
            let problem = format!("is {}, this VICE reads {SCHEMA}", row.schema);
            Err(DataError::of_kind(ErrorKind::Unsupported, problem)
                .at(path)
                .hint("make it again with `vice batch collect`"))
        }
        None => Ok(rows),
    }
}

fn is_none(path: &Path, what: &str) -> DataError {
    DataError::of_kind(ErrorKind::Usage, format!("is no table of results: {what}"))
        .at(path)
        .hint("`vice batch collect` writes one")
}

fn read_csv(path: &Path) -> DataResult<Vec<ResultRow>> {
    let wrong = |e: csv::Error| match e.position().map(csv::Position::line) {
        Some(line) => DataError::new("is no row of a table of results").at(path).line(line).because(e),
        None => is_none(path, "no CSV").because(e),
    };
    let text = crate::result::read_bytes(path)?;
    let mut reader = csv::Reader::from_reader(text.as_slice());
    let first = reader.headers().map_err(wrong)?.get(0).map(str::to_string);
    if first.as_deref() != Some(COLUMNS[0].0) {
        return Err(is_none(path, "its first column is not `schema`"));
    }
    reader.deserialize::<ResultRow>().map(|row| row.map_err(wrong)).collect()
}

fn read_parquet(path: &Path) -> DataResult<Vec<ResultRow>> {
    let table = tables::read(path)?;
    if table.first().is_none_or(|(name, _)| name != COLUMNS[0].0) {
        return Err(is_none(path, "its first column is not `schema`"));
    }
    let rows = table.iter().map(|(_, values)| values.len()).min().unwrap_or(0);
    let row = |at: usize| {
        let mut fields = Map::new();
        for (name, values) in &table {
            let value = match values {
                Values::Text(values) => values[at].as_deref().map(|text| json!(text)),
                Values::Numbers(values) => values[at].map(|number| json!(number)),
                Values::Counts(values) => values[at].map(|count| json!(count)),
            };
            fields.extend(value.map(|value| (name.clone(), value)));
        }
        serde_json::from_value(Value::Object(fields))
            .map_err(|e| is_none(path, &format!("row {}", at + 1)).because(e))
    };
    (0..rows).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_columns_are_the_fields_in_their_order() {
        let heading = to_csv(&[ResultRow::default()]).unwrap();
        let heading: Vec<&str> = heading.lines().next().unwrap().split(',').collect();
        assert_eq!(heading, COLUMNS.map(|(name, _)| name));
    }

    #[test]
    fn both_files_are_read_as_they_were_written() {
        let full = ResultRow {
            schema: SCHEMA.to_string(),
            run_id: "a, \"b\"".to_string(),
            status: "done".to_string(),
            exit_code: Some(3),
            rmse_3d_m: Some(0.1 + 0.2),
            poses: Some(7),
            scored: Some(1 << 40),
            ..ResultRow::default()
        };
        let rows = [full, ResultRow { schema: SCHEMA.to_string(), ..ResultRow::default() }];
        let folder = tempfile::tempdir().unwrap();
        let csv = folder.path().join("results.csv");
        std::fs::write(&csv, results_csv(&rows).unwrap()).unwrap();
        assert_eq!(read(&csv).unwrap(), rows);
        let parquet = folder.path().join("results.parquet");
        if tables::HAS_PARQUET {
            write_parquet(&parquet, &rows).unwrap();
            assert_eq!(read(&parquet).unwrap(), rows);
        }
        std::fs::write(&csv, results_csv(&rows).unwrap().replace(SCHEMA, "vice.results/1")).unwrap();
        assert!(read(&csv).unwrap_err().to_string().contains("is vice.results/1, this VICE reads"));
        std::fs::write(&csv, "a,b\n1,2\n").unwrap();
        assert!(read(&csv).unwrap_err().to_string().contains("first column is not `schema`"));
    }
}
