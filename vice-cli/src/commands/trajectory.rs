//! `vice trajectory`: two trajectories against each other, as evo does.

use std::path::PathBuf;

use anyhow::Context;
use serde::Serialize;
use vice_core::conventions::{Convention, Given, cure, list_text, suspect};
use vice_core::metrics::align::{Alignment, align};
use vice_core::metrics::associate::{Matching, PosePairs, crop};
use vice_core::metrics::plane::Plane;
use vice_core::metrics::rpe::{Delta, DeltaUnit, PairMode, PairsFrom, Rpe, RpeErrors, RpeOptions};
use vice_core::metrics::trajectory::{Ape, ApeErrors, Statistics, Summary};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_files::atomic::Overwrite;
use vice_files::trajectory::{ReadOptions, TrajectoryFormat, read_spec};

use crate::inputs::{Outputs, span, span_not_negative, to_json};
use crate::report::evo_zip::{self, About};
use crate::report::plots::trajectory as plot;
use crate::report::table;
use crate::terminal::{self, Outcome, usage};

/// Arguments of `vice trajectory`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: vice trajectory ground_truth.csv estimate.txt --align se3 --delta 1 --delta-unit meters --all-pairs\n\n\
    Files are TUM, EuRoC CSV or KITTI by their content, or relative motions as rel:FILE."
)]
pub(crate) struct Args {
    /// Reference trajectory.
    #[arg(value_name = "REF")]
    reference: String,
    /// Estimated trajectory.
    #[arg(value_name = "EST")]
    estimate: String,
    /// Alignment of the estimate: none, first-pose, yaw, se3, sim3.
    #[arg(long, value_name = "HOW", default_value = "none")]
    align: Alignment,
    /// Align on this many poses from the first on [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    n_to_align: Option<u64>,
    /// Largest time difference of two poses that belong together, seconds.
    #[arg(long, value_name = "S", default_value = "0.01", value_parser = span_not_negative)]
    t_max_diff: Span,
    /// Seconds added to the stamps of the estimate.
    #[arg(long, value_name = "S", default_value = "0", allow_hyphen_values = true, value_parser = span)]
    t_offset: Span,
    /// Interpolate the reference at the stamps of the estimate instead of taking the nearest pose.
    #[arg(long)]
    interpolate: bool,
    /// Widest gap of the reference that --interpolate bridges, seconds.
    #[arg(long, value_name = "S", default_value = "0.1", value_parser = span_not_negative)]
    max_gap: Span,
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
    /// What the estimate is, where it was read as something else: inverse, wxyz, conjugate, mm, ned, ...
    #[arg(long, value_name = "WHAT,...", value_delimiter = ',')]
    estimate_as: Vec<Convention>,
    /// Times of KITTI files [default: times.txt beside each].
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    /// Result document, vice.trajectory/1; - prints it in place of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Both paths from above and their differences over time.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// The APE of translations as an archive that evo's evo_res reads.
    #[arg(long, value_name = "FILE.zip")]
    evo_zip: Option<PathBuf>,
}

/// The document `vice.trajectory/1`.
#[derive(Serialize)]
struct Document {
    schema: &'static str,
    reference: String,
    estimate: String,
    matched: usize,
    align: &'static str,
    scale: f64,
    rmse_3d_m: f64,
    aoe_rad: f64,
    roe_rad: Option<f64>,
    ape: Ape,
    rpe: Option<RpePart>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rpe_problem: Option<String>,
}

#[derive(Serialize)]
struct RpePart {
    delta: f64,
    delta_unit: &'static str,
    all_pairs: bool,
    #[serde(flatten)]
    errors: Rpe,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let delta = Delta::new(args.delta, args.delta_unit).map_err(|e| usage(format!("--delta: {e}")))?;
    let read_files =
        [&args.reference, &args.estimate].map(|s| PathBuf::from(s.strip_prefix("rel:").unwrap_or(s)));
    let outputs = Outputs::new(&[&args.json, &args.plot, &args.evo_zip], &read_files)?;
    let (reference, estimate) = read_both(args)?;
    // As evo: what the reference no longer has is not matched either.
    let reference = crop(&reference, args.t_start, args.t_end).with_context(|| args.reference.clone())?;
    let matching = match args.interpolate {
        true => Matching::Interpolate { max_gap: args.max_gap },
        false => Matching::Nearest { t_max_diff: args.t_max_diff },
    };
    let pairs = PosePairs::match_up(&reference, &estimate, matching, args.t_offset)
        .with_context(|| format!("{} against {}", args.estimate, args.reference))?;
    if let Some(suspected) = suspect(&pairs, Given::default()) {
        tracing::warn!("{}: {}", args.estimate, suspected.line());
    }
    let n_to_align = args.n_to_align.map(|n| usize::try_from(n).unwrap_or(usize::MAX));
    let transform = align(&pairs, args.align, n_to_align)
        .with_context(|| format!("--align {} of {}", args.align.name(), args.estimate))?;
    let mut pairs = transform.apply_to(&pairs);
    if let Some(plane) = args.project_to_plane {
        pairs = plane.project_pairs(&pairs);
    }
    let summary = Summary::of(&pairs)?;
    let mode = if args.all_pairs { PairMode::All } else { PairMode::Consecutive };
    let pairs_from = if args.pairs_from_reference { PairsFrom::Reference } else { PairsFrom::Estimate };
    let options = RpeOptions { delta, mode, pairs_from };
    let (rpe, rpe_problem) = match RpeErrors::of(&pairs, &options).and_then(|e| e.statistics()) {
        Ok(errors) => (Some(errors), None),
        Err(error) => (None, Some(error.to_string())),
    };
    let rpe = rpe.map(|errors| RpePart {
        delta: args.delta,
        delta_unit: args.delta_unit.name(),
        all_pairs: args.all_pairs,
        errors,
    });
    let document = Document {
        schema: "vice.trajectory/1",
        reference: args.reference.clone(),
        estimate: args.estimate.clone(),
        matched: pairs.len(),
        align: args.align.name(),
        scale: transform.scale,
        rmse_3d_m: summary.rmse_3d_m,
        aoe_rad: summary.aoe_rad,
        roe_rad: summary.roe_rad,
        ape: ApeErrors::of(&pairs).statistics()?,
        rpe,
        rpe_problem,
    };
    let mut texts = Vec::new();
    if let Some(path) = &args.json {
        texts.push((path, to_json(&document)?));
    }
    if let Some(path) = &args.plot {
        texts.push((path, plot::file(&pairs, &args.reference, &args.estimate)));
    }
    let (reference, estimated) = (args.reference.as_str(), args.estimate.as_str());
    let about = About { reference, estimate: estimated, align: args.align.name(), transform: &transform };
    let archive = args.evo_zip.as_ref().map(|path| anyhow::Ok((path, evo_zip::encode(&pairs, &about)?)));
    if let Some((path, bytes)) = archive.transpose()? {
        vice_files::atomic::write(path, Overwrite::Replace, |out| out.write_all(&bytes))?;
    }
    if !outputs.write(&texts)? {
        terminal::print(&render(&document, estimate.len()))?;
    }
    Ok(Outcome::Done)
}

/// Two KITTI files without times are compared row by row; one alone has no clock to compare by.
fn read_both(args: &Args) -> anyhow::Result<(Trajectory, Trajectory)> {
    let read = |spec: &str, index_as_seconds| {
        read_spec(spec, &ReadOptions { times: args.times.clone(), index_as_seconds })
    };
    let (reference, estimate) = rayon::join(|| read(&args.reference, true), || read(&args.estimate, true));
    let (mut reference, mut estimate) = (reference?, estimate?);
    match (reference.format, estimate.format) {
        (TrajectoryFormat::Kitti, TrajectoryFormat::Kitti) => {}
        (TrajectoryFormat::Kitti, _) => reference = read(&args.reference, false)?,
        (_, TrajectoryFormat::Kitti) => estimate = read(&args.estimate, false)?,
        _ => {}
    }
    let estimate = cure(&args.estimate_as, &estimate.trajectory, Given::default())
        .with_context(|| format!("--estimate-as {}", list_text(&args.estimate_as)))?;
    Ok((reference.trajectory, estimate))
}

fn stamp(text: &str) -> Result<Stamp, String> {
    Stamp::parse_seconds(text).map_err(|e| e.to_string())
}

fn render(d: &Document, estimate_poses: usize) -> String {
    let roe = d.roe_rad.map_or_else(|| "-".to_string(), |v| format!("{v:.4}"));
    let mut text = format!(
        "matched {} of {estimate_poses} poses, align {}{}\nRMSE_3D {:.4} m, AOE {:.4} rad, ROE {roe} rad\n\n",
        d.matched,
        d.align,
        if d.scale == 1.0 { String::new() } else { format!(", scale {:.6}", d.scale) },
        d.rmse_3d_m,
        d.aoe_rad,
    );
    let mut grid = vec![["error", "rmse", "mean", "median", "std", "min", "max"].map(String::from).to_vec()];
    let mut add = |name: String, s: &Statistics| {
        let numbers = [s.rmse, s.mean, s.median, s.std, s.min, s.max];
        grid.push(std::iter::once(name).chain(numbers.map(|v| format!("{v:.6}"))).collect());
    };
    add("APE translation m".to_string(), &d.ape.translation_m);
    add("APE rotation rad".to_string(), &d.ape.rotation_rad);
    if let Some(rpe) = &d.rpe {
        let pairs = format!("{} {}, {} pairs", rpe.delta, rpe.delta_unit, rpe.errors.pairs);
        add(format!("RPE translation m ({pairs})"), &rpe.errors.translation_m);
        add("RPE rotation rad".to_string(), &rpe.errors.rotation_rad);
    }
    text.push_str(&table::align(&grid));
    if let Some(problem) = &d.rpe_problem {
        text.push_str(&format!("no RPE: {problem}\n"));
    }
    text
}
