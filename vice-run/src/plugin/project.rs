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
    /// A repository, at the tag of this version.
    Git(String),
}

impl Dependency {
    /// What stands in the manifest for a package.
    fn on(&self, folder: &str) -> String {
        // A TOML string with quotes and backslashes escaped, which Rust writes alike.
        match self {
            Self::Path(path) => format!("{{ path = {:?} }}", format!("{path}/{folder}")),
            Self::Git(url) => format!("{{ git = {url:?}, tag = \"v{}\" }}", env!("CARGO_PKG_VERSION")),
        }
    }
}

macro_rules! template {
    ($language:literal, $path:literal) => {
        File {
            path: $path,
            text: include_str!(concat!("../../templates/plugin_", $language, "/", $path, ".txt")).to_string(),
        }
    };
}

/// A crate.
pub fn rust(name: &str, vice: &Dependency) -> Vec<File> {
    let files = vec![
        template!("rust", "Cargo.toml"),
        template!("rust", "README.md"),
        template!("rust", "src/lib.rs"),
        template!("rust", "src/dataset.rs"),
        template!("rust", "tests/check.rs"),
    ];
    let (abi, core) = (vice.on("adapters/plugin/abi"), vice.on("vice-core"));
    fill(files, &[("name", name), ("Name", &camel(name)), ("vice_abi", &abi), ("vice_core", &core)])
}

/// A Makefile and one source, with the header beside them.
pub fn cpp(name: &str) -> Vec<File> {
    let mut files = vec![
        template!("cpp", "Makefile"),
        template!("cpp", "README.md"),
        template!("cpp", "plugin.cpp"),
        template!("cpp", "make_example.sh"),
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
        let git = Dependency::Git("a\"b".to_string());
        for files in [rust("my_robot", &git), cpp("my_robot")] {
            for file in &files {
                for key in ["@name@", "@Name@", "@vice_abi@", "@vice_core@"] {
                    assert!(!file.text.contains(key), "{}", file.path);
                }
            }
            assert!(files.iter().any(|f| f.text.contains("MyRobot")));
            let folder = tempfile::tempdir().unwrap();
            write(&folder.path().join("new"), &files).unwrap();
            assert!(write(&folder.path().join("new"), &files).unwrap_err().to_string().contains("not empty"));
        }
        assert!(git.on("x").contains(r#"git = "a\"b""#));
    }
}
