//! `vice labels detect`: calibration targets as labels.

use std::ops::ControlFlow;
use std::path::PathBuf;

use vice_core::evaluate::Window;
use vice_core::label::{LabelRow, LabelSet};
use vice_core::time::Span;
use vice_detect::{BoardSize, DetectOptions, DetectReport, TagFamily, TagOptions, additions, detect_labels};
use vice_files::atomic::Overwrite;
use vice_files::calibration::CalibrationFile;
use vice_files::labels::{self, LabelFormat};

use crate::inputs::{DatasetArgs, Outputs, positive, span_not_negative};
use crate::terminal::{self, Outcome, Verbosity, advance, printable, usage};

/// Arguments of `vice labels detect`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice labels detect V1_01_easy --apriltag 36h11 --out tags.json\n  \
    vice labels detect my_run --chessboard 6x7 --fps 10 --out board.json\n  \
    vice evaluate my_run --labels tags.json --estimate odometry.txt --reference none --depth tag --tag-size 0.088\n\n\
    Points are called tag12.c0 (top left corner of the printed tag, then clockwise) and board.r0c0 (row and column of\n\
    the inner corner). What a human labelled is never changed.")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    targets: TargetArgs,
    #[command(flatten)]
    frames: FrameArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// What to look for.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Targets")]
struct TargetArgs {
    /// AprilTags of this family: 36h11, 25h9 or 16h5.
    #[arg(long, value_name = "FAMILY", required_unless_present = "chessboard")]
    apriltag: Option<TagFamily>,
    /// Cells that the tags' dark border is wide; Kalibr's AprilGrid has 2 [default: either].
    #[arg(long, value_name = "1|2", value_parser = clap::value_parser!(u8).range(1..=2), requires = "apriltag")]
    border_bits: Option<u8>,
    /// A chessboard by its inner corners: one of 7 by 8 squares is 6x7.
    #[arg(long, value_name = "COLUMNSxROWS")]
    chessboard: Option<BoardSize>,
    /// Calibration that overrides the data set's: TOML, or a Kalibr camchain.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
}

/// Where to look.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Frames")]
struct FrameArgs {
    /// Look at the frame nearest to each tick of this rate [default: all frames].
    #[arg(long, value_name = "HZ", value_parser = positive)]
    fps: Option<f64>,
    /// Seconds after the camera's first frame.
    #[arg(long, value_name = "S", default_value = "0", allow_hyphen_values = true, value_parser = span_not_negative)]
    start: Span,
    /// Seconds from there [default: to the end].
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = span_not_negative)]
    duration: Option<Span>,
    /// A point unseen for longer starts anew, seconds.
    #[arg(long, value_name = "S", default_value = "3", allow_hyphen_values = true, value_parser = span_not_negative)]
    respawn_after: Span,
}

/// Where the labels go.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Output")]
struct OutputArgs {
    /// Labels file to write, .csv or .json.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Add to the labels that the file holds already; what is in it stays as it is.
    #[arg(long)]
    add: bool,
    /// Keep the N points that cover image and time best.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    select: Option<u32>,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let out = &args.output.out;
    // Before the work, so that a wrong name costs nothing.
    LabelFormat::for_writing(out)?;
    Outputs::new(&[&Some(out.clone())], std::slice::from_ref(&args.dataset.path))?;
    let before = match (out.exists(), args.output.add) {
        (true, false) => {
            return Err(usage(format!(
                "{} exists already (--add adds to it; or name another file)",
                out.display()
            )));
        }
        (exists, _) => exists,
    };
    let calibration = args.targets.calibration.as_ref().map(CalibrationFile::read).transpose()?;
    let dataset = args.dataset.open()?;
    let used = args.dataset.used_camera(dataset.as_ref(), calibration.as_ref())?;
    let there = before.then(|| labels::read(out, Some(&used.frames))).transpose()?;
    if let Some(other) = there.as_ref().and_then(|l| l.camera.as_ref()).filter(|c| **c != used.name) {
        return Err(usage(format!("{} holds labels of camera {other}, not {}", out.display(), used.name)));
    }
    let window = Window {
        fps: args.frames.fps,
        start: args.frames.start,
        duration: args.frames.duration,
        ..Window::default()
    };
    let frames = window.frames(&used.frames);
    if frames.is_empty() {
        anyhow::bail!("no frame lies in the part of the run that was asked for (see --start, --duration)");
    }
    let options = DetectOptions {
        tags: args
            .targets
            .apriltag
            .map(|family| TagOptions { family, border: args.targets.border_bits.map(usize::from) }),
        board: args.targets.chessboard,
        max_gap: args.frames.respawn_after,
        select: args.output.select.map(|n| n as usize),
        ..DetectOptions::default()
    };
    let bar = verbosity.progress("looking");
    let found =
        detect_labels(dataset.as_ref(), &used.name, &used.camera, &frames, &options, &|done, total| {
            advance(&bar, done, total);
            ControlFlow::Continue(())
        })?;
    bar.finish_and_clear();
    warn(&found.report);
    if found.labels.points().is_empty() {
        anyhow::bail!("{}: {}", args.dataset.path.display(), nothing_found(&options, &found.report));
    }
    let labels = match there {
        Some(there) => added(there, &found.labels)?,
        None => found.labels.clone(),
    };
    let overwrite = if args.output.add { Overwrite::Replace } else { Overwrite::Refuse };
    labels::write(out, &labels, overwrite)?;
    terminal::print(&summary(args, &found.labels, &found.report))?;
    Ok(Outcome::Done)
}

/// All labels that are there, and the new ones of points and frames that have none.
fn added(there: LabelSet, new: &LabelSet) -> anyhow::Result<LabelSet> {
    let more = additions(&there, new);
    let rows = there
        .points()
        .iter()
        .flat_map(|p| p.observations.iter().map(|o| LabelRow { point: p.name.clone(), observation: *o }));
    let mut labels = LabelSet::from_rows(rows.chain(more))?;
    labels.dataset = there.dataset.or_else(|| new.dataset.clone());
    labels.camera = there.camera.or_else(|| new.camera.clone());
    Ok(labels)
}

fn warn(report: &DetectReport) {
    if let Some((stamp, reason)) = report.undecoded.first() {
        let count = report.undecoded.len();
        tracing::warn!(
            "{count} frames could not be decoded and were skipped, the first at {stamp} ns: {reason}"
        );
    }
    if report.twice > 0 {
        tracing::warn!("{} tags were left out: a frame holds two of the same number", report.twice);
    }
}

/// Why there are no labels, and what to ask for instead.
fn nothing_found(options: &DetectOptions, report: &DetectReport) -> String {
    let text = report.nothing_found(options);
    match report.other_board {
        Some((w, h, _)) => format!("{text}: --chessboard {w}x{h}?"),
        None => text,
    }
}

fn summary(args: &Args, labels: &LabelSet, report: &DetectReport) -> String {
    let mut text = format!("{} frames", report.frames);
    if args.targets.apriltag.is_some() {
        text += &format!(", {} with tags ({} in all)", report.frames_with_tags, report.tags);
    }
    if args.targets.chessboard.is_some() {
        text += &format!(", {} with the chessboard", report.frames_with_board);
    }
    text + &format!(
        "\n{} points, {} observations in {} segments: {}\n",
        labels.points().len(),
        labels.observation_count(),
        report.segments,
        printable(&args.output.out.display().to_string())
    )
}
