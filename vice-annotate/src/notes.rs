//! What a person says of lanes that no label can say: that there is nothing to label from one frame to another.
//!
//! It lies beside the labels file (`FILE.notes.json`), since it says nothing of where points are and no evaluation needs it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;
use vice_files::atomic::{self, Overwrite};

/// Name and version of the shape.
const SCHEMA: &str = "vice.notes/1";
/// Bytes of a file that is read.
const MOST_BYTES: u64 = 16 << 20;

/// A stretch of time, both ends among it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Stretch {
    /// Its first frame.
    #[serde(rename = "from_ns")]
    pub from: Stamp,
    /// Its last frame.
    #[serde(rename = "to_ns")]
    pub to: Stamp,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    /// By point.
    nothing_to_label: BTreeMap<String, Vec<Stretch>>,
}

/// What was said, and the file that keeps it.
#[derive(Debug)]
pub struct Notes {
    path: PathBuf,
    empty: BTreeMap<String, Vec<Stretch>>,
}

impl Notes {
    /// Reads the notes beside a labels file; none where there is no such file.
    ///
    /// # Errors
    /// [`DataError`] if the file cannot be read or is something else.
    pub fn open(labels: &Path) -> DataResult<Self> {
        let path = beside(labels, "notes");
        let wrong =
            |e: DataError| e.at(&path).hint("move it away: all it says is where there was nothing to label");
        let empty = match std::fs::metadata(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => BTreeMap::new(),
            Err(e) => return Err(wrong(DataError::new("cannot be read").because(e))),
            Ok(meta) if meta.len() > MOST_BYTES => {
                return Err(wrong(DataError::new("is too large for notes")));
            }
            Ok(_) => {
                let bytes =
                    std::fs::read(&path).map_err(|e| wrong(DataError::new("cannot be read").because(e)))?;
                let file: File = serde_json::from_slice(&bytes)
                    .map_err(|e| wrong(DataError::new(format!("is no {SCHEMA}: {e}"))))?;
                if file.schema != SCHEMA {
                    return Err(wrong(DataError::new(format!("is `{}`, not {SCHEMA}", file.schema))));
                }
                file.nothing_to_label.into_iter().map(|(point, list)| (point, merged(list))).collect()
            }
        };
        Ok(Self { path, empty })
    }

    /// Where there is nothing to label, by point: apart from each other, ascending.
    pub const fn empty(&self) -> &BTreeMap<String, Vec<Stretch>> {
        &self.empty
    }

    /// Says that there is nothing to label of a point in a stretch, or takes that back; written before it returns.
    ///
    /// # Errors
    /// [`DataError`] if it cannot be written; nothing has changed then.
    pub fn say(&mut self, point: &str, stretch: Stretch, nothing: bool) -> DataResult<()> {
        let mut all = self.empty.clone();
        let list = all.entry(point.to_string()).or_default();
        if nothing {
            list.push(stretch);
        } else {
            list.retain(|s| s.to < stretch.from || s.from > stretch.to);
        }
        *list = merged(std::mem::take(list));
        all.retain(|_, list| !list.is_empty());
        self.put(all)
    }

    /// A point has another name.
    ///
    /// # Errors
    /// [`DataError`] if it cannot be written; nothing has changed then.
    pub fn rename(&mut self, point: &str, to: &str) -> DataResult<()> {
        let mut all = self.empty.clone();
        let Some(list) = all.remove(point) else { return Ok(()) };
        all.insert(to.to_string(), list);
        self.put(all)
    }

    fn put(&mut self, all: BTreeMap<String, Vec<Stretch>>) -> DataResult<()> {
        if all == self.empty {
            return Ok(());
        }
        let file = File { schema: SCHEMA.to_string(), nothing_to_label: all };
        let text = serde_json::to_string_pretty(&file)
            .map_err(|e| DataError::new("the notes cannot be written").at(&self.path).because(e))?;
        atomic::write(&self.path, Overwrite::Replace, |w| w.write_all(text.as_bytes()))?;
        self.empty = file.nothing_to_label;
        Ok(())
    }
}

/// A file beside the labels, by what it holds.
pub(crate) fn beside(labels: &Path, what: &str) -> PathBuf {
    let mut name = labels.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{what}.json"));
    labels.with_file_name(name)
}

/// Stretches in order, those that overlap as one; ends that are the wrong way round are turned.
fn merged(mut list: Vec<Stretch>) -> Vec<Stretch> {
    for stretch in &mut list {
        if stretch.from > stretch.to {
            std::mem::swap(&mut stretch.from, &mut stretch.to);
        }
    }
    list.sort();
    let mut merged: Vec<Stretch> = Vec::new();
    for next in list {
        match merged.last_mut() {
            Some(last) if next.from <= last.to => last.to = last.to.max(next.to),
            _ => merged.push(next),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretch(from: i64, to: i64) -> Stretch {
        Stretch { from: Stamp::from_nanos(from), to: Stamp::from_nanos(to) }
    }

    #[test]
    fn what_is_said_is_kept_beside_the_labels_and_can_be_taken_back() {
        let folder = tempfile::tempdir().unwrap();
        let labels = folder.path().join("my.json");
        let mut notes = Notes::open(&labels).unwrap();
        assert!(notes.empty().is_empty());
        notes.say("1", stretch(30, 50), true).unwrap();
        notes.say("1", stretch(10, 20), true).unwrap();
        notes.say("1", stretch(40, 60), true).unwrap();
        notes.say("2", stretch(5, 5), true).unwrap();
        notes.rename("2", "door").unwrap();
        let again = Notes::open(&labels).unwrap();
        assert_eq!(again.empty(), notes.empty());
        assert_eq!(again.empty()["1"], [stretch(10, 20), stretch(30, 60)]);
        assert_eq!(again.empty()["door"], [stretch(5, 5)]);
        notes.say("1", stretch(45, 45), false).unwrap();
        assert_eq!(Notes::open(&labels).unwrap().empty()["1"], [stretch(10, 20)]);
        assert!(!labels.exists(), "notes touch no labels");
    }

    #[test]
    fn what_is_no_notes_is_refused_with_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let labels = folder.path().join("my.json");
        for text in ["", "[]", r#"{"schema": "vice.notes/9", "nothing_to_label": {}}"#, "{\"schema\": 1}"] {
            std::fs::write(beside(&labels, "notes"), text).unwrap();
            let error = vice_core::error::one_line(&Notes::open(&labels).unwrap_err());
            assert!(error.contains("my.json.notes.json") && error.contains("move it away"), "{error}");
        }
    }
}
