//! The folder of a batch: what is to be there, what is, and what went wrong.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_files::address::shown_path;
use vice_files::atomic::{self, Overwrite};
use vice_files::leftovers;

use super::key::Key;
use super::manifest::{Manifest, Row};
use crate::request::Request;
use crate::result::{ResultDocument, read_bytes};
use crate::text::hex;

const BATCH_SCHEMA: &str = "vice.batch/2";
const ROW_SCHEMA: &str = "vice.row/1";

/// A file that was begun so long ago was never ended: whoever wrote it was killed.
const ABANDONED: Duration = Duration::from_secs(3600);

/// What a run keeps beside its result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Keep {
    /// The scored samples, as Parquet.
    pub samples: bool,
    /// A report, without pictures of the recording.
    pub reports: bool,
}

/// A batch's folder.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

/// What a batch is to hold, in the order of its manifest: `batch.json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Listed {
    schema: String,
    pub(super) rows: Vec<ListedRow>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct ListedRow {
    pub(super) run_id: String,
    pub(super) group: String,
    /// The flight that it stands under in a table.
    pub(super) flight: String,
    /// Whose the estimates are, in their order; empty where the streams' names say it.
    pub(super) estimators: Vec<String>,
    pub(super) dataset: String,
    /// Hash of what is asked, so that the answer to an older manifest is not taken for one to this.
    pub(super) asked: String,
}

/// How a run went: `rows/HASH.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RowRecord {
    schema: String,
    /// Its name.
    pub run_id: String,
    /// Hash of what was asked.
    pub(super) asked: String,
    /// What its result is filed under; null where not even that could be found.
    pub key: Option<Key>,
    /// Why there is no result.
    pub error: Option<String>,
    /// As `vice evaluate` would have ended: 0 done, 1 failed, 2 wrong usage; 101 where the program itself is at fault.
    pub exit_code: u8,
    /// How long it took, seconds.
    pub seconds: f64,
}

impl RowRecord {
    /// How a run went.
    pub(super) fn new(row: &Row, key: Option<Key>, error: Option<(String, u8)>, seconds: f64) -> Self {
        let (error, exit_code) = error.map_or((None, 0), |(text, code)| (Some(text), code));
        let (schema, run_id) = (ROW_SCHEMA.to_string(), row.run_id.clone());
        Self { schema, run_id, asked: asked(&row.request), key, error, exit_code, seconds }
    }

    /// Whether it says that a key holds the answer to a row.
    pub(super) fn answers(&self, row: &Row, key: &Key) -> bool {
        self.key.as_ref() == Some(key) && self.error.is_none() && self.asked == asked(&row.request)
    }
}

impl Store {
    /// The folder of a batch that is there or will be.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Makes it ready for the runs of a manifest.
    pub(super) fn prepare(&self, manifest: &Manifest) -> DataResult<()> {
        for name in ["runs", "rows", "reports"] {
            let folder = self.folder.join(name);
            fs::create_dir_all(&folder)
                .map_err(|e| DataError::new("the folder cannot be made").at(&folder).because(e))?;
            leftovers::remove_abandoned(&folder, ".vice-", ".part", ABANDONED);
        }
        let rows = manifest.rows.iter().map(|row| ListedRow {
            run_id: row.run_id.clone(),
            group: row.group.clone(),
            flight: row.flight.clone(),
            estimators: row.estimators.clone(),
            dataset: shown_path(&row.request.dataset.path).display().to_string(),
            asked: asked(&row.request),
        });
        let listed = Listed { schema: BATCH_SCHEMA.to_string(), rows: rows.collect() };
        if self.listed().is_ok_and(|there| there == listed) {
            return Ok(());
        }
        write_json(&self.folder.join("batch.json"), &listed)
    }

    /// What is to be there.
    pub(super) fn listed(&self) -> DataResult<Listed> {
        let path = self.folder.join("batch.json");
        if !path.exists() {
            return Err(DataError::of_kind(ErrorKind::Missing, "is no folder of a batch")
                .at(&self.folder)
                .hint("`vice batch MANIFEST --out FOLDER` makes one"));
        }
        let listed: Listed = parse(&path)?;
        expect(&listed.schema, BATCH_SCHEMA).map_err(|e| e.at(&path))?;
        Ok(listed)
    }

    pub(super) fn hashes(&self) -> PathBuf {
        self.folder.join("hashes.json")
    }

    /// Where the result of a key is.
    pub fn result_path(&self, key: &Key) -> PathBuf {
        self.folder.join("runs").join(format!("{key}.json"))
    }

    /// Where the scored samples of a key are, if they were kept.
    pub fn samples_path(&self, key: &Key) -> PathBuf {
        self.folder.join("runs").join(format!("{key}.parquet"))
    }

    /// Where the report of a key is, if one was made; from the folder.
    pub(super) fn report_name(key: &str) -> String {
        format!("reports/{key}.html")
    }

    /// Whether it is the folder of a batch.
    pub fn is_there(&self) -> bool {
        self.folder.join("batch.json").is_file()
    }

    /// Whether reports were made.
    pub fn has_reports(&self) -> bool {
        fs::read_dir(self.folder.join("reports")).is_ok_and(|mut entries| entries.next().is_some())
    }

    /// Whether all that is asked for is there.
    pub(super) fn has(&self, key: &Key, keep: Keep) -> bool {
        self.result_path(key).exists()
            && (!keep.samples || self.samples_path(key).exists())
            && (!keep.reports || self.folder.join(Self::report_name(&key.to_string())).exists())
    }

    fn row_path(&self, run_id: &str) -> PathBuf {
        let hash = hex(&Sha256::digest(run_id.as_bytes())[..16]);
        self.folder.join("rows").join(format!("{hash}.json"))
    }

    /// How a run went, where it was tried.
    pub(super) fn row(&self, run_id: &str) -> DataResult<Option<RowRecord>> {
        let path = self.row_path(run_id);
        if !path.exists() {
            return Ok(None);
        }
        let row: RowRecord = parse(&path)?;
        expect(&row.schema, ROW_SCHEMA).map_err(|e| e.at(&path))?;
        Ok(Some(row))
    }

    pub(super) fn write_row(&self, row: &RowRecord) -> DataResult<()> {
        write_json(&self.row_path(&row.run_id), row)
    }

    pub(super) fn write_report(&self, key: &Key, page: &str) -> DataResult<()> {
        let path = self.folder.join(Self::report_name(&key.to_string()));
        atomic::write(path, Overwrite::Replace, |out| out.write_all(page.as_bytes()))
    }

    pub(super) fn write_result(&self, key: &Key, document: &ResultDocument) -> DataResult<()> {
        write_json(&self.result_path(key), document)
    }
}

fn asked(request: &Request) -> String {
    // A request is plain data: there is nothing in it that JSON cannot hold.
    let text = serde_json::to_vec(request).unwrap_or_default();
    hex(&Sha256::digest(text)[..8])
}

fn expect(schema: &str, known: &str) -> DataResult<()> {
    if schema == known {
        return Ok(());
    }
    Err(DataError::of_kind(ErrorKind::Unsupported, format!("is {schema}, this VICE reads {known}"))
        .hint("make the batch in another folder"))
}

fn parse<T: serde::de::DeserializeOwned>(path: &Path) -> DataResult<T> {
    serde_json::from_slice(&read_bytes(path)?).map_err(|e| {
        DataError::new("has a mistake in it").at(path).because(e).hint("delete it and run again")
    })
}

fn write_json(path: &Path, value: &impl Serialize) -> DataResult<()> {
    atomic::write(path, Overwrite::Replace, |out| {
        serde_json::to_writer(&mut *out, value)?;
        out.write_all(b"\n")
    })
}
