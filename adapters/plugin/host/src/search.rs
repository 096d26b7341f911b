//! Where plugins lie that nobody named: the folders and files of `VICE_PLUGIN_PATH`, then the user's own.
//!
//! Never the working directory and never a data set: what lies there came with the data.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// The variable that lists folders and files, separated as in `PATH`.
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

/// Looks at the folders and files of `VICE_PLUGIN_PATH`, and in the user's own folder.
pub fn find() -> Found {
    find_in(std::env::var_os(PATH_VARIABLE).as_deref(), user_folder().as_deref())
}

fn find_in(listed: Option<&OsStr>, user: Option<&Path>) -> Found {
    let mut found = Found::default();
    for path in listed.map(std::env::split_paths).into_iter().flatten() {
        if path.as_os_str().is_empty() {
            continue;
        }
        if path.is_relative() {
            let shown = path.display();
            found.remarks.push(format!("{PATH_VARIABLE}: {shown} is left out: only absolute paths count"));
            continue;
        }
        if path.is_file() {
            // Named by itself, it need not be called as libraries are.
            found.libraries.push(path);
        } else if let Err(error) = look(&path, &mut found.libraries) {
            found.remarks.push(format!("{PATH_VARIABLE}: {} is left out: {error}", path.display()));
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
    fn absolute_folders_and_files_are_looked_at_in_order() {
        let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let library = |folder: &Path, name: &str| {
            let path = folder.join(format!("{name}{}", std::env::consts::DLL_SUFFIX));
            std::fs::write(&path, "").unwrap();
            path
        };
        let (z, y, u) = (library(a.path(), "z"), library(a.path(), "y"), library(b.path(), "u"));
        std::fs::write(a.path().join("notes.txt"), "").unwrap();
        let c = tempfile::tempdir().unwrap();
        let (one, _beside) = (library(c.path(), "one"), library(c.path(), "beside"));
        let listed = [Path::new(""), Path::new("."), &one, a.path(), Path::new("/no/such")];
        let listed = std::env::join_paths(listed);
        let found = find_in(Some(&listed.unwrap()), Some(b.path()));
        assert_eq!(found.libraries, [one, y, z, u]);
        assert_eq!(found.remarks.len(), 2, "{:?}", found.remarks);
        assert!(found.remarks[0].contains("only absolute"));
        assert_eq!(find_in(None, None), Found::default());
    }
}
