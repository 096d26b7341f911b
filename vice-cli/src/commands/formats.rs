//! `vice formats`.

use std::fmt::Write;

use vice_run::formats::Formats;

use crate::inputs::PluginArgs;
use crate::terminal::{self, Outcome, printable};

/// Arguments of `vice formats`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice formats --plugin libvice_adapter_myrobot.so\n\n\
    Plugins are also loaded from the folders and files of VICE_PLUGIN_PATH and from the user's data folder (on Linux\n\
    ~/.local/share/vice/plugins).")]
pub(crate) struct Args {
    #[command(flatten)]
    plugins: PluginArgs,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
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
                writeln!(text, "    from: {path}{replaces}{older}")?;
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
    terminal::print(&text)?;
    Ok(Outcome::Done)
}
