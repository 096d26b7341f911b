//! The journal: every change is a line on the disk before it is acknowledged.
//!
//! A line is `LENGTH CRC32 JSON`: the number of bytes of the JSON, their check sum in hexadecimal, and the JSON itself,
//! which holds no line break. What a crash left half written at the end is recognised by that and cut off; nothing
//! else is ever dropped. The first line holds the labels as they were, so that the journal by itself gives them all.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vice_core::error::{DataError, DataResult};

use super::document::Cell;
use super::history::By;

/// Name and version of the journal's schema.
pub const JOURNAL_SCHEMA: &str = "vice.journal/1";

/// A file's content, by length and check sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileMark {
    /// Bytes.
    pub len: u64,
    /// CRC-32 of them.
    pub crc32: u32,
}

impl FileMark {
    /// The mark of bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self { len: bytes.len() as u64, crc32: crc32fast::hash(bytes) }
    }
}

/// What a line says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "is", rename_all = "kebab-case")]
pub(crate) enum Line {
    /// The first line: where the journal starts from.
    Head {
        schema: String,
        dataset: Option<String>,
        camera: Option<String>,
        /// The labels file then; `None` where there was none.
        file: Option<FileMark>,
        /// All observations, as cells that add them.
        base: Vec<Cell>,
    },
    /// A step, or a part of a job's step.
    Change {
        by: By,
        label: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        job: Option<u64>,
        cells: Vec<Cell>,
    },
    /// The last step was taken back.
    Undo,
    /// It was made again.
    Redo,
    /// The labels file is about to be replaced by one with this content.
    Saving { file: FileMark },
    /// That was done.
    Saved,
}

/// An open journal, locked against other processes.
#[derive(Debug)]
pub(crate) struct Journal {
    path: PathBuf,
    file: File,
    /// Bytes of whole lines.
    len: u64,
    /// Set when a failed write could not be taken back: the file's end is not known any more.
    broken: bool,
    /// Nothing has happened yet: then the file goes away again with the journal.
    untouched: bool,
}

impl Drop for Journal {
    fn drop(&mut self) {
        if self.untouched {
            // It would hold what the labels file holds; left behind it does no harm.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// How opening a journal ended.
pub(crate) enum Opened {
    /// It is ours; these are its lines, none where it is new.
    Locked(Journal, Vec<Line>),
    /// Another process has it; the lines as far as they are whole.
    Taken(Vec<Line>),
}

impl Journal {
    /// Opens or creates a journal and locks it.
    pub(crate) fn open(path: &Path) -> DataResult<Opened> {
        let failed = |e: std::io::Error| DataError::new("the journal cannot be opened").at(path).because(e);
        let mut file = loop {
            let mut file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(path)
                .map_err(failed)?;
            match file.try_lock() {
                // Another process may have replaced or removed the file between opening and locking it.
                Ok(()) if is_at(&file, path) => break file,
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut bytes = Vec::new();
                    file.read_to_end(&mut bytes).map_err(failed)?;
                    // The other process may be writing its last line just now.
                    return Ok(Opened::Taken(parse(&bytes).map_err(|e| e.at(path))?.lines));
                }
                Err(TryLockError::Error(e)) => return Err(failed(e)),
            }
        };
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let parsed = parse(&bytes).map_err(|e| e.at(path))?;
        if parsed.torn > 0 {
            tracing::warn!(
                "{}: the last line was not finished when the program ended and is dropped ({} bytes); it was never acknowledged",
                path.display(),
                parsed.torn
            );
            file.set_len(parsed.len).and_then(|()| file.sync_all()).map_err(failed)?;
        }
        let untouched = parsed.lines.len() <= 1;
        let journal = Self { path: path.to_path_buf(), file, len: parsed.len, broken: false, untouched };
        Ok(Opened::Locked(journal, parsed.lines))
    }

    /// Appends a line and waits until it is on the disk. After an error the journal is as before.
    pub(crate) fn append(&mut self, line: &Line) -> DataResult<()> {
        let failed = |e: std::io::Error, path: &Path| {
            DataError::new("the change is not made: it cannot be written to the journal")
                .at(path)
                .hint("is the disk full?")
                .because(e)
        };
        if self.broken {
            return Err(DataError::new("an earlier write failed and could not be taken back")
                .at(&self.path)
                .hint("make room on the disk and start vice annotate again"));
        }
        let bytes = frame(line)?;
        let written = self
            .file
            .seek(SeekFrom::Start(self.len))
            .and_then(|_| self.file.write_all(&bytes))
            .and_then(|()| self.file.sync_data());
        if let Err(e) = written {
            self.broken = self.file.set_len(self.len).and_then(|()| self.file.sync_data()).is_err();
            return Err(failed(e, &self.path));
        }
        self.len += bytes.len() as u64;
        self.untouched = matches!(line, Line::Head { .. });
        Ok(())
    }

    /// Starts anew with a first line; what was there is no longer needed.
    pub(crate) fn restart(&mut self, head: &Line) -> DataResult<()> {
        // The new line goes behind the old ones first: should the disk be full, these are still whole.
        let old = self.len;
        self.append(head)?;
        if old == 0 {
            return sync_folder_of(&self.path);
        }
        let failed = |e: std::io::Error| {
            DataError::new("the journal cannot be started anew").at(&self.path).because(e)
        };
        // A head behind other lines makes the reader forget them, so that a crash in between loses nothing either.
        let bytes = frame(head)?;
        let compact = tempfile_beside(&self.path, &bytes).map_err(failed)?;
        compact.as_file().try_lock().map_err(|e| failed(e.into()))?;
        let file = compact.persist(&self.path).map_err(|e| failed(e.error))?;
        sync_folder_of(&self.path)?;
        // The old file stays locked until here: whoever opened it before the rename was refused.
        self.file = file;
        self.len = bytes.len() as u64;
        Ok(())
    }

    /// Bytes on the disk.
    pub(crate) const fn len(&self) -> u64 {
        self.len
    }
}

/// Whether a path still names an open file.
fn is_at(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let place = |m: std::fs::Metadata| (m.dev(), m.ino());
        match (file.metadata(), std::fs::metadata(path)) {
            (Ok(open), Ok(named)) => place(open) == place(named),
            _ => false,
        }
    }
    #[cfg(not(unix))]
    {
        let _ = (file, path);
        true
    }
}

fn tempfile_beside(path: &Path, bytes: &[u8]) -> std::io::Result<tempfile::NamedTempFile> {
    let folder = folder_of(path);
    let mut file = tempfile::Builder::new().prefix(".vice-").suffix(".part").tempfile_in(folder)?;
    file.write_all(bytes)?;
    file.as_file().sync_all()?;
    Ok(file)
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Waits until the names in a file's folder are on the disk, so that a rename survives a loss of power.
pub(crate) fn sync_folder_of(path: &Path) -> DataResult<()> {
    if cfg!(unix) {
        File::open(folder_of(path))
            .and_then(|folder| folder.sync_all())
            .map_err(|e| DataError::new("the folder cannot be brought to the disk").at(path).because(e))?;
    }
    Ok(())
}

fn frame(line: &Line) -> DataResult<Vec<u8>> {
    let json =
        serde_json::to_vec(line).map_err(|e| DataError::new("cannot make the journal's JSON").because(e))?;
    let mut bytes = format!("{} {:08x} ", json.len(), crc32fast::hash(&json)).into_bytes();
    bytes.extend(json);
    bytes.push(b'\n');
    Ok(bytes)
}

struct Parsed {
    lines: Vec<Line>,
    /// Bytes of whole lines.
    len: u64,
    /// Bytes after them.
    torn: usize,
}

/// The lines of a journal, from its last head on.
fn parse(bytes: &[u8]) -> DataResult<Parsed> {
    let mut lines = Vec::new();
    let mut at = 0;
    let mut number = 0;
    while at < bytes.len() {
        number += 1;
        let Some((json, next)) = whole_line(&bytes[at..]) else { break };
        let line = serde_json::from_slice(json).map_err(|e| match newer_schema(json) {
            Some(schema) => DataError::new(format!("the journal's schema {schema} is not {JOURNAL_SCHEMA}"))
                .hint("update vice"),
            None => DataError::new("the journal holds a line that is not understood")
                .line(number)
                .hint("was it written by a newer vice?")
                .because(e),
        })?;
        if let Line::Head { schema, .. } = &line {
            if schema != JOURNAL_SCHEMA {
                return Err(DataError::new(format!("the journal's schema {schema} is not {JOURNAL_SCHEMA}"))
                    .hint("update vice"));
            }
            lines.clear();
        } else if lines.is_empty() {
            return Err(DataError::new("is no journal of vice").line(number).hint("move it away"));
        }
        lines.push(line);
        at += next;
    }
    let rest = &bytes[at..];
    // A crash tears the last line only. If a whole line follows, something else damaged the file.
    let damaged = rest
        .iter()
        .enumerate()
        .filter(|(_, b)| **b == b'\n')
        .any(|(i, _)| whole_line(&rest[i + 1..]).is_some());
    if damaged {
        return Err(DataError::new("the journal is damaged, and whole changes follow").line(number).hint(
            "the labels file beside it is as it was last saved; move the journal away to go on with that",
        ));
    }
    if lines.is_empty() && !rest.is_empty() && !starts_like_a_line(rest) {
        return Err(DataError::new("is no journal of vice").hint("move it away"));
    }
    Ok(Parsed { lines, len: at as u64, torn: rest.len() })
}

/// Whether a file could be the beginning of a first line that was never finished.
fn starts_like_a_line(rest: &[u8]) -> bool {
    let digits = rest.iter().take_while(|b| b.is_ascii_digit()).count();
    digits > 0 && digits < 20 && (digits == rest.len() || rest[digits] == b' ')
}

fn newer_schema(json: &[u8]) -> Option<String> {
    let value: serde_json::Value = serde_json::from_slice(json).ok()?;
    let schema = value.get("schema")?.as_str()?;
    (schema != JOURNAL_SCHEMA).then(|| schema.to_string())
}

/// The JSON of the line that bytes start with and the length of the line, if it is whole.
fn whole_line(bytes: &[u8]) -> Option<(&[u8], usize)> {
    // 20 digits are more than any length has: no need to look further for the space.
    let space = bytes.iter().take(21).position(|b| *b == b' ')?;
    let len: usize = std::str::from_utf8(&bytes[..space]).ok()?.parse().ok()?;
    let crc = bytes.get(space + 1..space + 9)?;
    let crc = u32::from_str_radix(std::str::from_utf8(crc).ok()?, 16).ok()?;
    let start = space + 10;
    let end = start.checked_add(len)?;
    let json = bytes.get(start..end)?;
    (bytes.get(space + 9) == Some(&b' ') && bytes.get(end) == Some(&b'\n') && crc32fast::hash(json) == crc)
        .then_some((json, end + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn head() -> Line {
        Line::Head {
            schema: JOURNAL_SCHEMA.into(),
            dataset: None,
            camera: Some("cam0".into()),
            file: None,
            base: vec![],
        }
    }

    fn change(label: &str) -> Line {
        Line::Change { by: By::Edit, label: label.into(), job: None, cells: vec![] }
    }

    fn locked(path: &Path) -> (Journal, Vec<Line>) {
        match Journal::open(path).unwrap() {
            Opened::Locked(journal, lines) => (journal, lines),
            Opened::Taken(_) => panic!("taken"),
        }
    }

    #[test]
    fn lines_come_back_and_a_torn_one_is_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.journal");
        let (mut journal, none) = locked(&path);
        assert!(none.is_empty());
        let all = [head(), change("one\ntwo"), Line::Undo, Line::Saved];
        journal.restart(&all[0]).unwrap();
        for line in &all[1..] {
            journal.append(line).unwrap();
        }
        drop(journal);
        let whole = fs::read(&path).unwrap();
        let before_last = whole[..whole.len() - 1].iter().rposition(|b| *b == b'\n').unwrap() + 1;
        for cut in before_last..whole.len() {
            fs::write(&path, &whole[..cut]).unwrap();
            let (mut journal, lines) = locked(&path);
            assert_eq!(lines, all[..3], "cut at {cut}");
            journal.append(&Line::Redo).unwrap();
            drop(journal);
            assert_eq!(locked(&path).1[3], Line::Redo);
        }
        // Zeros and noise, as a loss of power leaves them.
        for noise in [&[0_u8; 4096][..], b"\n\n\x07", b"99999999999999999999 00000000 x\n"] {
            fs::write(&path, [&whole, noise].concat()).unwrap();
            assert_eq!(locked(&path).1, all);
        }
    }

    #[test]
    fn damage_before_whole_lines_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.journal");
        let (mut journal, _) = locked(&path);
        journal.restart(&head()).unwrap();
        journal.append(&change("lost?")).unwrap();
        journal.append(&change("whole")).unwrap();
        drop(journal);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replace("lost?", "lost!")).unwrap();
        let Err(error) = Journal::open(&path) else { panic!() };
        assert!(error.to_string().contains("a.journal:2: the journal is damaged"), "{error}");
        for other in ["{\"a\": 1}\n", "hello", "12 hello\nthere"] {
            fs::write(&path, other).unwrap();
            let opened = Journal::open(&path);
            assert!(opened.is_err() || other.starts_with("12"), "{other}");
        }
        let newer = r#"{"is":"head","schema":"vice.journal/2","what":1}"#;
        fs::write(&path, format!("{} {:08x} {newer}\n", newer.len(), crc32fast::hash(newer.as_bytes())))
            .unwrap();
        let Err(error) = Journal::open(&path) else { panic!() };
        assert!(error.to_string().contains("vice.journal/2"), "{error}");
    }

    #[test]
    fn one_process_writes_and_starting_anew_forgets() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.journal");
        let (mut journal, _) = locked(&path);
        journal.restart(&head()).unwrap();
        journal.append(&change("one")).unwrap();
        let Opened::Taken(lines) = Journal::open(&path).unwrap() else { panic!("not locked") };
        assert_eq!(lines.len(), 2);
        journal.restart(&head()).unwrap();
        assert!(matches!(Journal::open(&path).unwrap(), Opened::Taken(lines) if lines.len() == 1));
        journal.append(&change("two")).unwrap();
        drop(journal);
        let (journal, lines) = locked(&path);
        assert_eq!(lines, [head(), change("two")]);
        assert_eq!(journal.len(), fs::metadata(&path).unwrap().len());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        drop(journal);
        assert!(path.exists());
        let (mut journal, _) = locked(&path);
        journal.restart(&head()).unwrap();
        drop(journal);
        assert!(!path.exists(), "nothing has happened in it");
    }
}
