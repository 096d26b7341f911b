//! `vice demo`: a flight, three estimates, and what VICE sees of them.

use std::path::PathBuf;

use crate::terminal::{self, Outcome, Verbosity, with_progress};

/// Arguments of `vice demo`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vice demo\n  vice demo --out demo_out   (keeps the flight, the result and a picture)"
)]
pub(crate) struct Args {
    /// Folder to keep the flight, the result document and a picture in; it must be empty or new.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that is not empty.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let text =
        with_progress(verbosity, |progress| vice_run::demo::run(args.out.as_deref(), args.force, progress))?;
    terminal::print(&text)?;
    Ok(Outcome::Done)
}
