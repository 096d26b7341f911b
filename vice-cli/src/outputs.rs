//! Files that a command writes: none of them may be what it reads, and all or none are written.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;

use crate::inputs::write_text;
use crate::terminal::{self, Verbosity, usage};

/// The name that stands for standard output.
const STDOUT: &str = "-";

/// Outputs that were looked at before the work, so that a mistake costs nothing.
pub(crate) struct Outputs(());

impl Outputs {
    /// Refuses outputs that are inputs, lie in a folder that is one, are named twice, or cannot be written.
    pub(crate) fn new(outputs: &[&Option<PathBuf>], inputs: &[PathBuf]) -> anyhow::Result<Self> {
        let inputs: Vec<PathBuf> = inputs.iter().filter_map(|p| p.canonicalize().ok()).collect();
        let mut seen: Vec<PathBuf> = Vec::new();
        for output in outputs.iter().filter_map(|o| o.as_deref()).filter(|o| *o != Path::new(STDOUT)) {
            let shown = output.display();
            let place = place(output)?;
            if let Some(input) = inputs.iter().find(|i| place.starts_with(i)) {
                return Err(usage(match input.is_dir() {
                    true => format!(
                        "{shown} lies in the data that is read, {}: name a place outside of that folder",
                        input.display()
                    ),
                    false => format!("{shown} is a file that is read: name another file"),
                }));
            }
            if place.is_dir() {
                return Err(usage(format!("{shown} is a folder: name a file")));
            }
            if seen.contains(&place) {
                return Err(usage(format!("{shown} is named for two outputs")));
            }
            seen.push(place);
        }
        Ok(Self(()))
    }

    /// Writes a document as one line of JSON without holding its text; true if it went to standard output.
    pub(crate) fn write_json(&self, path: &Path, document: &impl serde::Serialize) -> anyhow::Result<bool> {
        let fill = |out: &mut (dyn Write + Send)| {
            serde_json::to_writer(&mut *out, document)?;
            out.write_all(b"\n")
        };
        if path == Path::new(STDOUT) {
            let mut out = std::io::BufWriter::new(std::io::stdout());
            fill(&mut out).and_then(|()| out.flush())?;
            return Ok(true);
        }
        vice_run::files::atomic::write(path, vice_run::files::atomic::Overwrite::Replace, fill)
            .with_context(|| format!("cannot write {}", path.display()))?;
        Ok(false)
    }

    /// Writes texts; true if one went to standard output, in place of what would be printed there.
    pub(crate) fn write(&self, texts: &[(&PathBuf, String)]) -> anyhow::Result<bool> {
        let mut printed = false;
        for (path, text) in texts {
            if path.as_path() == Path::new(STDOUT) {
                terminal::print(text)?;
                printed = true;
            } else {
                write_text(path, text)?;
            }
        }
        Ok(printed)
    }
}

/// A document beside what is printed, for commands that write nothing else.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct JsonArgs {
    /// Document as JSON; - or no name prints it in place of the text.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-", help_heading = "Output")]
    pub(crate) json: Option<PathBuf>,
}

impl JsonArgs {
    /// Whether the document is printed in place of the text.
    pub(crate) fn is_printed(&self) -> bool {
        self.json.as_deref() == Some(Path::new(STDOUT))
    }

    /// Writes the document where it is asked for, and prints the text; true if the text was printed.
    pub(crate) fn put(
        &self,
        inputs: &[PathBuf],
        document: &impl serde::Serialize,
        verbosity: Verbosity,
        text: impl FnOnce() -> String,
    ) -> anyhow::Result<bool> {
        if let Some(path) = &self.json {
            let outputs = Outputs::new(&[&self.json], inputs)?;
            if outputs.write_json(path, document)? || verbosity.is_quiet() {
                return Ok(false);
            }
        }
        terminal::print(&text())?;
        Ok(true)
    }
}

/// Where an output will be, links followed; it need not be there yet, but its folder must.
fn place(output: &Path) -> anyhow::Result<PathBuf> {
    if let Ok(there) = output.canonicalize() {
        return Ok(there);
    }
    let folder = output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = output.file_name().ok_or_else(|| usage(format!("{} is no file name", output.display())))?;
    let folder = folder
        .canonicalize()
        .map_err(|e| anyhow::anyhow!("cannot write {}: {}: {e}", output.display(), folder.display()))?;
    Ok(folder.join(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_is_not_written() {
        let folder = std::env::temp_dir();
        let input = folder.join("vice-outputs-test");
        std::fs::create_dir_all(&input).unwrap();
        let check = |outputs: &[&str]| {
            let outputs: Vec<Option<PathBuf>> = outputs.iter().map(|o| Some(folder.join(o))).collect();
            Outputs::new(&outputs.iter().collect::<Vec<_>>(), std::slice::from_ref(&input)).is_ok()
        };
        assert!(check(&["vice-outputs.json", "vice-outputs.csv"]));
        assert!(!check(&["vice-outputs-test/x.json"]), "inside the data");
        assert!(!check(&["same.x", "same.x"]));
        assert!(!check(&["no-such-folder/x.json"]));
        assert!(!check(&["."]));
    }
}
