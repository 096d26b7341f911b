//! `vice convert`.

use std::path::PathBuf;

use vice_run::conversion::Conversion;
use vice_run::core::conventions::Convention;
use vice_run::core::dataset::GROUND_TRUTH;
use vice_run::files::atomic::Overwrite;
use vice_run::files::trajectory::{write_euroc, write_kitti, write_tum};
use vice_run::request::EstimateSpec;

use crate::inputs::DatasetArgs;
use crate::terminal::Outcome;

/// Arguments of `vice convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice convert V1_01_easy --stream ground-truth --to tum ground_truth.txt")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Pose stream of the data set, or a file of poses.
    #[arg(long, value_name = "NAME|FILE", default_value = GROUND_TRUTH)]
    stream: EstimateSpec,
    /// What the poses are, where they were read as something else: inverse, wxyz, conjugate, camera, mm, ned, ...
    #[arg(long, value_name = "WHAT,...", value_delimiter = ',')]
    estimate_as: Vec<Convention>,
    /// Write the poses without what a diagnosis (vice.diagnosis/1) found in them: convention, clock, scale, drift.
    #[arg(long, value_name = "DIAGNOSIS.json")]
    mend: Option<PathBuf>,
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
    let conversion = Conversion {
        dataset: args.dataset.spec(),
        stream: args.stream.clone(),
        estimate_as: args.estimate_as.clone(),
        mend: args.mend.clone(),
    };
    let trajectory = conversion.trajectory()?;
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
