//! The results of a batch in one table.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;
use sha2::{Digest, Sha256};
use vice_files::atomic::{self, Overwrite};

use super::beside::Beside;
use super::fleet_table::{self, render};
use super::key::Key;
use super::results::{ResultRow, SCHEMA};
use super::results_file::{results_csv, to_csv, write_parquet};
use super::samples::{self, Samples};
use super::store::{RowRecord, Store};
use crate::error::{RunError, RunResult};
use crate::report::csv::cell;
use crate::result;
use crate::text::hex;
use vice_files::tables::{self, Values};

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
/// [`RunError`] if the folder is none of a batch, or a file in it is broken.
pub fn collect(store: &Store) -> RunResult<Collected> {
    let mut collected = Collected::default();
    for listed in store.listed()?.rows {
        let mut common = ResultRow {
            schema: SCHEMA.to_string(),
            run_id: listed.run_id.clone(),
            group: listed.group.clone(),
            flight: listed.flight.clone(),
            dataset: listed.dataset.clone(),
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
        collected.timings.push(Timing { run_id: listed.run_id.clone(), seconds: record.seconds });
        match (&record.error, &record.key) {
            (None, Some(key)) => {
                let document = result::read(store.result_path(key))?;
                collected.rows.extend(ResultRow::of_document(&common, &document, &listed.estimators));
            }
            (error, _) => {
                collected.failed += 1;
                common.status = "failed".to_string();
                common.exit_code = Some(record.exit_code);
                common.error = error.as_deref().unwrap_or("has no key").to_string();
                collected.rows.push(common);
            }
        }
    }
    Ok(collected)
}

/// What a table of a batch is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `results.csv` and `timings.csv`.
    Csv,
    /// `results.parquet` and `timings.parquet`.
    Parquet,
    /// `table.tex`.
    Latex,
    /// `table.html`.
    Html,
}

impl Collected {
    /// Writes tables into the batch's folder; all that can go wrong before the first is written does.
    ///
    /// # Errors
    /// [`RunError`] if one cannot be made or written.
    pub fn write(&self, store: &Store, formats: &[Format]) -> RunResult<()> {
        let place = |name: &str| store.folder().join(name);
        let beside = Beside { samples: Samples::Store(store), links: store.has_reports().then_some("") };
        let mut texts: Vec<(PathBuf, String)> = Vec::new();
        for format in formats {
            match format {
                Format::Csv => {
                    texts.push((place("results.csv"), results_csv(&self.rows)?));
                    texts.push((place("timings.csv"), timings_csv(&self.timings)?));
                }
                Format::Latex => {
                    texts
                        .push((place("table.tex"), render(&self.rows, &beside, fleet_table::Format::Latex)?));
                }
                Format::Html => {
                    texts
                        .push((place("table.html"), render(&self.rows, &beside, fleet_table::Format::Html)?));
                }
                Format::Parquet => {}
            }
        }
        if formats.contains(&Format::Parquet) {
            write_parquet(&place("results.parquet"), &self.rows)?;
            write_timings(&place("timings.parquet"), &self.timings)?;
        }
        for (path, text) in texts {
            atomic::write(path, Overwrite::Replace, |out| out.write_all(text.as_bytes()))?;
        }
        Ok(())
    }

    /// Writes `samples/`: for each run that was done its scored samples, under its name, with columns that tell runs
    /// apart before those of a sample. Returns how many.
    ///
    /// # Errors
    /// [`RunError`] if a run kept none, or a file cannot be written.
    pub fn write_samples(&self, store: &Store) -> RunResult<usize> {
        let mut runs: Vec<&ResultRow> = self.rows.iter().filter(|r| r.status == "done").collect();
        runs.dedup_by_key(|r| &r.run_id);
        let from = |row: &ResultRow| store.samples_path(&Key::named(&row.key));
        if let Some(without) = runs.iter().find(|r| !from(r).exists()) {
            let problem = format!("the samples of {} were not kept", without.run_id);
            return Err(RunError::missing(problem).advise("run the batch again with its samples kept"));
        }
        let folder = store.folder().join("samples");
        std::fs::create_dir_all(&folder)?;
        for row in &runs {
            let names = [("run_id", row.run_id.as_str()), ("group", &row.group), ("flight", &row.flight)];
            samples::write_named(&from(row), &folder.join(file_name(&row.run_id)), &names)?;
        }
        Ok(runs.len())
    }
}

fn timings_csv(timings: &[Timing]) -> RunResult<String> {
    let guarded: Vec<Timing> =
        timings.iter().map(|t| Timing { run_id: cell(&t.run_id), seconds: t.seconds }).collect();
    to_csv(&guarded)
}

fn write_timings(path: &Path, timings: &[Timing]) -> RunResult<()> {
    let table = vec![
        (
            "run_id".to_string(),
            Values::Text(timings.iter().map(|t| Some(Arc::from(t.run_id.as_str()))).collect()),
        ),
        ("seconds".to_string(), Values::Numbers(timings.iter().map(|t| Some(t.seconds)).collect())),
    ];
    tables::write(path, &table, |add| Ok(add(&table)?))
}

/// A name that any file system takes, another for each run: letters that it may not take are replaced, and then a hash
/// tells the name from others.
fn file_name(run_id: &str) -> String {
    let safe = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let plain: String = run_id.chars().map(|c| if safe(c) { c } else { '_' }).take(80).collect();
    if plain == run_id && !plain.starts_with('.') {
        return format!("{plain}.parquet");
    }
    format!("_{plain}-{}.parquet", hex(&Sha256::digest(run_id.as_bytes())[..4]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_are_safe_and_differ() {
        assert_eq!(file_name("V1_01_easy"), "V1_01_easy.parquet");
        let (a, b) = (file_name("a/b"), file_name("a_b"));
        assert!(a.starts_with("_a_b-") && b == "a_b.parquet", "{a} {b}");
        assert!(!file_name("../../x").contains('/') && !file_name(".hidden").starts_with('.'));
    }
}
