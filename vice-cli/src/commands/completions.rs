//! `vice completions`.

use clap::CommandFactory;

use crate::arguments::Cli;
use crate::terminal::{self, Outcome};

/// Arguments of `vice completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice completions bash > ~/.local/share/bash-completion/completions/vice")]
pub(crate) struct Args {
    /// The shell.
    shell: clap_complete::Shell,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "vice", &mut script);
    terminal::print(&String::from_utf8(script)?)?;
    Ok(Outcome::Done)
}
