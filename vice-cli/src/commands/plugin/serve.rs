//! `vice plugin serve`: the process of a plugin, which the program starts for it.

use std::path::PathBuf;

use vice_run::host::LoadOptions;
use vice_run::host::isolated;

use crate::terminal::Outcome;

/// Arguments of `vice plugin serve`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice info my_run --plugin libvice_adapter_myrobot.so --isolate-plugins\n\n\
    starts it with pipes. By hand it waits for requests that nobody writes.")]
pub(crate) struct Args {
    /// The plugin, a shared library.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Load the plugin even from a file or folder that others may write to.
    #[arg(long)]
    allow_writable_plugin: bool,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    isolated::serve(&args.file, &LoadOptions { allow_writable: args.allow_writable_plugin })?;
    Ok(Outcome::Done)
}
