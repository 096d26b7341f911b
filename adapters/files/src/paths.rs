//! Names that come out of data files are not trusted with the file system.

use std::path::{Component, Path, PathBuf};

use vice_core::error::{DataError, DataResult};

/// Checks that a name from a file stays below the folder it is meant for, by its text alone.
///
/// # Errors
/// [`DataError`] if it is empty, absolute, or climbs with `..`.
pub fn check_relative(relative: &str) -> DataResult<()> {
    let path = Path::new(relative);
    // Both kinds of separators, since the file may have been written elsewhere.
    let climbs = relative.split(['/', '\\']).any(|part| part == "..");
    let absolute = relative.starts_with(['/', '\\']) || relative.as_bytes().get(1) == Some(&b':');
    if relative.is_empty() {
        Err(DataError::new("the file name is empty"))
    } else if absolute || path.is_absolute() {
        Err(DataError::new(format!("the file name `{relative}` is absolute"))
            .hint("it must be relative to its folder"))
    } else if climbs || !path.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir)) {
        Err(DataError::new(format!("the file name `{relative}` climbs out of its folder")))
    } else {
        Ok(())
    }
}

/// The path of `relative` below `root`.
///
/// # Errors
/// [`DataError`] as [`check_relative`], or if the path exists and leaves `root` through a symbolic link.
pub fn safe_join(root: impl AsRef<Path>, relative: &str) -> DataResult<PathBuf> {
    let root = root.as_ref();
    check_relative(relative).map_err(|e| e.at(root))?;
    let joined = root.join(relative);
    // What does not exist leaves nowhere; opening it will say that it is missing.
    if let (Ok(real_root), Ok(real)) = (root.canonicalize(), joined.canonicalize())
        && !real.starts_with(&real_root)
    {
        return Err(DataError::new(format!("`{relative}` leaves its folder through a link")).at(root));
    }
    Ok(joined)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_inside() {
        let folder = tempfile::tempdir().unwrap();
        assert!(safe_join(folder.path(), "a/b.png").is_ok());
        assert!(safe_join(folder.path(), "./b.png").is_ok());
        for bad in ["", "/etc/passwd", "../x", "a/../../x", "a\\..\\..\\x", "C:\\x", "\\\\host\\x"] {
            assert!(safe_join(folder.path(), bad).is_err(), "{bad}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_inside() {
        let folder = tempfile::tempdir().unwrap();
        let (root, outside) = (folder.path().join("root"), folder.path().join("outside"));
        std::fs::create_dir_all(&root).unwrap();
        std::fs::write(&outside, b"").unwrap();
        std::fs::write(root.join("inside"), b"").unwrap();
        std::os::unix::fs::symlink(&outside, root.join("leaves")).unwrap();
        std::os::unix::fs::symlink("inside", root.join("stays")).unwrap();
        assert!(safe_join(&root, "stays").is_ok());
        let error = safe_join(&root, "leaves").unwrap_err().to_string();
        assert!(error.contains("through a link"), "{error}");
        // The folder itself may be a link: data often lives on another disk.
        let linked = folder.path().join("linked");
        std::os::unix::fs::symlink(&root, &linked).unwrap();
        assert!(safe_join(&linked, "inside").is_ok());
    }
}
