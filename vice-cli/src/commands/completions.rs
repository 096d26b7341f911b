//! `vice completions`.

use crate::terminal::{self, Outcome};

/// Arguments of `vice completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice completions bash > ~/.local/share/bash-completion/completions/vice")]
pub(crate) struct Args {
    /// The shell.
    shell: clap_complete::Shell,
}

/// The script for the commands of a program.
pub(crate) fn run(args: &Args, mut command: clap::Command) -> anyhow::Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "vice", &mut script);
    terminal::print(&String::from_utf8(script)?)?;
    Ok(Outcome::Done)
}
