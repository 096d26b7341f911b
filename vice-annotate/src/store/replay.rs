//! What a journal's lines make of the labels.

use vice_core::error::{DataError, DataResult};

use super::document::{Document, inverse};
use super::history::{History, Step};
use super::journal::{Entry, FileMark, Line};

/// What a journal says.
pub(super) struct Replayed {
    pub(super) document: Document,
    pub(super) history: History,
    pub(super) revision: u64,
    pub(super) last_job: u64,
    /// Revision that the labels file holds for certain.
    pub(super) saved: u64,
    /// Contents that the labels file may have.
    pub(super) expected: Vec<Option<FileMark>>,
    /// Steps that could not be carried out, since lines before them are missing.
    pub(super) left_out: usize,
    base_unsaved: bool,
    /// Revision at the last line that said that the file is about to be replaced.
    saving: u64,
}

impl Replayed {
    pub(super) fn is_unsaved(&self) -> bool {
        self.revision != self.saved || self.base_unsaved
    }

    fn new(document: Document, file: Option<FileMark>, base_unsaved: bool) -> Self {
        Self {
            document,
            history: History::default(),
            revision: 0,
            last_job: 0,
            saved: 0,
            expected: vec![file],
            left_out: 0,
            base_unsaved,
            saving: 0,
        }
    }

    /// What can be had where lines are missing: what is read is carried out whether or not it fits what was before.
    /// `file` is what the labels file holds, for a journal whose first line is missing.
    pub(super) fn of_what_is_there(entries: &[Entry], file: Document) -> Self {
        let start = match entries.first().map(|e| &e.line) {
            Some(Line::Head { dataset, camera, base, .. }) => {
                let mut document = Document::default();
                document.dataset.clone_from(dataset);
                document.camera.clone_from(camera);
                document.put_all(base);
                document
            }
            _ => file,
        };
        let mut r = Self::new(start, None, false);
        for entry in entries {
            if entry.gap_before {
                // Steps of before the gap may not be the ones that undo meant behind it.
                r.history = History::default();
            }
            match &entry.line {
                Line::Change { cells, label, job, by: _ } => {
                    r.document.put_all(cells);
                    r.history.push(Step { label: label.clone(), cells: cells.clone(), job: *job });
                }
                Line::Undo => match r.history.to_undo().map(|step| inverse(&step.cells)) {
                    Some(cells) => {
                        r.document.put_all(&cells);
                        r.history.undone();
                    }
                    None => r.left_out += 1,
                },
                Line::Redo => match r.history.to_redo().map(|step| step.cells.clone()) {
                    Some(cells) => {
                        r.document.put_all(&cells);
                        r.history.redone();
                    }
                    None => r.left_out += 1,
                },
                Line::Head { .. } | Line::Saving { .. } | Line::Saved => {}
            }
        }
        r
    }

    /// Carries out one line; `None` where it does not fit the ones before.
    fn carry_out(&mut self, line: &Line) -> Option<()> {
        match line {
            Line::Head { .. } => return None,
            Line::Change { label, job, cells, by: _ } => {
                self.document.apply(cells).ok()?;
                self.history.push(Step { label: label.clone(), cells: cells.clone(), job: *job });
                self.last_job = self.last_job.max(job.unwrap_or(0));
            }
            Line::Undo => {
                let cells = inverse(&self.history.to_undo()?.cells);
                self.document.apply(&cells).ok()?;
                self.history.undone();
            }
            Line::Redo => {
                let step = self.history.to_redo()?;
                self.document.apply(&step.cells).ok()?;
                self.history.redone();
            }
            Line::Saving { file } => {
                self.expected.push(Some(*file));
                self.saving = self.revision;
                return Some(());
            }
            Line::Saved => {
                self.expected = self.expected.last().copied().into_iter().collect();
                self.saved = self.saving;
                self.base_unsaved = false;
                return Some(());
            }
        }
        self.revision += 1;
        Some(())
    }
}

/// Carries out the lines of a journal; `None` where there are none. Of one with lines missing that another process is
/// writing, what is there.
pub(super) fn replay(entries: &[Entry]) -> DataResult<Option<Replayed>> {
    let Some(first) = entries.first() else { return Ok(None) };
    if entries.iter().any(|e| e.gap_before) {
        return Ok(Some(Replayed::of_what_is_there(entries, Document::default())));
    }
    let wrong = |line: usize| DataError::new("a change does not fit the ones before").line(line as u64 + 1);
    let Line::Head { dataset, camera, file, base, .. } = &first.line else { return Err(wrong(0)) };
    let mut document = Document::default();
    document.dataset.clone_from(dataset);
    document.camera.clone_from(camera);
    document.apply(base).map_err(|_| wrong(0))?;
    let mut r = Replayed::new(document, *file, file.is_none() && !base.is_empty());
    for (i, entry) in entries.iter().enumerate().skip(1) {
        r.carry_out(&entry.line).ok_or_else(|| wrong(i))?;
    }
    Ok(Some(r))
}

/// The labels where the labels file was saved behind the last gap or at a line behind it, and all that follows can be
/// carried out on it.
pub(super) fn replay_behind(entries: &[Entry], file: Option<(FileMark, &Document)>) -> Option<Document> {
    let (mark, document) = file?;
    let gap = entries.iter().rposition(|e| e.gap_before)?;
    let saved = entries.iter().rposition(|e| matches!(&e.line, Line::Saving { file } if *file == mark))?;
    if saved < gap {
        return None;
    }
    let mut r = Replayed::new(document.clone(), Some(mark), false);
    for entry in &entries[saved + 1..] {
        r.carry_out(&entry.line)?;
    }
    Some(r.document)
}
