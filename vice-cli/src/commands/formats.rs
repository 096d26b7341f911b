//! `vice formats`.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

use vice_run::core::dataset::FormatInfo;
use vice_run::formats::Formats;

use crate::inputs::PluginArgs;
use crate::outputs::JsonArgs;
use crate::terminal::{Outcome, Verbosity, printable};

/// Arguments of `vice formats`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice formats --plugin libvice_adapter_myrobot.so\n\n\
    Plugins are also loaded from the folders and files of VICE_PLUGIN_PATH and from the user's data folder (on Linux \
    ~/.local/share/vice/plugins).")]
pub(crate) struct Args {
    #[command(flatten)]
    plugins: PluginArgs,
    #[command(flatten)]
    json: JsonArgs,
}

/// The document `vice.formats/1`.
#[derive(serde::Serialize)]
struct FormatsDocument {
    schema: &'static str,
    formats: Vec<FormatEntry>,
    /// Why libraries that nobody named were not loaded.
    not_loaded: Vec<String>,
}

#[derive(serde::Serialize)]
struct FormatEntry {
    name: String,
    version: String,
    description: String,
    offers: Vec<String>,
    /// Settings and what they do.
    settings: BTreeMap<String, String>,
    /// The library that it came with; nothing where it is built in.
    plugin: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let formats = Formats::load(&args.plugins.spec())?;
    let mut text = String::new();
    for format in formats.registry.formats() {
        let shown = |s: &str| printable(s);
        writeln!(text, "{} {}  {}", format.name, shown(&format.version), shown(&format.description))?;
        match formats.plugins.iter().find(|p| p.plugin.info().name == format.name) {
            Some(found) => {
                let path = shown(&found.plugin.path().display().to_string());
                let replaces = if found.replaces { ", in place of the one built in" } else { "" };
                let older = if found.plugin.complete_table() { "" } else { ", made for an older VICE" };
                let apart = if found.plugin.is_isolated() { ", in a process of its own" } else { "" };
                writeln!(text, "    from: {path}{replaces}{older}{apart}")?;
            }
            None => writeln!(text, "    from: built in")?,
        }
        writeln!(text, "    offers: {}", shown(&format.offers.join(", ")))?;
        for setting in &format.settings {
            writeln!(text, "    --set {}=...  {}", setting.key, shown(&setting.description))?;
        }
    }
    if !formats.left_out.is_empty() {
        writeln!(text, "not loaded")?;
    }
    for line in &formats.left_out {
        writeln!(text, "    {}", printable(line))?;
    }
    let entry = |format: FormatInfo| {
        let plugin = formats.plugins.iter().find(|p| p.plugin.info().name == format.name);
        FormatEntry {
            plugin: plugin.map(|p| p.plugin.path().to_path_buf()),
            settings: format.settings.into_iter().map(|s| (s.key, s.description)).collect(),
            name: format.name,
            version: format.version,
            description: format.description,
            offers: format.offers,
        }
    };
    let document = FormatsDocument {
        schema: "vice.formats/1",
        formats: formats.registry.formats().into_iter().map(entry).collect(),
        not_loaded: formats.left_out.clone(),
    };
    args.json.put(&args.plugins.files, &document, verbosity, || text)?;
    Ok(Outcome::Done)
}
