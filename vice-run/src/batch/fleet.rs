//! The results of a batch, wherever they lie, as a table.

use std::path::Path;

use super::beside::Beside;
use super::collect::collect;
use super::fleet_table::{Format, render};
use super::results::ResultRow;
use super::results_file;
use super::samples::Samples;
use super::store::Store;
use crate::error::RunResult;

/// The results of a batch, to be shown as a table.
#[derive(Clone, Debug)]
pub struct FleetTable {
    rows: Vec<ResultRow>,
    /// The folder of the batch, where the results lie in it.
    store: Option<Store>,
    links: String,
}

impl FleetTable {
    /// Reads the folder of a batch, or a `results.csv` or `results.parquet`. One that lies in the folder of its batch has
    /// the samples beside it.
    ///
    /// # Errors
    /// [`RunError`](crate::error::RunError) if it is none of these, or broken.
    pub fn open(path: &Path) -> RunResult<Self> {
        let folder = if path.is_dir() { Some(path) } else { path.parent() };
        let store = folder.map(Store::new).filter(|s| path.is_dir() || s.is_there());
        let rows = match &store {
            Some(store) if path.is_dir() => collect(store)?.rows,
            _ => results_file::read(path)?,
        };
        let links = folder.map_or_else(String::new, |f| f.join("").display().to_string());
        Ok(Self { rows, store, links })
    }

    /// The table.
    ///
    /// # Errors
    /// [`RunError`](crate::error::RunError) if a text is none.
    pub fn render(&self, format: Format) -> RunResult<String> {
        let beside = Beside {
            samples: self.store.as_ref().map_or(Samples::None, Samples::Store),
            links: self.store.as_ref().filter(|s| s.has_reports()).map(|_| self.links.as_str()),
        };
        render(&self.rows, &beside, format)
    }
}
