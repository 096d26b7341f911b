//! `vice convert`.

use std::path::{Path, PathBuf};

use anyhow::Context;
use vice_core::conventions::{Convention, Given, cure, list_text};
use vice_core::dataset::GROUND_TRUTH;
use vice_core::diagnose::{DiagnosisDocument, mend};
use vice_core::time::Stamp;
use vice_files::atomic::Overwrite;
use vice_files::trajectory::{ReadOptions, read_spec, write_euroc, write_kitti, write_tum};

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
    stream: String,
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
    let dataset = args.dataset.open()?;
    let is_stream = dataset.streams().iter().any(|s| *s == args.stream);
    let mut trajectory = match !is_stream && Path::new(&args.stream).is_file() {
        true => read_spec(&args.stream, &ReadOptions::default())?.trajectory,
        false => dataset.trajectory(&args.stream)?,
    };
    if !args.estimate_as.is_empty() || args.mend.is_some() {
        let camera = args.dataset.camera.clone().or_else(|| dataset.cameras().into_iter().next());
        let first_frame = match &camera {
            Some(camera) => dataset.frames(camera)?.first().copied(),
            None => None,
        };
        let extrinsics = |stamp: Stamp| dataset.body_from_camera(camera.as_ref()?, stamp).ok();
        let given = Given { body_from_camera: Some(&extrinsics), first_frame };
        trajectory = cure(&args.estimate_as, &trajectory, given)
            .with_context(|| format!("--estimate-as {}", list_text(&args.estimate_as)))?;
        if let Some(path) = &args.mend {
            let context = || format!("--mend {}", path.display());
            let text = std::fs::read_to_string(path).with_context(context)?;
            let document: DiagnosisDocument = serde_json::from_str(&text).with_context(context)?;
            trajectory = mend(&document, &trajectory, given).with_context(context)?;
        }
    }
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
