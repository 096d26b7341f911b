//! The journal: every change is a line on the disk before it is acknowledged.
//!
//! A line is `NUMBER TIME LENGTH BEFORE CRC32 JSON`: its number from 0, when it was written (milliseconds since 1970), the
//! bytes of the JSON, the check sum of the line before, the check sum of this one (of all but the sum itself), and the JSON,
//! which holds no line break. So each line by itself says whether it is whole, and where it belongs: one that is damaged,
//! missing or moved is noticed, and named. The first line holds the labels as they were, so that the journal by itself
//! gives them all.

mod disk;
mod line;
mod reading;

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use vice_core::error::{DataError, DataResult};

use disk::Disk;
pub(crate) use line::Line;
pub use line::{FileMark, JOURNAL_SCHEMA};
use line::{Place, frame};
pub(crate) use reading::{Entry, Reading};

/// An open journal, locked against other processes.
#[derive(Debug)]
pub(crate) struct Journal<D = File> {
    path: PathBuf,
    disk: D,
    /// Bytes of whole lines.
    len: u64,
    /// Where the next line stands.
    next: Place,
    /// Set when a failed write could not be taken back: the file's end is not known any more.
    broken: bool,
    /// Nothing has happened yet: then the file goes away again with the journal.
    untouched: bool,
}

impl<D> Drop for Journal<D> {
    fn drop(&mut self) {
        if self.untouched {
            // It would hold what the labels file holds; left behind it does no harm.
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// How opening a journal ended.
pub(crate) enum Opened {
    /// It is ours, with what it holds.
    Locked(Journal, Reading),
    /// Another process has it; the lines as far as they are whole.
    Taken(Reading),
}

impl Journal {
    /// Opens or creates a journal and locks it. A damaged one is kept beside as it was.
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
                    return Ok(Opened::Taken(reading::read(&bytes).map_err(|e| e.at(path))?));
                }
                Err(TryLockError::Error(e)) => return Err(failed(e)),
            }
        };
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let reading = reading::read(&bytes).map_err(|e| e.at(path))?;
        if reading.unfinished > 0 {
            tracing::warn!(
                "{}: the last line was not finished and is dropped ({} bytes): a change that was never acknowledged, unless the file was cut off later",
                path.display(),
                reading.unfinished
            );
        }
        if !reading.damage.is_empty() {
            let kept = keep_copy(path, &bytes).map_err(failed)?;
            for damage in &reading.damage {
                tracing::warn!("{}: {damage}; all of it is kept as {}", path.display(), kept.display());
            }
        }
        let untouched = reading.entries.len() <= 1 && reading.damage.is_empty();
        let mut journal = Self {
            path: path.to_path_buf(),
            disk: file,
            len: reading.len,
            next: reading.next,
            broken: false,
            untouched,
        };
        if reading.has_gap() {
            // The store starts it anew from what can be had; until then it stays as it is.
            journal.len = bytes.len() as u64;
        } else if !reading.damage.is_empty() || reading.old {
            let lines: Vec<(u64, Line)> =
                reading.entries.iter().map(|e| (e.time_ms, e.line.clone().with_schema())).collect();
            journal.replace(&lines)?;
        } else if bytes.len() as u64 > reading.len {
            journal.disk.cut(reading.len).and_then(|()| journal.disk.sync_all()).map_err(failed)?;
        }
        Ok(Opened::Locked(journal, reading))
    }

    /// Starts anew with a first line; what was there is no longer needed.
    pub(crate) fn restart(&mut self, head: &Line) -> DataResult<()> {
        // The new line goes behind the old ones first: should the disk be full, these are still whole.
        let old = self.len;
        self.append(head)?;
        if old == 0 {
            return sync_folder_of(&self.path);
        }
        // A head behind other lines makes the reader forget them, so that a crash in between loses nothing either.
        self.replace(&[(now_ms(), head.clone())])
    }

    /// Replaces the file by one that holds these lines.
    fn replace(&mut self, lines: &[(u64, Line)]) -> DataResult<()> {
        let failed = |e: std::io::Error| {
            DataError::new("the journal cannot be started anew").at(&self.path).because(e)
        };
        let (mut all, mut next) = (Vec::new(), Place::default());
        for (time_ms, line) in lines {
            let (bytes, crc) = frame(line, Place { time_ms: *time_ms, ..next })?;
            all.extend(bytes);
            next = Place { seq: next.seq + 1, time_ms: 0, before: crc };
        }
        let compact = tempfile_beside(&self.path, &all).map_err(failed)?;
        compact.as_file().try_lock().map_err(|e| failed(e.into()))?;
        let file = compact.persist(&self.path).map_err(|e| failed(e.error))?;
        sync_folder_of(&self.path)?;
        // The old file stays locked until here: whoever opened it before the rename was refused.
        (self.disk, self.len, self.next) = (file, all.len() as u64, next);
        Ok(())
    }
}

impl<D: Disk> Journal<D> {
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
        let (bytes, crc) = frame(line, Place { time_ms: now_ms(), ..self.next })?;
        if let Err(e) = self.disk.write_at(self.len, &bytes).and_then(|()| self.disk.sync()) {
            self.broken = self.disk.cut(self.len).and_then(|()| self.disk.sync()).is_err();
            return Err(failed(e, &self.path));
        }
        self.len += bytes.len() as u64;
        self.next = Place { seq: self.next.seq + 1, time_ms: 0, before: crc };
        self.untouched = matches!(line, Line::Head { .. });
        Ok(())
    }

    /// Bytes on the disk.
    pub(crate) const fn len(&self) -> u64 {
        self.len
    }
}

/// Milliseconds since 1970; 0 where the clock is before that.
fn now_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_millis() as u64)
}

/// Writes bytes beside a file under a name that is free.
pub(super) fn keep_copy(path: &Path, bytes: &[u8]) -> std::io::Result<PathBuf> {
    for number in 1_u32.. {
        let mut name = path.as_os_str().to_os_string();
        name.push(if number == 1 { ".damaged".to_string() } else { format!(".damaged-{number}") });
        match OpenOptions::new().write(true).create_new(true).open(&name) {
            Ok(mut file) => {
                file.write_all(bytes)?;
                file.sync_all()?;
                return Ok(PathBuf::from(name));
            }
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(e),
        }
    }
    Err(std::io::ErrorKind::AlreadyExists.into())
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

#[cfg(test)]
mod tests;
