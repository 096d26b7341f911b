//! `vice convert`.

use std::path::PathBuf;

use vice_core::dataset::GROUND_TRUTH;
use vice_files::atomic::Overwrite;
use vice_files::trajectory::{TrajectoryFormat, write};

use crate::inputs::DatasetArgs;
use crate::terminal::Outcome;

/// Arguments of `vice convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice convert V1_01_easy --stream ground-truth --to tum ground_truth.txt")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Pose stream of the data set.
    #[arg(long, value_name = "NAME", default_value = GROUND_TRUTH)]
    stream: String,
    /// Format to write.
    #[arg(long, value_name = "tum|kitti|euroc")]
    to: TrajectoryFormat,
    /// File to write; for KITTI a file of times is written beside it.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Replace a file that exists.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let dataset = args.dataset.open()?;
    let trajectory = dataset.trajectory(&args.stream)?;
    let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
    write(&args.out, args.to, &trajectory, overwrite)?;
    Ok(Outcome::Done)
}
