//! `vice labels`.

mod compare;
mod convert;
mod detect;
mod track;

use crate::terminal::{Outcome, Verbosity};

/// What to do with labels.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// How far two sets of labels lie apart: the floor under RMSE_2D.
    Compare(compare::Args),
    /// Convert labels between CSV, JSON, Parquet and CVAT's XML, or from the authors' pickle.
    Convert(convert::Args),
    /// Label the corners of AprilTags and chessboards by themselves.
    Detect(detect::Args),
    /// Choose points and follow them through the frames, without a hand.
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
