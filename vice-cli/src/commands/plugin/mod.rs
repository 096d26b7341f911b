//! `vice plugin`.

mod check;
mod child;
mod new;
mod serve;

use crate::itself::Itself;
use crate::terminal::Outcome;

/// What to do with plugins.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Try all that a plugin should do on one of its data sets, and say what is wrong.
    Check(Box<check::Args>),
    /// Write the project of a new plugin, which works and has a test.
    New(new::Args),
    /// Serve a plugin to the program that started this one: what the program starts as its child.
    #[command(hide = true)]
    Serve(serve::Args),
}

pub(crate) fn run(command: &Command, itself: &Itself) -> anyhow::Result<Outcome> {
    match command {
        Command::Check(args) => check::run(args, itself),
        Command::New(args) => new::run(args),
        Command::Serve(args) => serve::run(args),
    }
}
