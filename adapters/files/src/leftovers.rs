//! Temporary files and folders that are there now, for a program that is asked to end.
//!
//! Each removes itself when it is done or an error ends it. A signal ends a process without that: who handles signals calls
//! [`remove_all`] first.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

static THERE: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn there() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    THERE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Says as long as it lives that a temporary file or folder is there.
#[derive(Debug)]
pub struct Leftover(PathBuf);

/// Notes a temporary file or folder.
pub fn note(path: &Path) -> Leftover {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    there().insert(path.clone());
    Leftover(path)
}

impl Drop for Leftover {
    fn drop(&mut self) {
        there().remove(&self.0);
    }
}

/// Removes all that are there now. The process should end right after.
pub fn remove_all() {
    for path in &*there() {
        // One that was renamed a moment ago is a temporary file no longer; what cannot be removed is left.
        let _ = if path.is_dir() { remove_busy_folder(path) } else { fs::remove_file(path) };
    }
}

/// Other threads go on writing into it: under another name they cannot find it any more.
fn remove_busy_folder(path: &Path) -> std::io::Result<()> {
    let mut gone = path.as_os_str().to_os_string();
    gone.push(".gone");
    fs::rename(path, &gone)?;
    fs::remove_dir_all(&gone)
}

/// Removes from a folder what killed programs left there longer than an age ago.
pub fn remove_abandoned(folder: &Path, prefix: &str, suffix: &str, age: Duration) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let written = entry.metadata().and_then(|m| m.modified());
        let old = written.is_ok_and(|t| SystemTime::now().duration_since(t).is_ok_and(|a| a > age));
        if old && name.starts_with(prefix) && name.ends_with(suffix) {
            // Another program may have been quicker; nothing is lost.
            let _ = if entry.path().is_dir() {
                fs::remove_dir_all(entry.path())
            } else {
                fs::remove_file(entry.path())
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_there_goes_and_what_was_renamed_stays() {
        let folder = tempfile::tempdir().unwrap();
        let [file, inner, kept] = ["a.part", "b", "c"].map(|n| folder.path().join(n));
        fs::write(&file, "x").unwrap();
        fs::create_dir(&inner).unwrap();
        fs::write(inner.join("y"), "x").unwrap();
        fs::write(&kept, "x").unwrap();
        let (_file, _inner) = (note(&file), note(&inner));
        drop(note(&kept));
        remove_all();
        assert!(!file.exists() && !inner.exists() && kept.exists());
    }

    #[test]
    fn only_what_is_old_is_abandoned() {
        let folder = tempfile::tempdir().unwrap();
        let day = Duration::from_secs(24 * 3600);
        let old = SystemTime::now() - 2 * day;
        for (name, age) in [(".vice-a.part", Some(old)), (".vice-b.part", None), ("mine.part", Some(old))] {
            let file = fs::File::create(folder.path().join(name)).unwrap();
            if let Some(age) = age {
                file.set_modified(age).unwrap();
            }
        }
        remove_abandoned(folder.path(), ".vice-", ".part", day);
        let left = |name: &str| folder.path().join(name).exists();
        assert!(!left(".vice-a.part") && left(".vice-b.part") && left("mine.part"));
    }
}
