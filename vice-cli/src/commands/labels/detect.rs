//! `vice labels detect`: calibration targets as labels.

use std::path::PathBuf;

use vice_run::core::label::LabelSet;
use vice_run::core::time::Span;
use vice_run::detect::{BoardSize, DetectOptions, DetectReport, TagFamily, TagOptions};
use vice_run::detecting::detect_to_file;
use vice_run::files::labels::LabelFormat;
use vice_run::request::DatasetSpec;

use crate::inputs::{DatasetArgs, WindowArgs, span_not_negative};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, Verbosity, printable, with_progress};

/// Arguments of `vice labels detect`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice labels detect V1_01_easy --apriltag 36h11 --out tags.json\n  \
    vice labels detect my_run --chessboard 6x7 --fps 10 --out board.json\n  \
    vice evaluate my_run --labels tags.json --estimate odometry.txt --reference none --depth tag --tag-size 0.088\n\n\
    Points are called tag12.c0 (top left corner of the printed tag, then clockwise) and board.r0c0 (row and column of \
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
    #[command(flatten)]
    window: WindowArgs,
    /// A point unseen for longer starts anew, seconds.
    #[arg(long, value_name = "S", default_value = "3", allow_hyphen_values = true, value_parser = span_not_negative)]
    respawn_after: Span,
}

/// Where the labels go.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Output")]
struct OutputArgs {
    /// Labels file to write, .csv, .json or .parquet.
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
    let dataset = DatasetSpec { calibration: args.targets.calibration.clone(), ..args.dataset.spec() };
    Outputs::new(&[&Some(out.clone())], std::slice::from_ref(&dataset.path))?;
    let opened = dataset.open()?;
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
    let protocol = args.frames.window.spec();
    let found = with_progress(verbosity, |progress| {
        detect_to_file(&opened, &protocol, &options, (out, args.output.add), progress)
    })?;
    terminal::print(&summary(args, &found.labels, &found.report))?;
    Ok(Outcome::Done)
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
