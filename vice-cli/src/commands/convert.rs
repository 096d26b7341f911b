//! `vice convert`.

use std::path::PathBuf;

use vice_run::conversion::Conversion;
use vice_run::core::conventions::Convention;
use vice_run::files::atomic::Overwrite;
use vice_run::files::trajectory::{write_euroc, write_kitti, write_tum};
use vice_run::request::EstimateSpec;

use crate::inputs::DatasetArgs;
use crate::outputs::{JsonArgs, Outputs};
use crate::terminal::{Outcome, Verbosity};

/// Arguments of `vice convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice convert V1_01_easy --stream ground-truth --to tum ground_truth.txt")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Pose stream of the data set, imu-euler (its IMU integrated from the ground truth's first state), or a file of poses
    /// [default: ground-truth, or the only stream there is].
    #[arg(long, value_name = "NAME|FILE")]
    stream: Option<EstimateSpec>,
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
    #[command(flatten)]
    json: JsonArgs,
}

/// The document `vice.convert/1`.
#[derive(serde::Serialize)]
struct Converted<'a> {
    schema: &'static str,
    out: &'a std::path::Path,
    poses: usize,
    first_ns: i64,
    last_ns: i64,
    path_length_m: f64,
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

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let conversion = Conversion {
        dataset: args.dataset.spec(),
        stream: args.stream.clone(),
        estimate_as: args.estimate_as.clone(),
        mend: args.mend.clone(),
    };
    let trajectory = conversion.trajectory()?;
    // Before anything is written.
    let inputs: Vec<PathBuf> = args.dataset.path.iter().chain([&args.out]).cloned().collect();
    Outputs::new(&[&args.json.json], &inputs)?;
    let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
    match args.to {
        Format::Tum => write_tum(&args.out, &trajectory, overwrite)?,
        Format::Kitti => {
            write_kitti(&args.out, args.out.with_file_name("times.txt"), &trajectory, overwrite)?
        }
        Format::Euroc => write_euroc(&args.out, &trajectory, None, overwrite)?,
    }
    if args.json.json.is_some() {
        let document = Converted {
            schema: "vice.convert/1",
            out: &args.out,
            poses: trajectory.len(),
            first_ns: trajectory.start().as_nanos(),
            last_ns: trajectory.end().as_nanos(),
            path_length_m: trajectory.path_length_m(),
        };
        args.json.put(&inputs, &document, verbosity, String::new)?;
    }
    Ok(Outcome::Done)
}
