//! `vice evaluate`: the main job.

use std::path::{Path, PathBuf};

use vice_core::dataset::Dataset;
use vice_core::evaluate::SampleSink;
use vice_core::metrics::align::Alignment;
use vice_core::result::ResultDocument;

use super::report::with_progress;
use crate::inputs::{EvaluationArgs, Outputs, Scoring};
use crate::report::html::{IMAGE_BUDGET_BYTES, Run, render};
use crate::report::{self, sample_lines};
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
    evaluation: EvaluationArgs,
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
    /// Exit with 3 if more labels than this could not be scored, percent. What an estimate carries behind the camera is warned of instead.
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
    /// A page with the table, plots and images.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// A recording for the Rerun viewer; in builds with the feature rerun.
    #[arg(long, value_name = "FILE.rrd")]
    rrd: Option<PathBuf>,
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
    let samples = samples_file(args)?;
    let files = &args.output;
    let outputs = Outputs::new(
        &[&files.json, &files.csv, &files.latex, &files.report, &files.rrd, &samples],
        &args.evaluation.files(),
    )?;
    if args.output.rrd.is_some() && !cfg!(feature = "rerun") {
        return Err(usage("--rrd: this vice was built without Rerun; build it with `--features rerun`"));
    }
    let shown = args.output.report.is_some() || args.output.rrd.is_some();
    let scoring = Scoring {
        subsets: args.scoring.subsets.iter().map(|n| usize::from(*n)).collect(),
        align: args.scoring.align,
        // The page plots samples even where the document is to list none.
        keep_samples: shown || (args.output.samples == Samples::All && args.output.json.is_some()),
    };
    let (mut document, dataset) = match &samples {
        Some(path) => sample_lines::write(path, |sink| {
            args.evaluation.evaluate(&scoring, verbosity, Some(sink as &mut SampleSink<'_>))
        })?,
        None => args.evaluation.evaluate(&scoring, verbosity, None)?,
    };
    let page = match &args.output.report {
        Some(path) => {
            let shots = with_progress(&document, dataset.as_ref(), IMAGE_BUDGET_BYTES, verbosity);
            let run = Run::new(document.clone(), shots);
            Some((path, render(&[run])?))
        }
        None => None,
    };
    if let Some(path) = &args.output.rrd {
        record(path, &document, dataset.as_ref())?;
    }
    if args.output.samples == Samples::None {
        document.drop_samples();
    }
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
    let texts: Vec<(&PathBuf, String)> = [csv, latex, page].into_iter().flatten().collect();
    let json_printed =
        args.output.json.as_ref().map_or(Ok(false), |path| outputs.write_json(path, &document))?;
    if !(outputs.write(&texts)? || json_printed) {
        terminal::print(&report::table::render(&document))?;
    }
    for part in &document.pixel {
        let away = part.carried_away_percent();
        if away > args.scoring.max_skipped {
            tracing::warn!(
                "{} ({} depth) carries {away:.1} % of the labels' points behind the camera or beyond its model: RMSE_2D is of the rest",
                part.stream,
                part.depth
            );
        }
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
    if args.output.samples != Samples::Jsonl {
        return Ok(None);
    }
    if args.output.report.is_some() || args.output.rrd.is_some() {
        return Err(usage(
            "--samples jsonl keeps no samples that --report and --rrd could show; leave it out",
        ));
    }
    match &args.output.json {
        Some(json) if json.as_os_str() != "-" => Ok(Some(json.with_extension("samples.jsonl"))),
        _ => Err(usage("--samples jsonl writes beside the JSON: name a file with --json")),
    }
}

#[cfg(feature = "rerun")]
fn record(path: &Path, document: &ResultDocument, dataset: &dyn Dataset) -> anyhow::Result<()> {
    report::rerun_log::write(path, document, dataset)
}

/// Refused before the work already.
#[cfg(not(feature = "rerun"))]
fn record(_: &Path, _: &ResultDocument, _: &dyn Dataset) -> anyhow::Result<()> {
    Ok(())
}
