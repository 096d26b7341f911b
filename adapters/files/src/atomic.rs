//! Writing so that a reader never sees half a file, and nothing is lost by accident.
//!
//! A file is written beside its place and renamed when it is complete and on the disk: a full disk, a crash or an
//! error on the way leaves what was there before.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use vice_core::error::{DataError, DataResult};

use crate::leftovers;

/// What to do with a file that is there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overwrite {
    /// It is an error.
    Refuse,
    /// The new file takes its place.
    Replace,
}

impl Overwrite {
    /// From a `--force` switch.
    pub const fn from_force(force: bool) -> Self {
        if force { Self::Replace } else { Self::Refuse }
    }
}

/// Writes a file through `fill`, all of it or none.
///
/// The permissions are those of any new file. A device or pipe (`/dev/stdout`) is written to as it is.
///
/// # Errors
/// [`DataError`] if the file exists and may not be replaced, its folder is missing, or writing fails.
pub fn write<F>(path: impl AsRef<Path>, overwrite: Overwrite, fill: F) -> DataResult<()>
where
    F: FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
{
    let path = path.as_ref();
    write_and_return(path, overwrite, |out| fill(out).map_err(|e| failed(path, e)))
}

/// As [`write()`], where `fill` has a result and errors of its own. If it fails there is no file.
///
/// # Errors
/// That of `fill`, or as [`write()`].
pub fn write_and_return<T, E, F>(path: impl AsRef<Path>, overwrite: Overwrite, fill: F) -> Result<T, E>
where
    E: From<DataError>,
    F: FnOnce(&mut (dyn Write + Send)) -> Result<T, E>,
{
    let path = path.as_ref();
    let failed = |error| failed(path, error);
    match fs::metadata(path) {
        Ok(meta) if meta.is_dir() => return Err(DataError::new("is a folder, not a file").at(path).into()),
        Ok(meta) if !meta.is_file() || path.starts_with("/dev") => {
            let mut device = fs::OpenOptions::new().write(true).open(path).map_err(failed)?;
            let value = fill(&mut device)?;
            device.flush().map_err(failed)?;
            return Ok(value);
        }
        Ok(_) if overwrite == Overwrite::Refuse => return Err(exists(path).into()),
        _ => {}
    }
    // A link keeps pointing where it points: what it names is replaced, not the link.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    };
    if !folder.is_dir() {
        return Err(DataError::new("cannot be written: its folder does not exist")
            .at(path)
            .hint(format!("create {} first", folder.display()))
            .into());
    }
    let temporary = new_file_beside(&folder).map_err(failed)?;
    let _there = leftovers::note(temporary.path());
    let mut writer = BufWriter::with_capacity(1 << 16, temporary);
    let value = fill(&mut writer)?;
    let temporary = writer.into_inner().map_err(|e| failed(e.into_error()))?;
    temporary.as_file().sync_all().map_err(failed)?;
    let persisted = match overwrite {
        Overwrite::Replace => temporary.persist(&target),
        Overwrite::Refuse => temporary.persist_noclobber(&target),
    };
    match persisted {
        Ok(_) => Ok(value),
        Err(e) if e.error.kind() == io::ErrorKind::AlreadyExists => Err(exists(path).into()),
        Err(e) => Err(failed(e.error).into()),
    }
}

fn failed(path: &Path, error: io::Error) -> DataError {
    DataError::new("cannot be written").at(path).because(error)
}

fn exists(path: &Path) -> DataError {
    DataError::new("exists already").at(path).hint("`force` replaces it")
}

fn new_file_beside(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".vice-").suffix(".part");
    // A temporary file is private by default; this one becomes an ordinary file, so the umask decides.
    #[cfg(unix)]
    let builder = {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666))
    };
    builder.tempfile_in(folder)
}

/// Makes a folder ready to be filled: creates it with its parents, and refuses one that holds anything unless `force`.
///
/// # Errors
/// [`DataError`] if a file is in the way, the folder is not empty, or it cannot be created.
pub fn prepare_folder(path: impl AsRef<Path>, force: bool) -> DataResult<()> {
    let path = path.as_ref();
    let failed = |error: io::Error| DataError::new("the folder cannot be used").at(path).because(error);
    if path.exists() && !path.is_dir() {
        return Err(DataError::new("is a file, not a folder").at(path));
    }
    if path.is_dir() {
        let holds_something = fs::read_dir(path).map_err(failed)?.next().is_some();
        if holds_something && !force {
            return Err(DataError::new("the folder is not empty")
                .at(path)
                .hint("`force` writes into it and replaces files of the same name"));
        }
        return Ok(());
    }
    fs::create_dir_all(path).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("labels.csv");
        write(&path, Overwrite::Refuse, |w| w.write_all(b"one")).unwrap();
        let error = write(&path, Overwrite::Refuse, |w| w.write_all(b"two")).unwrap_err();
        assert!(error.to_string().contains("`force`"), "{error}");
        let full = write(&path, Overwrite::Replace, |w| {
            w.write_all(&[b'x'; 1 << 17])?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        });
        assert!(full.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"one");
        write(&path, Overwrite::Replace, |w| w.write_all(b"three")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"three");
        let names: Vec<_> = fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(names, ["labels.csv"], "no temporary file is left");
    }

    #[test]
    fn places_that_cannot_be_written_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no/such/out.json");
        let error = write(&missing, Overwrite::Refuse, |_| Ok(())).unwrap_err().to_string();
        assert!(error.contains("its folder does not exist"), "{error}");
        let error = write(folder.path(), Overwrite::Replace, |_| Ok(())).unwrap_err().to_string();
        assert!(error.contains("is a folder"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn permissions_and_links_are_those_of_an_ordinary_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let plain = folder.path().join("plain");
        fs::write(&plain, b"").unwrap();
        let ours = folder.path().join("ours");
        write(&ours, Overwrite::Refuse, |w| w.write_all(b"x")).unwrap();
        let mode = |p: &Path| fs::metadata(p).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));

        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&ours, &link).unwrap();
        write(&link, Overwrite::Replace, |w| w.write_all(b"through")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().file_type().is_symlink());
        assert_eq!(fs::read(&ours).unwrap(), b"through");
    }

    #[test]
    fn a_folder_that_holds_something_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let fresh = folder.path().join("a/b");
        prepare_folder(&fresh, false).unwrap();
        prepare_folder(&fresh, false).unwrap();
        fs::write(fresh.join("file"), b"").unwrap();
        let error = prepare_folder(&fresh, false).unwrap_err().to_string();
        assert!(error.contains("not empty") && error.contains("`force`"), "{error}");
        prepare_folder(&fresh, true).unwrap();
        assert!(prepare_folder(fresh.join("file"), true).unwrap_err().to_string().contains("is a file"));
    }
}
