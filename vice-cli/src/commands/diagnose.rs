//! `vice diagnose`: which flaw explains the pixel errors, and the calibration without it.

use std::path::PathBuf;

use vice_run::core::diagnose::{Flaw, OdometryNoise};
use vice_run::diagnosis::{Looking, diagnose_all};
use vice_run::files::atomic::Overwrite;
use vice_run::report::diagnosis_text::{labels_line, render};
use vice_run::request::Scoring;

use crate::inputs::{EvaluationArgs, to_json};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, Verbosity, usage, with_progress};

/// Arguments of `vice diagnose`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice diagnose V1_01_easy --labels floor.csv --estimate openvins.txt\n  \
    vice diagnose my_run --labels labels.json --estimate odom --depth zcam --apply corrected.toml\n  \
    vice evaluate my_run --labels labels.json --estimate odom --depth zcam --calibration corrected.toml\n\n\
    Each value is the error of what you use now: a clock offset of +50 ms means that the estimate's stamps, with \
    --time-offset added, are 50 ms too late, and is corrected by a --time-offset that is 50 ms less.")]
pub(crate) struct Args {
    #[command(flatten)]
    evaluation: EvaluationArgs,
    #[command(flatten)]
    looking: LookingArgs,
    /// Diagnosis document, vice.diagnosis/1; - prints it in place of the text.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    json: Option<PathBuf>,
    /// Write the calibration and clock offset without the named flaws, as --calibration takes them.
    #[arg(long, value_name = "FILE.toml", help_heading = "Output")]
    apply: Option<PathBuf>,
}

/// What is looked for, and how.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Diagnosis")]
pub(crate) struct LookingArgs {
    /// Look for these flaws only: clock-offset, extrinsic-rotation, extrinsic-translation, focal-length,
    /// principal-point, initial-tilt (of imu-euler), scale, drift, distortion, aspect, clock-rate, clock-step,
    /// rolling-shutter.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    flaws: Vec<Flaw>,
    /// How much a healthy odometry drifts at random, per root second: 5mm,0.06deg, or wheel, vio, mocap.
    #[arg(long, value_name = "NOISE", default_value = "vio")]
    odometry_noise: OdometryNoise,
    /// No longer means anything: intervals come from the noise of labels and poses, not from resampling.
    #[arg(long, value_name = "N", hide = true, value_parser = clap::value_parser!(u32).range(100..=100_000))]
    resamples: Option<u32>,
}

impl LookingArgs {
    pub(crate) fn spec(&self) -> Looking {
        if self.resamples.is_some() {
            tracing::warn!("--resamples does nothing any more: nothing is resampled");
        }
        Looking { flaws: self.flaws.clone(), odometry_noise: self.odometry_noise }
    }
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let request = args.evaluation.request(Scoring::default())?;
    let outputs = Outputs::new(&[&args.json, &args.apply], &request.inputs())?;
    if let Some(apply) = args.apply.as_ref().filter(|a| a.extension().is_none_or(|e| e != "toml")) {
        return Err(usage(format!("--apply {}: name a file that ends in .toml", apply.display())));
    }
    let opened = request.open()?;
    let request = args.evaluation.completed(request, &opened)?;
    let looking = args.looking.spec();
    let answers = with_progress(verbosity, |progress| diagnose_all(&request, &opened, &looking, progress))?;
    terminal::warn(answers.suspicions.iter());
    let answers = answers.list;
    if answers.len() > 1 && (args.json.is_some() || args.apply.is_some()) {
        return Err(usage("--json and --apply take one --estimate and one --depth"));
    }
    let mut failure: Option<anyhow::Error> = None;
    let (mut texts, mut printed) = (Vec::new(), Vec::new());
    for answer in answers {
        match answer.outcome {
            Ok((result, calibration)) => {
                if let Some(path) = &args.json {
                    texts.push((path, to_json(&result)?));
                }
                printed.push(labels_line(&request, result.tracking.as_ref()) + &render(&result.diagnosis));
                match (&args.apply, calibration) {
                    (Some(path), Ok(file)) => {
                        file.write(path, Overwrite::Replace)?;
                        verbosity.note(&format!(
                            "the correction is in {}: use it with --calibration",
                            path.display()
                        ));
                    }
                    (Some(_), Err(error)) => failure = Some(error.into()),
                    (None, _) => {}
                }
            }
            // The others keep their answers.
            Err(error) => {
                if let Some(before) = failure.replace(error.into()) {
                    terminal::print_error(&before);
                }
            }
        }
    }
    if !outputs.write(&texts)? && !printed.is_empty() {
        terminal::print(&printed.join("\n"))?;
    }
    failure.map_or(Ok(Outcome::Done), Err)
}
