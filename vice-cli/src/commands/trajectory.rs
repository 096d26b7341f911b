//! `vice trajectory`: two trajectories against each other, as evo does.

use std::path::PathBuf;

use vice_run::core::conventions::Convention;
use vice_run::core::metrics::align::Alignment;
use vice_run::core::metrics::plane::Plane;
use vice_run::core::metrics::rpe::DeltaUnit;
use vice_run::core::time::{Span, Stamp};
use vice_run::files::atomic::{self, Overwrite};
use vice_run::request::EstimateSpec;
use vice_run::trajectory::{
    Compared, TrajectoriesDocument, TrajectoryRequest, compare_trajectories, plot_several, render_several,
};

use crate::inputs::{span, span_not_negative, to_json};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, Verbosity, usage};

/// Arguments of `vice trajectory`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: vice trajectory ground_truth.csv estimate.txt --align se3 --delta 1 --delta-unit meters --all-pairs\n\n\
    Files are tables with a heading that names the columns, else TUM, EuRoC CSV or KITTI by their content, or relative \
    motions as rel:FILE. A data set is its ground truth or its only stream; DATASET:STREAM is another, as run.bag:/odom or \
    run.bag:/tf:map.base_link.\n\n\
    Several estimates make one table and one plot: vice trajectory V1_01_easy vins.txt orb.txt --align se3 --plot all.svg"
)]
pub(crate) struct Args {
    /// Reference trajectory.
    #[arg(value_name = "REF")]
    reference: EstimateSpec,
    /// Estimated trajectories.
    #[arg(value_name = "EST", required = true)]
    estimates: Vec<EstimateSpec>,
    /// What the estimate is, where that is not what it is read as: inverse, wxyz, conjugate, mm, ned, ...
    #[arg(long, value_name = "WORD,...", value_delimiter = ',')]
    estimate_as: Vec<Convention>,
    /// Alignment of the estimate: none, first-pose, yaw, se3, sim3.
    #[arg(long, value_name = "HOW", default_value = "none")]
    align: Alignment,
    /// Align on this many poses from the first on [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    n_to_align: Option<u64>,
    /// Largest time difference of two poses that belong together, seconds [default: 0.01].
    #[arg(long, value_name = "S", value_parser = span_not_negative)]
    t_max_diff: Option<Span>,
    /// Seconds added to the stamps of the estimate.
    #[arg(
        long = "time-offset",
        alias = "t-offset",
        value_name = "S",
        default_value = "0",
        allow_hyphen_values = true,
        value_parser = span
    )]
    t_offset: Span,
    /// Interpolate the reference at the stamps of the estimate instead of taking the nearest pose.
    #[arg(long)]
    interpolate: bool,
    /// Widest gap of the reference that --interpolate bridges, seconds [default: 0.1].
    #[arg(long, value_name = "S", value_parser = span_not_negative)]
    max_gap: Option<Span>,
    /// Only from this stamp on, seconds.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = stamp)]
    t_start: Option<Stamp>,
    /// Only up to this stamp, seconds.
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = stamp)]
    t_end: Option<Stamp>,
    /// Flatten both trajectories to a plane before comparing.
    #[arg(long, value_name = "xy|xz|yz")]
    project_to_plane: Option<Plane>,
    /// Stretch between the poses of a pair, for RPE.
    #[arg(long, value_name = "D", default_value_t = 1.0)]
    delta: f64,
    /// What the stretch is measured in: frames, meters, seconds, degrees.
    #[arg(long, value_name = "UNIT", default_value = "frames")]
    delta_unit: DeltaUnit,
    /// Start a pair at every pose, not only where the one before ended.
    #[arg(long)]
    all_pairs: bool,
    /// Measure the stretch along the reference instead of the estimate.
    #[arg(long)]
    pairs_from_reference: bool,
    /// Times of KITTI files [default: times.txt beside each].
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    /// Show angles in degrees; documents keep radians.
    #[arg(long)]
    deg: bool,
    /// Result document, vice.trajectory/1, of several estimates vice.trajectories/1; - prints it in place of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Both paths from above and their differences over time.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// The APE of translations as an archive that evo's evo_res reads.
    #[arg(long, value_name = "FILE.zip")]
    evo_zip: Option<PathBuf>,
}

impl Args {
    fn request(&self, estimate: &EstimateSpec) -> TrajectoryRequest {
        TrajectoryRequest {
            reference: self.reference.clone(),
            estimate: estimate.clone(),
            estimate_as: self.estimate_as.clone(),
            align: self.align,
            n_to_align: self.n_to_align.map(|n| usize::try_from(n).unwrap_or(usize::MAX)),
            t_max_diff: self.t_max_diff,
            t_offset: self.t_offset,
            interpolate: self.interpolate,
            max_gap: self.max_gap,
            t_start: self.t_start,
            t_end: self.t_end,
            project_to_plane: self.project_to_plane,
            delta: self.delta,
            delta_unit: self.delta_unit,
            all_pairs: self.all_pairs,
            pairs_from_reference: self.pairs_from_reference,
            times: self.times.clone(),
        }
    }
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let requests: Vec<TrajectoryRequest> =
        args.estimates.iter().map(|estimate| args.request(estimate)).collect();
    let inputs: Vec<PathBuf> = requests.iter().flat_map(TrajectoryRequest::inputs).collect();
    let outputs = Outputs::new(&[&args.json, &args.plot, &args.evo_zip], &inputs)?;
    if args.evo_zip.is_some() && requests.len() > 1 {
        return Err(usage("--evo-zip: an archive of evo's holds one estimate; name one"));
    }
    let compared: Vec<Compared> = requests.iter().map(compare_trajectories).collect::<Result<_, _>>()?;
    for one in &compared {
        terminal::warn(one.document.suspicions.iter());
    }
    let mut texts = Vec::new();
    if let Some(path) = &args.json {
        let text = match compared.as_slice() {
            [one] => to_json(&one.document)?,
            several => to_json(&TrajectoriesDocument::of(several))?,
        };
        texts.push((path, text));
    }
    if let Some(path) = &args.plot {
        texts.push((path, plot_several(&compared)));
    }
    if let (Some(path), [one]) = (&args.evo_zip, compared.as_slice()) {
        let bytes = one.evo_zip()?;
        atomic::write(path, Overwrite::Replace, |out| out.write_all(&bytes))?;
    }
    let in_a_file = args.json.is_some() && verbosity.is_quiet();
    if !outputs.write(&texts)? && !in_a_file {
        terminal::print(&match compared.as_slice() {
            [one] => one.table(args.deg),
            several => render_several(several, args.deg),
        })?;
    }
    Ok(Outcome::Done)
}

fn stamp(text: &str) -> Result<Stamp, String> {
    Stamp::parse_seconds(text).map_err(|e| e.to_string())
}
