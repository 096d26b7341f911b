//! `vice labels`.

mod compare;
mod convert;
mod detect;
mod track;

use crate::terminal::{Outcome, Verbosity};

/// What to do with labels.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Measure how far two sets of labels of the same points differ: no RMSE_2D below that means anything.
    Compare(compare::Args),
    /// Convert labels between CSV, JSON, Parquet and CVAT's XML, or from the authors' pickle.
    Convert(convert::Args),
    /// Detect the corners of AprilTags and chessboards as labels.
    Detect(detect::Args),
    /// Choose points and track them through the frames automatically.
    Track(Box<track::Args>),
}

pub(crate) fn run(command: &Command, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    match command {
        Command::Compare(args) => compare::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Detect(args) => detect::run(args, verbosity),
        Command::Track(args) => track::run(args, verbosity),
    }
}
