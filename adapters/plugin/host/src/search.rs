//! Where plugins lie that nobody named: the folders of `VICE_PLUGIN_PATH`, then the user's own.
//!
//! Never the working directory and never a data set: what lies there came with the data.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// The variable that lists folders, separated as in `PATH`.
pub const PATH_VARIABLE: &str = "VICE_PLUGIN_PATH";

/// Libraries that lie where plugins are, in the order they are looked at, and remarks about folders that were not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Paths of libraries.
    pub libraries: Vec<PathBuf>,
    /// What the user should know, one line each.
    pub remarks: Vec<String>,
}

/// The folder of the user's own plugins, where the system has one.
pub fn user_folder() -> Option<PathBuf> {
    directories::ProjectDirs::from("", "", "vice").map(|d| d.data_dir().join("plugins"))
}

/// Looks in the folders of `VICE_PLUGIN_PATH` and the user's own.
pub fn find() -> Found {
    find_in(std::env::var_os(PATH_VARIABLE).as_deref(), user_folder().as_deref())
}

fn find_in(listed: Option<&OsStr>, user: Option<&Path>) -> Found {
    let mut found = Found::default();
    for folder in listed.map(std::env::split_paths).into_iter().flatten() {
        if folder.as_os_str().is_empty() {
            continue;
        }
        if folder.is_relative() {
            let shown = folder.display();
            found.remarks.push(format!("{PATH_VARIABLE}: {shown} is left out: only absolute folders count"));
            continue;
        }
        if let Err(error) = look(&folder, &mut found.libraries) {
            found.remarks.push(format!("{PATH_VARIABLE}: {} is left out: {error}", folder.display()));
        }
    }
    if let Some(folder) = user.filter(|f| f.is_dir())
        && let Err(error) = look(folder, &mut found.libraries)
    {
        found.remarks.push(format!("plugins of {} are left out: {error}", folder.display()));
    }
    found
}

/// Adds the libraries of a folder, by name.
fn look(folder: &Path, libraries: &mut Vec<PathBuf>) -> std::io::Result<()> {
    let mut here = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let is_library =
            path.extension().and_then(OsStr::to_str).is_some_and(|e| e == std::env::consts::DLL_EXTENSION);
        if is_library && path.is_file() {
            here.push(path);
        }
    }
    here.sort();
    libraries.extend(here);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absolute_folders_are_looked_at_in_order() {
        let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let library = |folder: &Path, name: &str| {
            let path = folder.join(format!("{name}{}", std::env::consts::DLL_SUFFIX));
            std::fs::write(&path, "").unwrap();
            path
        };
        let (z, y, u) = (library(a.path(), "z"), library(a.path(), "y"), library(b.path(), "u"));
        std::fs::write(a.path().join("notes.txt"), "").unwrap();
        let listed = std::env::join_paths([Path::new(""), Path::new("."), a.path(), Path::new("/no/such")]);
        let found = find_in(Some(&listed.unwrap()), Some(b.path()));
        assert_eq!(found.libraries, [y, z, u]);
        assert_eq!(found.remarks.len(), 2, "{:?}", found.remarks);
        assert!(found.remarks[0].contains("only absolute"));
        assert_eq!(find_in(None, None), Found::default());
    }
}
