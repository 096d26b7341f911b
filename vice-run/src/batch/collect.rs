//! The results of a batch in one table.

use serde::Serialize;

use super::key::Key;
use super::results::{ResultRow, SCHEMA, to_csv};
use super::store::{RowRecord, Store};
use crate::error::RunResult;
use crate::report::csv::cell;
use crate::result;

/// What a batch has found so far.
#[derive(Clone, Debug, Default)]
pub struct Collected {
    /// One row a run, pose stream and depth source, in the order of the manifest; one row for a run without a result.
    pub rows: Vec<ResultRow>,
    /// How long each run took.
    pub timings: Vec<Timing>,
    /// Runs that were not tried yet.
    pub missing: usize,
    /// Runs that failed.
    pub failed: usize,
}

/// How long a run took: apart from the results, since it is never the same twice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Timing {
    /// Name of the run.
    pub run_id: String,
    /// Seconds from its turn to its result.
    pub seconds: f64,
}

/// Reads all results of a batch, one at a time.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if the folder is none of a batch, or a file in it is broken.
pub fn collect(store: &Store) -> RunResult<Collected> {
    let mut collected = Collected::default();
    for listed in store.listed()?.rows {
        let mut common = ResultRow {
            schema: SCHEMA.to_string(),
            run_id: cell(&listed.run_id),
            group: cell(&listed.group),
            dataset: cell(&listed.dataset),
            status: "missing".to_string(),
            ..ResultRow::default()
        };
        // What was found before the manifest was changed, or was deleted since, is no answer to it.
        let is_answer = |record: &RowRecord| {
            let is_there = |key: &Key| record.error.is_some() || store.result_path(key).exists();
            record.asked == listed.asked && record.key.as_ref().is_none_or(is_there)
        };
        let Some(record) = store.row(&listed.run_id)?.filter(is_answer) else {
            collected.missing += 1;
            collected.rows.push(common);
            continue;
        };
        common.key = record.key.as_ref().map(ToString::to_string).unwrap_or_default();
        collected.timings.push(Timing { run_id: cell(&listed.run_id), seconds: record.seconds });
        match (&record.error, &record.key) {
            (None, Some(key)) => {
                let document = result::read(store.result_path(key))?;
                collected.rows.extend(ResultRow::of_document(&common, &document));
            }
            (error, _) => {
                collected.failed += 1;
                common.status = "failed".to_string();
                common.exit_code = Some(record.exit_code);
                common.error = cell(error.as_deref().unwrap_or("has no key"));
                collected.rows.push(common);
            }
        }
    }
    Ok(collected)
}

impl Collected {
    /// `results.csv`.
    ///
    /// # Errors
    /// [`RunError`](crate::error::RunError) if a text is none.
    pub fn results_csv(&self) -> RunResult<String> {
        to_csv(&self.rows)
    }

    /// `timings.csv`.
    ///
    /// # Errors
    /// [`RunError`](crate::error::RunError) if a text is none.
    pub fn timings_csv(&self) -> RunResult<String> {
        to_csv(&self.timings)
    }
}
