//! `vice evaluate`: the main job.

use std::path::PathBuf;

use vice_run::Samples;
use vice_run::core::evaluate::SampleSink;
use vice_run::core::metrics::align::Alignment;
use vice_run::report::html::{IMAGE_BUDGET_BYTES, render};
use vice_run::report::{self, sample_lines};
use vice_run::request::Scoring;
use vice_run::require::{Requirement, broken};
use vice_run::result::{MAX_SKIPPED_PERCENT, ResultDocument};

use super::evaluate_rig::{self, Files};
use super::report::{PageArgs, run_of, warn_of_pictures};
use crate::inputs::{EvaluationArgs, on_off};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, Verbosity, usage, with_progress};

/// Arguments of `vice evaluate`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice evaluate V1_01_easy --labels floor.csv --estimate imu-euler,openvins.txt --depth floor,zmap\n  \
    vice evaluate my_run --labels labels.json --estimate rel:odometry.txt --reference none --depth zcam --json out.json\n  \
    vice evaluate my_run --labels auto --estimate odom --depth zcam   (labels without a hand)\n  \
    vice evaluate my_run --camera cam0,cam1 --labels labels_{camera}.csv --estimate odom   (each camera, and together)\n  \
    vice evaluate --request out.json   (evaluates again what out.json is the result of)\n\n\
    For several values repeat the option or separate them with commas. Estimates are names of the data set's streams, `imu-euler` (Euler \
    integration of its IMU from the reference state at the first key frame), or files: TUM, EuRoC CSV, KITTI with a \
    times file, and relative motions as rel:FILE.\n\n\
    Exit code: 0 done, 1 failed, 2 wrong usage, 3 too many labels not scored, 4 a limit of --require is broken.")]
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
    /// Average RMSE_2D over all subsets of this many points [default: 1, 2 and 3].
    #[arg(long, value_name = "N,...", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..), conflicts_with = "request")]
    subsets: Vec<u16>,
    /// Alignment of the trajectory errors: none, first-pose, yaw, se3, sim3 [default: se3, and first-pose for imu-euler,
    /// which starts in the reference's own state].
    #[arg(long, value_name = "HOW", conflicts_with = "request")]
    align: Option<Alignment>,
    /// Compare depths at key frames with the recording's depth camera or scan, if --depth does not name these
    /// [default: on].
    #[arg(long, value_name = "on|off", action = clap::ArgAction::Set, value_parser = on_off, conflicts_with = "request")]
    depth_check: Option<bool>,
    /// Exit with 3 if more than this share of labels could not be scored, percent. Points that an estimate carries behind the camera only give a warning.
    #[arg(long, value_name = "PERCENT", default_value_t = MAX_SKIPPED_PERCENT, value_parser = percent)]
    max_skipped: f64,
    /// Exit with 4 unless every estimate keeps these limits, such as 'rmse_2d<2px', 'age5s<3px' (five seconds since the key
    /// frame) or 'moved1m<40mm'; px, mrad or mm. The upper end of the 95 % interval has to be below, with rmse_2d.low and so
    /// on the lower end. A number that is missing breaks its limit.
    #[arg(long, value_name = "LIMIT,...", value_delimiter = ',')]
    require: Vec<Requirement>,
}

/// What is written beside the table.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Output")]
struct OutputArgs {
    /// Where the scored samples go: into the JSON, nowhere, or one a line into a file beside it (FILE.samples.jsonl).
    #[arg(long, value_enum, value_name = "HOW", default_value = "all")]
    samples: SamplesTo,
    /// Result document, vice.result/2; - prints it in place of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// The table as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// The table as LaTeX.
    #[arg(long, value_name = "FILE")]
    latex: Option<PathBuf>,
    /// A page that says whether each estimate can be trusted, with the table, plots and images.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    #[command(flatten)]
    page: PageArgs,
}

/// What becomes of the scored samples, of which a long run has millions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum SamplesTo {
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
    if files.report.is_none() {
        files.page.refuse_without_a_page()?;
    }
    let subsets = args.scoring.subsets.iter().map(|n| usize::from(*n)).collect();
    let mut request = args.evaluation.request(Scoring { subsets, align: args.scoring.align })?;
    request.depth.compare = args.scoring.depth_check.or(request.depth.compare);
    if let Some(each) = request.of_each_camera()? {
        if samples.is_some() {
            return Err(usage("--samples jsonl is of one camera, and several are asked"));
        }
        let OutputArgs { json, csv, latex, report, page, .. } = files;
        let files = Files { json, csv, latex, report, page, samples: files.samples != SamplesTo::None };
        let document = evaluate_rig::run(&request, each, &files, verbosity)?;
        return Ok(judged(&document.cameras, args, verbosity));
    }
    let outputs =
        Outputs::new(&[&files.json, &files.csv, &files.latex, &files.report, &samples], &request.inputs())?;
    let opened = request.open()?;
    let request = args.evaluation.completed(request, &opened)?;
    // The page plots samples even where the document is to list none.
    let keep = files.report.is_some() || (files.samples == SamplesTo::All && files.json.is_some());
    let mut document = with_progress(verbosity, |progress| match &samples {
        Some(path) => sample_lines::write(path, |sink| {
            request.evaluate(&opened, Samples::Stream(sink as &mut SampleSink<'_>), progress)
        }),
        None if keep => request.evaluate(&opened, Samples::Keep, progress),
        None => request.evaluate(&opened, Samples::Drop, progress),
    })?;
    let page = match &files.report {
        Some(path) => {
            let run = run_of(document.clone(), &request, &opened, IMAGE_BUDGET_BYTES, &files.page, verbosity);
            warn_of_pictures(&run, path);
            Some((path, render(&[run])?))
        }
        None => None,
    };
    if files.samples == SamplesTo::None {
        document.drop_samples();
    }
    // All texts are made before the first is written, so that a failure leaves nothing half done. The JSON may be too
    // large to be one.
    let csv = files.csv.as_ref().map(|path| report::csv::render(&document).map(|t| (path, t))).transpose()?;
    let latex =
        files.latex.as_ref().map(|path| report::latex::render(&document).map(|t| (path, t))).transpose()?;
    let texts: Vec<(&PathBuf, String)> = [csv, latex, page].into_iter().flatten().collect();
    let json_printed = files.json.as_ref().map_or(Ok(false), |path| outputs.write_json(path, &document))?;
    let in_a_file = files.json.is_some() && verbosity.is_quiet();
    if !(outputs.write(&texts)? || json_printed || in_a_file) {
        terminal::print(&report::table::render(&document))?;
    } else {
        // The table has them in it.
        terminal::warn(document.suspicions.iter());
    }
    Ok(judged(std::slice::from_ref(&document), args, verbosity))
}

/// Whether enough was scored, and the limits are kept, in the results of all cameras.
fn judged(documents: &[ResultDocument], args: &Args, verbosity: Verbosity) -> Outcome {
    let (mut skips, mut limits) = (Outcome::Done, Outcome::Done);
    for document in documents {
        if matches!(judge_skips(document, args.scoring.max_skipped, verbosity), Outcome::TooManySkips) {
            skips = Outcome::TooManySkips;
        }
        for line in broken(&args.scoring.require, &document.pixel) {
            tracing::error!("{line}");
            limits = Outcome::RequirementBroken;
        }
    }
    if matches!(limits, Outcome::RequirementBroken) { limits } else { skips }
}

/// Whether enough was scored.
fn judge_skips(document: &ResultDocument, max_skipped: f64, verbosity: Verbosity) -> Outcome {
    for part in &document.pixel {
        let away = part.carried_away_percent();
        if away > max_skipped {
            tracing::warn!(
                "{} ({} depth) carries {away:.1} % of the labels' points behind the camera or beyond its model: RMSE_2D is of the rest",
                part.stream,
                part.depth
            );
        }
    }
    let worst = document.worst_skipped_percent();
    if worst <= max_skipped {
        return Outcome::Done;
    }
    verbosity.note(&format!(
        "{worst:.1} % of the labels of a stream could not be scored, more than --max-skipped {max_skipped} allows"
    ));
    Outcome::TooManySkips
}

/// The file of samples beside the JSON, where it is asked for.
fn samples_file(args: &Args) -> anyhow::Result<Option<PathBuf>> {
    if args.output.samples != SamplesTo::Jsonl {
        return Ok(None);
    }
    if args.output.report.is_some() {
        return Err(usage("--samples jsonl keeps no samples that --report could show; leave it out"));
    }
    match &args.output.json {
        Some(json) if json.as_os_str() != "-" => Ok(Some(json.with_extension("samples.jsonl"))),
        _ => Err(usage("--samples jsonl writes beside the JSON: name a file with --json")),
    }
}
