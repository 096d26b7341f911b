//! `vice evaluate`: the main job.

use std::path::PathBuf;

use vice_core::depth::DepthSource;
use vice_core::evaluate::{
    EvaluateError, Evaluation, Observations, SampleSink, Selection, evaluate, evaluate_streaming,
};
use vice_core::metrics::align::Alignment;
use vice_core::result::{ResultDocument, Settings};

use vice_core::dataset::{Dataset, Floor};

use crate::inputs::{DatasetArgs, DepthArgs, LabelArgs, Outputs, StreamArgs, load_streams, split_list};
use crate::report;
use crate::report::sample_lines;
use crate::terminal::{self, Outcome, Verbosity, usage};

/// Arguments of `vice evaluate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice evaluate V1_01_easy --labels floor.csv --estimate imu-euler,openvins.txt --depth floor,zmap\n  \
    vice evaluate my_run --labels labels.json --estimate rel:odometry.txt --reference none --depth zcam --json out.json\n\n\
    Lists repeat the option or take commas. Estimates are names of the data set's streams, `imu-euler` (Euler\n\
    integration of its IMU from the reference state at the first key frame), or files: TUM, EuRoC CSV, KITTI with a\n\
    times file, and relative motions as rel:FILE.")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    labels: LabelArgs,
    #[command(flatten)]
    streams: StreamArgs,
    /// Depth sources: floor, zmap, zcam, mesh, tag [default: floor].
    #[arg(long, value_name = "SOURCE,...", help_heading = "Depth")]
    depth: Vec<String>,
    #[command(flatten)]
    depth_options: DepthArgs,
    #[command(flatten)]
    scoring: ScoringArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// How it is scored.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Scoring")]
struct ScoringArgs {
    /// Numbers of points whose subsets are averaged over [default: those up to 3 that exist].
    #[arg(long, value_name = "N,...", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..))]
    subsets: Vec<u16>,
    /// Alignment of the trajectory errors: none, first-pose, yaw, se3, sim3.
    #[arg(long, value_name = "HOW", default_value = "se3")]
    align: Alignment,
    /// Exit with 3 if more labels than this could not be scored, percent.
    #[arg(long, value_name = "PERCENT", default_value = "10", value_parser = percent)]
    max_skipped: f64,
}

/// What is written beside the table.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Output")]
struct OutputArgs {
    /// Where the scored samples go: into the JSON, nowhere, or one a line into a file beside it (FILE.samples.jsonl).
    #[arg(long, value_enum, value_name = "HOW", default_value = "all")]
    samples: Samples,
    /// Result document, vice.result/1; - prints it in place of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// The table as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// The table as LaTeX.
    #[arg(long, value_name = "FILE")]
    latex: Option<PathBuf>,
}

/// What becomes of the scored samples, of which a long run has millions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Samples {
    All,
    None,
    Jsonl,
}

fn percent(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=100.0).contains(&value) => Ok(value),
        _ => Err("expected a number from 0 to 100".to_string()),
    }
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let outputs = Outputs::new(&[&args.output.json, &args.output.csv, &args.output.latex], &inputs(args))?;
    let samples = samples_file(args)?;
    let document = match &samples {
        Some(path) => sample_lines::write(path, |sink| document(args, verbosity, Some(sink)))?,
        None => document(args, verbosity, None)?,
    };
    // All texts are made before the first is written, so that a failure leaves nothing half done. The JSON may be too
    // large to be one.
    let csv =
        args.output.csv.as_ref().map(|path| report::csv::render(&document).map(|t| (path, t))).transpose()?;
    let latex = args
        .output
        .latex
        .as_ref()
        .map(|path| report::latex::render(&document).map(|t| (path, t)))
        .transpose()?;
    let texts: Vec<(&PathBuf, String)> = [csv, latex].into_iter().flatten().collect();
    let json_printed =
        args.output.json.as_ref().map_or(Ok(false), |path| outputs.write_json(path, &document))?;
    if !(outputs.write(&texts)? || json_printed) {
        terminal::print(&report::table::render(&document))?;
    }
    let worst = document.worst_skipped_percent();
    if worst > args.scoring.max_skipped {
        verbosity.note(&format!(
            "{worst:.1} % of the labels of a stream could not be scored, more than --max-skipped {} allows",
            args.scoring.max_skipped
        ));
        return Ok(Outcome::TooManySkips);
    }
    Ok(Outcome::Done)
}

/// The file of samples beside the JSON, where it is asked for.
fn samples_file(args: &Args) -> anyhow::Result<Option<PathBuf>> {
    match (args.output.samples, &args.output.json) {
        (Samples::Jsonl, Some(json)) if json.as_os_str() != "-" => {
            let path = json.with_extension("samples.jsonl");
            Outputs::new(&[&Some(path.clone()), &args.output.csv, &args.output.latex], &inputs(args))?;
            Ok(Some(path))
        }
        (Samples::Jsonl, _) => Err(usage("--samples jsonl writes beside the JSON: name a file with --json")),
        _ => Ok(None),
    }
}

fn document(
    args: &Args,
    verbosity: Verbosity,
    sink: Option<&mut SampleSink<'_>>,
) -> anyhow::Result<ResultDocument> {
    let calibration = args.depth_options.calibration()?;
    let floor = args.depth_options.floor()?;
    let dataset = args.dataset.open()?;
    let used = args.dataset.used_camera(dataset.as_ref(), calibration.as_ref())?;
    tracing::info!(
        "{} ({}): camera {} with {} frames",
        dataset.name(),
        dataset.format(),
        used.name,
        used.frames.len()
    );
    let labels = args.labels.read(&used.frames)?;
    tracing::info!("{} points with {} labels", labels.points().len(), labels.observation_count());
    let window = args.labels.window();
    let in_labels = |error: EvaluateError| match error {
        EvaluateError::Data(error) => anyhow::Error::new(error),
        error => anyhow::Error::new(error).context(args.labels.labels.display().to_string()),
    };
    let selection = Selection::new(&labels, &used.frames, &used.camera, &window).map_err(in_labels)?;
    let subsets: Vec<usize> = args.scoring.subsets.iter().map(|n| usize::from(*n)).collect();
    if let Some(asked) = subsets.iter().find(|n| **n > selection.point_count()) {
        let points = selection.point_count();
        return Err(usage(EvaluateError::SubsetTooLarge { asked: *asked, points }.to_string()));
    }
    let world_depth = asks_for_the_world(args, dataset.as_ref(), &selection)?;
    let streams =
        load_streams(&args.streams, dataset.as_ref(), &used, &selection, calibration.as_ref(), world_depth)?;
    for stream in &streams.list {
        let t = &stream.trajectory;
        tracing::info!("stream {}: {} poses, {} to {} ns", stream.name, t.len(), t.start(), t.end());
    }
    let sources = args.depth_options.sources("--depth", &args.depth, &dataset, &used.name)?;
    let sources: Vec<&dyn DepthSource> = sources.iter().map(AsRef::as_ref).collect();
    let settings = Settings {
        labels: args.labels.labels.display().to_string(),
        points: labels.points().iter().map(|p| p.name.clone()).collect(),
        fps: args.labels.fps,
        start_s: args.labels.start.as_secs_f64(),
        duration_s: args.labels.duration.map(|d| d.as_secs_f64()),
        max_gap_s: args.streams.max_gap.as_secs_f64(),
        time_offset_s: streams.time_offset.as_secs_f64(),
        align: args.scoring.align.name().to_string(),
        anchor: streams.list[streams.anchor].name.clone(),
        calibration: args.depth_options.calibration.as_ref().map(|p| p.display().to_string()),
        floor_plane: args.depth_options.floor_plane,
        zmap_occlusion: args.depth_options.zmap_occlusion,
        estimate_frame: args.streams.estimate_frame.clone(),
        other: other_settings(args),
    };
    let evaluation = Evaluation {
        dataset: dataset.as_ref(),
        camera_name: &used.name,
        camera: &used.camera,
        body_from_camera: used.body_from_camera,
        frames: &used.frames,
        selection: &selection,
        streams: &streams.list,
        anchor: streams.anchor,
        depths: &sources,
        floor,
        max_gap: args.streams.max_gap,
        subsets: (!subsets.is_empty()).then_some(subsets.as_slice()),
        align: args.scoring.align,
        keep_samples: args.output.samples == Samples::All && args.output.json.is_some(),
        settings,
    };
    let bar = verbosity.progress("evaluating");
    let progress = |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let document = match sink {
        Some(sink) => evaluate_streaming(&evaluation, &progress, sink)?,
        None => evaluate(&evaluation, &progress)?,
    };
    bar.finish_and_clear();
    Ok(document)
}

/// Whether a depth source needs the camera's place in the world: a depth camera and a floor under the body do not.
fn asks_for_the_world(args: &Args, dataset: &dyn Dataset, selection: &Selection<'_>) -> anyhow::Result<bool> {
    let names = split_list(&args.depth);
    let floor_in_world = || -> anyhow::Result<bool> {
        let Some(stamp) = selection.first_keyframe() else { return Ok(true) };
        Ok(args.depth_options.floor_plane.is_some() || matches!(dataset.floor(stamp)?, Floor::World(_)))
    };
    if names.iter().any(|n| n == "zmap" || n == "mesh") {
        return Ok(true);
    }
    Ok((names.is_empty() || names.iter().any(|n| n == "floor")) && floor_in_world()?)
}

/// Options that have no field of their own in the document.
fn other_settings(args: &Args) -> std::collections::BTreeMap<String, String> {
    let mut other: std::collections::BTreeMap<String, String> =
        args.dataset.settings.iter().map(|(key, value)| (format!("set {key}"), value.clone())).collect();
    other.insert("estimate".to_string(), split_list(&args.streams.estimate).join(","));
    if let Some(reference) = &args.streams.reference {
        other.insert("reference".to_string(), reference.clone());
    }
    if let Some(times) = &args.streams.times {
        other.insert("times".to_string(), times.display().to_string());
    }
    if let Some(pose) = &args.streams.initial_pose {
        other.insert("initial-pose".to_string(), pose.map(|v| v.to_string()).join(","));
    }
    if !args.scoring.subsets.is_empty() {
        let sizes: Vec<String> = args.scoring.subsets.iter().map(u16::to_string).collect();
        other.insert("subsets".to_string(), sizes.join(","));
    }
    if args.labels.observations != Observations::All {
        other.insert("observations".to_string(), args.labels.observations.name().to_string());
    }
    if let Some(voxel_m) = args.depth_options.cloud_voxel {
        other.insert("cloud-voxel".to_string(), voxel_m.to_string());
    }
    if let Some([near, far]) = args.depth_options.zcam_range {
        other.insert("zcam-range".to_string(), format!("{near},{far}"));
    }
    if let Some(size_m) = args.depth_options.tag_size {
        other.insert("tag-size".to_string(), size_m.to_string());
        other.insert("tag-family".to_string(), args.depth_options.tag_family.name().to_string());
    }
    other
}

/// What is read, and so must not be written over: files, and the whole data set.
fn inputs(args: &Args) -> Vec<PathBuf> {
    let mut inputs = vec![args.dataset.path.clone(), args.labels.labels.clone()];
    let specs = split_list(&args.streams.estimate).into_iter().chain(args.streams.reference.clone());
    inputs.extend(specs.map(|spec| PathBuf::from(spec.strip_prefix("rel:").unwrap_or(&spec))));
    inputs.extend(args.streams.times.iter().chain(&args.depth_options.calibration).cloned());
    inputs.push(PathBuf::from(&args.streams.estimate_frame));
    inputs
}
