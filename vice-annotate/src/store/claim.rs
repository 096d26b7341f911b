//! The labels file itself, whatever name it goes by: one program at a time writes it.
//!
//! The journal stands beside a name. Through a symbolic link it is that of the file which the link names; two hard links
//! have a journal each, and only the lock on the file itself tells that they are one.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use vice_core::error::{DataError, DataResult};

/// Whose a labels file is.
pub(super) enum Claim {
    /// Ours as long as this is open; `None` where there is no file yet.
    Ours(Option<File>),
    /// Another process writes it.
    Taken,
}

/// The file that a symbolic link names at last; any other path as it is.
pub(super) fn real(path: &Path) -> PathBuf {
    let is_link = fs::symlink_metadata(path).is_ok_and(|m| m.is_symlink());
    if is_link { fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf()) } else { path.to_path_buf() }
}

/// Locks a file that is there.
///
/// # Errors
/// [`DataError`] if it cannot be opened or locked.
pub(super) fn take(path: &Path) -> DataResult<Claim> {
    let failed = |e: io::Error| DataError::new("the labels file cannot be locked").at(path).because(e);
    let file = match OpenOptions::new().read(true).write(true).open(path) {
        Ok(file) => file,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Claim::Ours(None)),
        Err(e) => return Err(failed(e)),
    };
    match file.try_lock() {
        Ok(()) => Ok(Claim::Ours(Some(file))),
        Err(TryLockError::WouldBlock) => Ok(Claim::Taken),
        Err(TryLockError::Error(e)) => Err(failed(e)),
    }
}
