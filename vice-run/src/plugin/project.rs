//! The files of a new plugin, from templates.

use std::path::Path;

use crate::error::{Context, RunError, RunResult};

/// A file of a project.
pub struct File {
    /// Where it lies in the project.
    pub path: &'static str,
    text: String,
}

/// Where a project in Rust finds VICE.
pub enum Dependency {
    /// A checkout.
    Path(String),
    /// A repository, at a commit or at its newest.
    Git {
        /// Its address.
        url: String,
        /// The commit, in full.
        commit: Option<String>,
    },
}

impl Dependency {
    /// What stands in the manifest for a package.
    fn on(&self, folder: &str) -> String {
        // A TOML string with quotes and backslashes escaped, which Rust writes alike.
        match self {
            Self::Path(path) => format!("{{ path = {:?} }}", format!("{path}/{folder}")),
            Self::Git { url, commit: Some(commit) } => format!("{{ git = {url:?}, rev = {commit:?} }}"),
            Self::Git { url, commit: None } => format!("{{ git = {url:?} }}"),
        }
    }
}

macro_rules! template {
    ($folder:literal, $path:literal) => {
        File {
            path: $path,
            text: include_str!(concat!("../../templates/", $folder, "/", $path, ".txt")).to_string(),
        }
    };
}

/// A crate.
pub fn rust(name: &str, vice: &Dependency) -> Vec<File> {
    let files = vec![
        template!("plugin_rust", "Cargo.toml"),
        template!("plugin_rust", "README.md"),
        template!("plugin_rust", "src/lib.rs"),
        template!("plugin_rust", "src/dataset.rs"),
        template!("plugin_rust", "src/table.rs"),
        template!("plugin_rust", "tests/check.rs"),
        template!("plugin", "make_example.sh"),
    ];
    let packages = ["adapters/plugin/abi", "vice-core", "adapters/files"];
    let [abi, core, shared] = packages.map(|folder| vice.on(folder));
    let vice = [("vice_abi", &*abi), ("vice_core", &*core), ("vice_files", &*shared)];
    fill(files, &[&[("name", name), ("Name", &*camel(name))], &vice[..]].concat())
}

/// A Makefile and one source, with the header beside them.
pub fn cpp(name: &str) -> Vec<File> {
    let mut files = vec![
        template!("plugin_cpp", "Makefile"),
        template!("plugin_cpp", "README.md"),
        template!("plugin_cpp", "plugin.cpp"),
        template!("plugin", "make_example.sh"),
    ];
    files.push(File { path: "vice_plugin.h", text: vice_abi::HEADER.to_string() });
    files.push(File { path: "vice_plugin.hpp", text: vice_abi::CPP_HEADER.to_string() });
    files.push(File { path: "vice_plugin_export.hpp", text: vice_abi::CPP_EXPORT_HEADER.to_string() });
    fill(files, &[("name", name), ("Name", &camel(name))])
}

/// Puts values in place of `@key@`.
fn fill(mut files: Vec<File>, values: &[(&str, &str)]) -> Vec<File> {
    for file in &mut files {
        for (key, value) in values {
            file.text = file.text.replace(&format!("@{key}@"), value);
        }
    }
    files
}

/// `my_robot` as `MyRobot`.
fn camel(name: &str) -> String {
    name.split('_').fold(String::new(), |text, word| {
        let (first, rest) = word.split_at(word.len().min(1));
        text + &first.to_ascii_uppercase() + rest
    })
}

/// Writes a project into a folder that is new or empty.
///
/// # Errors
/// [`RunError`] if the folder holds something or cannot be written.
pub fn write(folder: &Path, files: &[File]) -> RunResult<()> {
    let shown = folder.display();
    if folder.exists() {
        let mut entries =
            std::fs::read_dir(folder).context(|| format!("{shown}: is no folder to write to"))?;
        if entries.next().is_some() {
            return Err(RunError::usage(
                "out",
                format!("{shown}: exists and is not empty; nothing is overwritten"),
            ));
        }
    }
    for file in files {
        let path = folder.join(file.path);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).context(|| format!("{}: cannot be made", parent.display()))?;
        }
        std::fs::write(&path, &file.text).context(|| format!("{}: cannot be written", path.display()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_left_to_fill_in_and_nothing_overwritten() {
        let git = Dependency::Git { url: "a\"b".to_string(), commit: None };
        for files in [rust("my_robot", &git), cpp("my_robot")] {
            for file in &files {
                for key in ["@name@", "@Name@", "@vice_abi@", "@vice_core@", "@vice_files@"] {
                    assert!(!file.text.contains(key), "{}", file.path);
                }
            }
            assert!(files.iter().any(|f| f.text.contains("MyRobot")));
            let folder = tempfile::tempdir().unwrap();
            write(&folder.path().join("new"), &files).unwrap();
            assert!(write(&folder.path().join("new"), &files).unwrap_err().to_string().contains("not empty"));
        }
        assert_eq!(git.on("x"), r#"{ git = "a\"b" }"#);
        let pinned = Dependency::Git { url: "u".to_string(), commit: Some("1f".to_string()) };
        assert_eq!(pinned.on("x"), r#"{ git = "u", rev = "1f" }"#);
    }
}
