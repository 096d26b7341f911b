//! The labels while they are edited: never lost, never merged blindly.
//!
//! | part | what |
//! | --- | --- |
//! | [`Document`] | the labels in memory; every change is a list of [`Cell`]s |
//! | [`Edit`] | what a person does, checked and turned into cells |
//! | [`History`] | undo and redo without limit |
//! | journal | every change on the disk before it is acknowledged |
//! | [`Store`] | all of them together, and the labels file, which is written beside and renamed |

mod claim;
mod document;
mod edit;
mod history;
mod journal;
mod open;
mod replay;
mod save;
mod segments;
mod utc;

use std::path::{Path, PathBuf};

use vice_core::error::DataError;

pub use document::{Cell, Document};
pub use edit::{Checks, Edit};
pub use history::{By, History, Step};
pub use journal::{FileMark, JOURNAL_SCHEMA};
pub use open::Target;
pub use save::{SaveWork, Saver};
pub(crate) use save::{lock, save_now};

use document::{inverse, touched};
use journal::{Journal, Line};

/// Why a change was not made. Nothing has changed then, neither in memory nor on the disk.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The writer did not know of a change that was made before.
    #[error("the labels have changed meanwhile (revision {revision})")]
    Stale {
        /// The revision that holds.
        revision: u64,
    },
    /// The labels are open for reading only.
    #[error("the labels are read-only: {0}")]
    ReadOnly(String),
    /// There is no step to take back, or none to make again.
    #[error("there is nothing to {0}")]
    Nothing(&'static str),
    /// The edit does not fit the labels or the data set.
    #[error(transparent)]
    Refused(DataError),
    /// The journal cannot be written.
    #[error(transparent)]
    Disk(DataError),
}

/// What a change did.
#[derive(Clone, Debug, PartialEq)]
pub struct Changed {
    /// The revision after it.
    pub revision: u64,
    /// Names of the points that it touched, sorted; those that are not there any more were removed.
    pub points: Vec<String>,
    /// What it came from.
    pub by: By,
    /// What the step was.
    pub label: String,
}

/// The labels of one camera of one data set, with their journal and file.
#[derive(Debug)]
pub struct Store {
    path: PathBuf,
    document: Document,
    history: History,
    revision: u64,
    /// The last revision that was not the tracker's: what a writer must know of.
    settled: u64,
    last_job: u64,
    journal: Option<Journal>,
    /// The labels file, locked; `None` where there is none yet.
    claim: Option<std::fs::File>,
    read_only: Option<String>,
    /// The labels file as it was last read or written.
    file: Option<FileMark>,
    /// The revision that it holds; `None` where it has to be written in any case.
    saved: Option<u64>,
    save_problem: Option<String>,
}

impl Store {
    /// The labels.
    pub const fn document(&self) -> &Document {
        &self.document
    }

    /// The labels file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of changes so far; grows by one with each.
    pub const fn revision(&self) -> u64 {
        self.revision
    }

    /// Why nothing can be changed, where that is so.
    pub fn read_only(&self) -> Option<&str> {
        self.read_only.as_deref()
    }

    /// Why the labels file could not be written last time. The changes are in the journal all the same.
    pub fn save_problem(&self) -> Option<&str> {
        self.save_problem.as_deref()
    }

    /// Whether there is a step to take back.
    pub fn can_undo(&self) -> bool {
        self.history.to_undo().is_some()
    }

    /// Whether there is a step to make again.
    pub fn can_redo(&self) -> bool {
        self.history.to_redo().is_some()
    }

    /// A number for a job that no earlier one had.
    pub fn new_job(&mut self) -> u64 {
        self.last_job += 1;
        self.last_job
    }

    /// Makes edits as one step, all or none. `known` is the revision that the writer has seen.
    ///
    /// What the tracker added since does not make a writer stale: a hand always wins over it.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub fn edit(&mut self, known: u64, edits: &[Edit], checks: &Checks<'_>) -> Result<Changed, StoreError> {
        self.check_known(known)?;
        let mut cells: Vec<Cell> = Vec::new();
        for edit in edits {
            // Later edits build on earlier ones.
            let step = edit.cells(&self.document, checks).map_err(StoreError::Refused).and_then(|step| {
                self.document.apply(&step).map_err(|c| StoreError::Refused(disagree(&c)))?;
                Ok(step)
            });
            match step {
                Ok(step) => cells.extend(step),
                Err(error) => {
                    self.take_back(&cells);
                    return Err(error);
                }
            }
        }
        self.take_back(&cells);
        let label = match edits {
            [] => String::new(),
            [edit] => edit.label(),
            [first, ..] => format!("{} and {} more", first.label(), edits.len() - 1),
        };
        self.commit(By::Edit, label, None, cells)
    }

    /// Makes a step of cells that were worked out elsewhere; a part of a job is added to the job's step.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub fn commit(
        &mut self,
        by: By,
        label: String,
        job: Option<u64>,
        cells: Vec<Cell>,
    ) -> Result<Changed, StoreError> {
        if cells.is_empty() {
            return Ok(Changed { revision: self.revision, points: vec![], by, label });
        }
        self.check_writable()?;
        self.document.apply(&cells).map_err(|c| StoreError::Refused(disagree(&c)))?;
        let line = Line::Change { by, label: label.clone(), job, cells: cells.clone() };
        if let Err(error) = self.write(&line) {
            self.take_back(&cells);
            return Err(error);
        }
        let points = touched(&cells).into_iter().map(str::to_string).collect();
        self.history.push(Step { label: label.clone(), cells, job });
        Ok(self.changed(by, label, points))
    }

    /// Takes the last step back.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub fn undo(&mut self, known: u64) -> Result<Changed, StoreError> {
        self.check_known(known)?;
        let step = self.history.to_undo().cloned().ok_or(StoreError::Nothing("undo"))?;
        let changed = self.turn(&Line::Undo, By::Undo, &inverse(&step.cells), step.label)?;
        self.history.undone();
        Ok(changed)
    }

    /// Makes the step again that was taken back last.
    ///
    /// # Errors
    /// [`StoreError`]; nothing has changed then.
    pub fn redo(&mut self, known: u64) -> Result<Changed, StoreError> {
        self.check_known(known)?;
        let step = self.history.to_redo().cloned().ok_or(StoreError::Nothing("redo"))?;
        let changed = self.turn(&Line::Redo, By::Redo, &step.cells, step.label)?;
        self.history.redone();
        Ok(changed)
    }

    fn turn(&mut self, line: &Line, by: By, cells: &[Cell], label: String) -> Result<Changed, StoreError> {
        self.check_writable()?;
        self.document.apply(cells).map_err(|c| StoreError::Refused(disagree(&c)))?;
        if let Err(error) = self.write(line) {
            self.take_back(cells);
            return Err(error);
        }
        let points = touched(cells).into_iter().map(str::to_string).collect();
        Ok(self.changed(by, label, points))
    }

    fn changed(&mut self, by: By, label: String, points: Vec<String>) -> Changed {
        self.revision += 1;
        if by != By::Track {
            self.settled = self.revision;
        }
        Changed { revision: self.revision, points, by, label }
    }

    fn write(&mut self, line: &Line) -> Result<(), StoreError> {
        match &mut self.journal {
            Some(journal) => journal.append(line).map_err(StoreError::Disk),
            None => Err(StoreError::ReadOnly("no journal is open".to_string())),
        }
    }

    fn take_back(&mut self, cells: &[Cell]) {
        // These cells were carried out on this very document a moment ago.
        let undone = self.document.apply(&inverse(cells));
        debug_assert!(undone.is_ok());
    }

    pub(crate) fn check_known(&self, known: u64) -> Result<(), StoreError> {
        self.check_writable()?;
        if known < self.settled || known > self.revision {
            return Err(StoreError::Stale { revision: self.revision });
        }
        Ok(())
    }

    fn check_writable(&self) -> Result<(), StoreError> {
        match &self.read_only {
            Some(reason) => Err(StoreError::ReadOnly(reason.clone())),
            None => Ok(()),
        }
    }
}

fn disagree(cell: &Cell) -> DataError {
    DataError::new(format!(
        "the change does not fit the labels: point {} at {} ns is another one",
        cell.point, cell.stamp
    ))
}

#[cfg(test)]
mod tests;
