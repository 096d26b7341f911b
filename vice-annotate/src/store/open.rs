//! Opening labels: the file, what the journal adds to it, and whether both belong to this data set.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use vice_core::error::{DataError, DataResult};
use vice_core::label::LabelSet;
use vice_core::time::Stamp;
use vice_files::image_file::read_bytes;
use vice_files::labels::{self, LabelFormat, read_json_or_none};

use super::claim::{self, Claim};
use super::document::{Cell, Document};
use super::history::History;
use super::journal::{FileMark, JOURNAL_SCHEMA, Journal, Line, Opened, Reading, keep_copy};
use super::replay::{Replayed, replay, replay_behind};
use super::{By, Store};

/// Bytes of a journal beyond which it starts anew once all is saved.
const MAX_JOURNAL: u64 = 64 << 20;

/// What labels must belong to.
pub struct Target<'a> {
    /// Name of the data set.
    pub dataset: &'a str,
    /// The camera.
    pub camera: &'a str,
    /// Its frames.
    pub frames: &'a [Stamp],
}

impl Store {
    /// Opens labels for editing, with what the journal beside the file adds; a file that is not there yet is made with
    /// the first change. A CSV or pickle is never written: its labels go on in a JSON beside it.
    ///
    /// Where another process edits the same labels they are open for reading only.
    ///
    /// # Errors
    /// [`DataError`] if the file or its journal cannot be read, belongs to another data set or camera, may not be
    /// written, or the file was changed by another program while the journal holds changes that are not in it.
    pub fn open(labels: &Path, target: &Target<'_>) -> DataResult<Self> {
        let (path, import) = place(&claim::real(labels), target.frames)?;
        check_writable(&path)?;
        let journal_path = journal_path(&path);
        let file = match read_bytes_if_there(&path)? {
            Some(bytes) => {
                let labels = read_json_or_none(&bytes).map_err(|e| {
                    let e = e.at(&path);
                    if journal_path.exists() {
                        e.hint(
                            "the journal beside it holds all labels: move this file away to have them back",
                        )
                    } else {
                        e
                    }
                })?;
                Some((FileMark::of(&bytes), Document::from_labels(&labels)))
            }
            None => None,
        };
        let base = match (&file, import) {
            (Some((_, document)), _) => document.clone(),
            (None, Some(labels)) => Document::from_labels(&labels),
            (None, None) => Document::default(),
        };
        let mark = file.as_ref().map(|(mark, _)| *mark);
        let claim = claim::take(&path)?;
        let mut store = match (Journal::open(&journal_path)?, claim) {
            (Opened::Locked(journal, reading), Claim::Ours(claim)) if reading.has_gap() => {
                let mut store = Self::recovered(path, journal, &reading, (mark, base), target)?;
                store.claim = claim;
                store
            }
            (Opened::Locked(journal, reading), Claim::Ours(claim)) => {
                let replayed = replay(&reading.entries).map_err(|e| e.at(&journal_path))?;
                let mut store = Self::writable(path, journal, replayed, (mark, base), target)?;
                store.claim = claim;
                store
            }
            (Opened::Taken(reading), _) => {
                let mut store = match replay(&reading.entries).map_err(|e| e.at(&journal_path))? {
                    Some(replayed) => Self::from_replay(path, replayed, mark),
                    None => Self::fresh(path, base, mark),
                };
                store.read_only = Some("another vice annotate is editing this file".to_string());
                store
            }
            // The same file under another name (a hard link) has a journal of its own.
            (Opened::Locked(..), Claim::Taken) => {
                let mut store = Self::fresh(path, base, mark);
                store.read_only =
                    Some("another vice annotate is editing this file under another name".to_string());
                store
            }
        };
        check_belongs(&store.document, target).map_err(|e| e.at(&store.path))?;
        store.document.dataset.get_or_insert_with(|| target.dataset.to_string());
        store.document.camera.get_or_insert_with(|| target.camera.to_string());
        Ok(store)
    }

    fn writable(
        path: PathBuf,
        mut journal: Journal,
        replayed: Option<Replayed>,
        (mark, base): (Option<FileMark>, Document),
        target: &Target<'_>,
    ) -> DataResult<Self> {
        let shown = path.display().to_string();
        let (mut store, start) = match replayed {
            None => (Self::fresh(path, base, mark), true),
            Some(r) if mark.is_none() && r.expected.iter().all(Option::is_some) => {
                tracing::warn!(
                    "{shown} is missing: its labels are restored from the journal beside it (remove that to begin anew)"
                );
                let mut store = Self::from_replay(path, r, mark);
                store.saved = None;
                (store, false)
            }
            Some(r) if !r.expected.contains(&mark) => {
                if r.is_unsaved() {
                    let changes = r.revision - r.saved;
                    return Err(DataError::new(format!(
                        "was changed by another program, and the journal beside it holds {changes} changes that are not in it"
                    ))
                    .at(&path)
                    .hint("move one of the two away to go on with the other"));
                }
                tracing::warn!(
                    "{shown} was changed by another program: the undo history of before is dropped"
                );
                (Self::fresh(path, base, mark), true)
            }
            Some(r) => {
                let unsaved = r.is_unsaved();
                let changes = r.revision - r.saved;
                if unsaved && changes > 0 {
                    tracing::warn!(
                        "{shown}: {changes} changes that were not saved are restored from the journal"
                    );
                }
                let too_long = journal.len() > MAX_JOURNAL && !unsaved;
                if too_long {
                    tracing::warn!(
                        "{shown}: the journal has become long; the undo history of before is dropped"
                    );
                    (Self::fresh(path, r.document, mark), true)
                } else {
                    (Self::from_replay(path, r, mark), false)
                }
            }
        };
        if start {
            // What belongs elsewhere leaves no trace.
            check_belongs(&store.document, target).map_err(|e| e.at(&store.path))?;
            journal.restart(&head(&store.document, mark))?;
        }
        store.journal = Some(journal);
        Ok(store)
    }

    /// The labels from a journal with lines missing: where the labels file was saved after those, nothing is lost but
    /// steps of undo; else what can be read is carried out on what there is.
    fn recovered(
        path: PathBuf,
        mut journal: Journal,
        reading: &Reading,
        (mark, base): (Option<FileMark>, Document),
        target: &Target<'_>,
    ) -> DataResult<Self> {
        let shown = path.display();
        let (document, told) = match replay_behind(&reading.entries, mark.zip(Some(&base))) {
            Some(document) => {
                (document, "the labels file was saved after what is missing: no label is lost".to_string())
            }
            None => {
                if mark.is_some() {
                    let kept = keep_copy(&path, &read_bytes(&path)?)
                        .map_err(|e| DataError::new("no copy can be kept").at(&path).because(e))?;
                    tracing::warn!("{shown}: as it was it is kept as {}", kept.display());
                }
                let r = Replayed::of_what_is_there(&reading.entries, base);
                let told = match r.left_out {
                    0 => "all entries that can be read are carried out; look over the labels".to_string(),
                    n => format!("{n} steps of undo or redo could not be carried out; look over the labels"),
                };
                (r.document, told)
            }
        };
        tracing::warn!("{shown}: {told}; the undo history of before is dropped");
        check_belongs(&document, target).map_err(|e| e.at(&path))?;
        journal.restart(&head(&document, mark))?;
        let mut store = Self::fresh(path, document, mark);
        store.saved = None;
        store.journal = Some(journal);
        Ok(store)
    }

    fn fresh(path: PathBuf, document: Document, file: Option<FileMark>) -> Self {
        Self {
            path,
            document,
            history: History::default(),
            revision: 0,
            settled: 0,
            last_job: 0,
            journal: None,
            claim: None,
            read_only: None,
            file,
            saved: Some(0),
            save_problem: None,
        }
    }

    fn from_replay(path: PathBuf, r: Replayed, file: Option<FileMark>) -> Self {
        Self {
            history: r.history,
            revision: r.revision,
            settled: r.revision,
            last_job: r.last_job,
            saved: Some(r.saved),
            ..Self::fresh(path, r.document, file)
        }
    }
}

/// Where the journal of a labels file is.
pub(super) fn journal_path(labels: &Path) -> PathBuf {
    let mut name = labels.as_os_str().to_os_string();
    name.push(".journal");
    PathBuf::from(name)
}

fn head(document: &Document, file: Option<FileMark>) -> Line {
    let base = document.points().flat_map(|(point, observations)| {
        observations.iter().map(move |(stamp, o)| Cell {
            point: point.to_string(),
            stamp: *stamp,
            before: None,
            after: Some(*o),
        })
    });
    Line::Head {
        schema: JOURNAL_SCHEMA.to_string(),
        dataset: document.dataset.clone(),
        camera: document.camera.clone(),
        file,
        base: base.collect(),
    }
}

/// The file that is edited, and labels to begin with where it is not there yet.
fn place(labels: &Path, frames: &[Stamp]) -> DataResult<(PathBuf, Option<LabelSet>)> {
    let beside = labels.with_extension("json");
    let Some(bytes) = read_bytes_if_there(labels)? else {
        return match LabelFormat::for_writing(labels)? {
            LabelFormat::Json => Ok((labels.to_path_buf(), None)),
            _ => Ok((beside, None)),
        };
    };
    if beside == labels || LabelFormat::of_content(&bytes) == LabelFormat::Json {
        return Ok((labels.to_path_buf(), None));
    }
    if beside.exists() || journal_path(&beside).exists() {
        tracing::warn!("{}: its labels go on in {}, which is opened", labels.display(), beside.display());
        return Ok((beside, None));
    }
    Ok((beside, Some(labels::read(labels, Some(frames))?)))
}

fn read_bytes_if_there(path: &Path) -> DataResult<Option<Vec<u8>>> {
    match fs::metadata(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        Ok(meta) if !meta.is_file() => Err(DataError::new("is no ordinary file").at(path)),
        _ => read_bytes(path).map(Some),
    }
}

fn check_writable(path: &Path) -> DataResult<()> {
    if fs::metadata(path).is_ok_and(|m| m.permissions().readonly()) {
        return Err(DataError::new("is read-only")
            .at(path)
            .hint("make it writable, or copy it and edit the copy"));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(DataError::new("the folder of the labels does not exist")
            .at(path)
            .hint("create it first"));
    }
    Ok(())
}

/// Refuses labels of another data set or camera.
fn check_belongs(document: &Document, target: &Target<'_>) -> DataResult<()> {
    if let Some(camera) = document.camera.as_deref().filter(|c| *c != target.camera) {
        return Err(DataError::new(format!(
            "these are labels of the camera {camera}, not of {}",
            target.camera
        ))
        .hint(format!("choose it with `camera` {camera}")));
    }
    let stamps = || document.points().flat_map(|(_, observations)| observations.keys());
    let all = stamps().count();
    let elsewhere = stamps().filter(|s| target.frames.binary_search(s).is_err()).count();
    if let Some(dataset) = document.dataset.as_deref().filter(|d| *d != target.dataset) {
        if elsewhere > 0 || all == 0 {
            return Err(DataError::new(format!(
                "these are labels of the data set {dataset}, not of {}",
                target.dataset
            )));
        }
        // The same frames to the nanosecond: the folder has another name.
        tracing::warn!(
            "the labels name the data set {dataset}; their frames are those of {}",
            target.dataset
        );
    }
    if all > 0 && elsewhere == all {
        return Err(DataError::new("none of the labels is at a frame of this data set")
            .hint(format!("is {} what was labelled?", target.dataset)));
    }
    if elsewhere > 0 {
        tracing::warn!(
            "{elsewhere} of {all} labels are at no frame of this data set; they are kept, but not shown"
        );
    }
    Ok(())
}

impl By {
    /// The name in journals and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Edit => "edit",
            Self::Track => "track",
            Self::Detect => "detect",
            Self::Import => "import",
            Self::Undo => "undo",
            Self::Redo => "redo",
        }
    }
}
