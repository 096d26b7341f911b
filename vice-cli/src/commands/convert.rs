//! `vice convert`.

use std::path::PathBuf;

use vice_run::core::dataset::GROUND_TRUTH;
use vice_run::files::atomic::Overwrite;
use vice_run::files::trajectory::{write_euroc, write_kitti, write_tum};

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
    #[arg(long)]
    to: Format,
    /// File to write; for KITTI the stamps go to times.txt beside it.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Replace a file that exists.
    #[arg(long)]
    force: bool,
}

/// A trajectory format.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Format {
    /// `t tx ty tz qx qy qz qw`
    Tum,
    /// 3x4 matrices, and a file of times
    Kitti,
    /// CSV with nanoseconds
    Euroc,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let spec = args.dataset.spec();
    let dataset = spec.open_raw(&vice_run::formats::registry(&spec.plugins)?)?;
    if spec.camera.is_some() {
        spec.camera_name(dataset.as_ref())?;
    }
    let trajectory = dataset.trajectory(&args.stream)?;
    let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
    match args.to {
        Format::Tum => write_tum(&args.out, &trajectory, overwrite)?,
        Format::Kitti => {
            write_kitti(&args.out, args.out.with_file_name("times.txt"), &trajectory, overwrite)?
        }
        Format::Euroc => write_euroc(&args.out, &trajectory, None, overwrite)?,
    }
    Ok(Outcome::Done)
}
