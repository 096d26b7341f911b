//! Whose file a library is, and who may write to it: loading one runs its code.

use std::path::{Path, PathBuf};

use vice_core::error::{DataError, DataResult};

/// Where a library really is, and what is odd about the place.
pub(crate) struct Place {
    /// Without links and dots.
    pub(crate) path: PathBuf,
    /// Why it is not loaded unless the user insists.
    pub(crate) refusal: Option<String>,
    /// What the user should know.
    pub(crate) warning: Option<String>,
}

/// Looks at a library and its folder.
///
/// # Errors
/// [`DataError`] if there is no such file or it is none.
pub(crate) fn look(path: &Path) -> DataResult<Place> {
    let unreadable = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::new("no such file").at(path),
        _ => DataError::new("cannot be read").at(path).because(e),
    };
    let real = path.canonicalize().map_err(unreadable)?;
    let file = real.metadata().map_err(unreadable)?;
    if !file.is_file() {
        return Err(DataError::new("is no file: a plugin is a shared library").at(path));
    }
    let mut place = Place { refusal: None, warning: None, path: real };
    #[cfg(unix)]
    {
        examine(&mut place, &file).map_err(unreadable)?;
        examine_links(&mut place, path).map_err(unreadable)?;
    }
    Ok(place)
}

/// Links on the way: whoever can put another one in its place chooses what is loaded.
#[cfg(unix)]
fn examine_links(place: &mut Place, path: &Path) -> std::io::Result<()> {
    use std::os::unix::fs::MetadataExt;
    let me = rustix::process::geteuid().as_raw();
    let mut at = path.to_path_buf();
    // A file that was found by the system has fewer links than the system follows.
    for _ in 0..40 {
        let link = at.symlink_metadata()?;
        if !link.is_symlink() {
            return Ok(());
        }
        let folder = at.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder_data = folder.metadata()?;
        let shown = at.display();
        if link.uid() != me && link.uid() != 0 {
            let reason = format!("the link {shown} belongs to another user (id {})", link.uid());
            place.refusal.get_or_insert(reason);
        }
        // In a folder like /tmp (sticky) only its owner can replace a link.
        if folder_data.mode() & 0o1002 == 0o0002 {
            let reason = format!(
                "the folder of the link {shown} may be written to by anyone (mode {:o})",
                folder_data.mode() & 0o7777
            );
            place.refusal.get_or_insert(reason);
        }
        at = folder.join(std::fs::read_link(&at)?);
    }
    Ok(())
}

#[cfg(unix)]
fn examine(place: &mut Place, file: &std::fs::Metadata) -> std::io::Result<()> {
    let folder = place.path.parent().unwrap_or(Path::new("/")).to_path_buf();
    let folder_data = folder.metadata()?;
    let me = rustix::process::geteuid().as_raw();
    for (what, path, data) in [("the file", &place.path, file), ("its folder", &folder, &folder_data)] {
        use std::os::unix::fs::MetadataExt;
        let (mode, owner) = (data.mode(), data.uid());
        let shown = path.display();
        if owner != me && owner != 0 {
            let reason = format!("{what} {shown} belongs to another user (id {owner})");
            place.refusal.get_or_insert(reason);
        }
        if mode & 0o002 != 0 {
            let reason = format!("{what} {shown} may be written to by anyone (mode {:o})", mode & 0o7777);
            place.refusal.get_or_insert(reason);
        }
        if mode & 0o020 != 0 {
            let reason = format!("{what} {shown} may be written to by its group (mode {:o})", mode & 0o7777);
            place.warning.get_or_insert(reason);
        }
    }
    Ok(())
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    fn with_modes(file_mode: u32, folder_mode: u32) -> Place {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("lib.so");
        std::fs::write(&file, "x").unwrap();
        let set = |path: &Path, mode| std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode));
        set(&file, file_mode).unwrap();
        set(folder.path(), folder_mode).unwrap();
        // By a link elsewhere: the real file counts.
        let other = tempfile::tempdir().unwrap();
        let link = other.path().join("link.so");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        look(&link).unwrap()
    }

    #[test]
    fn who_may_write_decides() {
        let private = with_modes(0o755, 0o755);
        assert!(private.refusal.is_none() && private.warning.is_none());
        assert!(private.path.ends_with("lib.so"));
        let file = with_modes(0o757, 0o755);
        assert!(file.refusal.unwrap().contains("the file"));
        let folder = with_modes(0o755, 0o777);
        assert!(folder.refusal.unwrap().contains("its folder"));
        let group = with_modes(0o775, 0o755);
        assert!(group.refusal.is_none() && group.warning.unwrap().contains("group"));
    }

    #[test]
    fn a_link_that_others_can_replace_is_refused() {
        let [real, open] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        let file = real.path().join("lib.so");
        std::fs::write(&file, "x").unwrap();
        let (first, second) = (open.path().join("a.so"), real.path().join("b.so"));
        std::os::unix::fs::symlink(&file, &first).unwrap();
        std::os::unix::fs::symlink(&first, &second).unwrap();
        let set =
            |mode| std::fs::set_permissions(open.path(), std::fs::Permissions::from_mode(mode)).unwrap();
        assert!(look(&second).unwrap().refusal.is_none());
        set(0o777);
        for link in [&first, &second] {
            let refusal = look(link).unwrap().refusal.unwrap();
            assert!(refusal.contains("folder of the link") && refusal.contains("a.so"), "{refusal}");
        }
        set(0o1777);
        assert!(look(&first).unwrap().refusal.is_none(), "only the owner can replace it there");
        if std::os::unix::fs::lchown(&first, Some(12345), None).is_ok() {
            assert!(look(&second).unwrap().refusal.unwrap().contains("another user (id 12345)"));
        }
    }

    #[test]
    fn what_is_no_file_is_said() {
        let folder = tempfile::tempdir().unwrap();
        assert!(look(folder.path()).err().unwrap().to_string().contains("is no file"));
        assert!(look(&folder.path().join("no")).err().unwrap().to_string().contains("no such file"));
    }
}
