//! `vice diagnose`: which flaw explains the pixel errors, and the calibration without it.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::Context;
use vice_core::diagnose::{
    Diagnosed, Diagnosis, DiagnosisDocument, Flaw, OdometryNoise, Options, Theta, VerdictKind, diagnose,
};
use vice_core::evaluate::Evaluation;
use vice_core::metrics::align::Alignment;
use vice_core::result::Role;
use vice_core::time::Span;
use vice_files::atomic::Overwrite;
use vice_files::calibration::{CalibrationFile, CameraOverride};

use crate::inputs::{EvaluationArgs, LoadedStreams, Outputs, Scoring, to_json};
use crate::report::table;
use crate::terminal::{self, Outcome, Verbosity, advance, printable, usage};

/// Arguments of `vice diagnose`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice diagnose V1_01_easy --labels floor.csv --estimate openvins.txt\n  \
    vice diagnose my_run --labels labels.json --estimate odom --depth zcam --apply corrected.toml\n  \
    vice evaluate my_run --labels labels.json --estimate odom --depth zcam --calibration corrected.toml\n\n\
    Every value is the error of what is in use: a clock offset of +50 ms means that the estimate's stamps, with\n\
    --time-offset added, are 50 ms too late, and is corrected by a --time-offset that is 50 ms less.")]
pub(crate) struct Args {
    #[command(flatten)]
    pub(crate) evaluation: EvaluationArgs,
    #[command(flatten)]
    pub(crate) looking: LookingArgs,
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
    /// How much the odometry may wander and still be healthy, a root second: 5mm,0.06deg, or wheel, vio, mocap.
    #[arg(long, value_name = "NOISE", default_value = "vio")]
    odometry_noise: OdometryNoise,
    /// No longer means anything: intervals come from the noise of labels and poses, not from resampling.
    #[arg(long, value_name = "N", hide = true, value_parser = clap::value_parser!(u32).range(100..=100_000))]
    resamples: Option<u32>,
}

impl LookingArgs {
    pub(crate) fn flaws(&self) -> Vec<Flaw> {
        if self.flaws.is_empty() { Flaw::ALL.to_vec() } else { self.flaws.clone() }
    }

    pub(crate) fn options(&self) -> Options {
        if self.resamples.is_some() {
            tracing::warn!("--resamples does nothing any more: nothing is resampled");
        }
        Options { odometry_noise: self.odometry_noise }
    }
}

/// Nothing but the scored labels matters to a diagnosis.
pub(crate) fn scoring() -> Scoring {
    Scoring { subsets: vec![], align: Alignment::Se3, keep_samples: false }
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let outputs = Outputs::new(&[&args.json, &args.apply], &args.evaluation.files())?;
    if let Some(apply) = args.apply.as_ref().filter(|a| a.extension().is_none_or(|e| e != "toml")) {
        return Err(usage(format!("--apply {}: name a file that ends in .toml", apply.display())));
    }
    args.evaluation.with_evaluation(&scoring(), |evaluation, streams| {
        let all = diagnose_all(evaluation, streams, &args.looking, verbosity);
        if let ([_, _, ..], true) = (all.as_slice(), args.json.is_some() || args.apply.is_some()) {
            return Err(usage("--json and --apply take one --estimate and one --depth"));
        }
        let (diagnosed, failed): (Vec<_>, Vec<_>) = all.into_iter().partition(Result::is_ok);
        let diagnosed: Vec<Diagnosed> = diagnosed.into_iter().flatten().collect();
        let mut failed: Vec<anyhow::Error> = failed.into_iter().filter_map(Result::err).collect();
        let mut texts = Vec::new();
        if let (Some(path), Some(one)) = (&args.json, diagnosed.first()) {
            texts.push((path, to_json(&one.document)?));
        }
        // What was found is never lost for what fails after it.
        if (!diagnosed.is_empty() || failed.is_empty()) && !outputs.write(&texts)? {
            let text: Vec<String> = diagnosed.iter().map(|d| render(&d.document)).collect();
            terminal::print(&text.join("\n"))?;
        }
        if !failed.is_empty() {
            let first = failed.remove(0);
            return Err(failed.into_iter().fold(first, |all, next| anyhow::anyhow!("{all:#}; {next:#}")));
        }
        if let (Some(path), Some(one)) = (&args.apply, diagnosed.first()) {
            corrected(evaluation, streams, one)?.write(path, Overwrite::Replace)?;
            verbosity.note(&format!("the correction is in {}: use it with --calibration", path.display()));
        }
        Ok(Outcome::Done)
    })
}

/// Each estimate with each depth source, one that fails beside the others.
fn diagnose_all(
    evaluation: &Evaluation<'_>,
    streams: &LoadedStreams,
    looking: &LookingArgs,
    verbosity: Verbosity,
) -> Vec<anyhow::Result<Diagnosed>> {
    let flaws = looking.flaws();
    let mut all = Vec::new();
    for (stream, _) in evaluation.streams.iter().enumerate().filter(|(_, s)| s.role == Role::Estimate) {
        for depth in 0..evaluation.depths.len() {
            let inertial = streams.inertial_run(stream);
            let diagnosis =
                Diagnosis { evaluation, stream, depth, inertial, flaws: &flaws, options: looking.options() };
            let bar = verbosity.progress("fitting");
            let diagnosed = diagnose(&diagnosis, &|done, total| {
                advance(&bar, done, total);
            });
            bar.finish_and_clear();
            let names =
                || format!("{} with {}", evaluation.streams[stream].name, evaluation.depths[depth].name());
            all.push(diagnosed.with_context(names));
        }
    }
    all
}

/// The calibration in use without the named flaws.
fn corrected(
    evaluation: &Evaluation<'_>,
    streams: &LoadedStreams,
    diagnosed: &Diagnosed,
) -> anyhow::Result<CalibrationFile> {
    let (theta, verdict) = (&diagnosed.theta, &diagnosed.document.verdict);
    anyhow::ensure!(
        verdict.kind == VerdictKind::Named,
        "--apply: nothing to apply, and nothing is written: {}",
        verdict.sentence
    );
    let in_a_calibration = [
        Flaw::ClockOffset,
        Flaw::ExtrinsicRotation,
        Flaw::ExtrinsicTranslation,
        Flaw::FocalLength,
        Flaw::PrincipalPoint,
        Flaw::Distortion,
        Flaw::Aspect,
    ];
    if let Some(flaw) =
        verdict.flaws.iter().find(|f| in_a_calibration.iter().all(|of| of.name() != f.as_str()))
    {
        anyhow::bail!(
            "--apply: {flaw} is a flaw of the estimate, which no calibration can correct: nothing is written"
        );
    }
    let mut file = CalibrationFile::new();
    let offset_s = streams.time_offset.as_secs_f64() - theta.of(Flaw::ClockOffset)[0];
    file.time_offset = Some(Span::from_secs_f64(offset_s)?);
    let camera = theta.correct_camera(evaluation.camera)?;
    let body_from_camera = corrected_extrinsics(evaluation, theta)?;
    file.insert(evaluation.camera_name, CameraOverride::of(&camera, body_from_camera));
    Ok(file)
}

/// Extrinsics to write: none where they are right, since those of the data set may change with time.
fn corrected_extrinsics(
    evaluation: &Evaluation<'_>,
    theta: &Theta,
) -> anyhow::Result<Option<vice_core::frames::BodyFromCamera>> {
    let wrong = [Flaw::ExtrinsicRotation, Flaw::ExtrinsicTranslation]
        .iter()
        .any(|flaw| theta.of(*flaw).iter().any(|v| *v != 0.0));
    if let Some(fixed) = evaluation.body_from_camera {
        return Ok(Some(theta.correct_extrinsics(&fixed)));
    }
    if !wrong {
        return Ok(None);
    }
    let at =
        |stamp: &vice_core::time::Stamp| evaluation.dataset.body_from_camera(evaluation.camera_name, *stamp);
    let (Some(first), Some(last)) = (evaluation.frames.first(), evaluation.frames.last()) else {
        anyhow::bail!("the camera has no frames");
    };
    let fixed = at(first)?;
    anyhow::ensure!(
        fixed == at(last)?,
        "--apply: the camera moves against the body, so that no calibration file can hold its place: nothing is written"
    );
    Ok(Some(theta.correct_extrinsics(&fixed)))
}

/// The diagnosis as text.
pub(crate) fn render(document: &DiagnosisDocument) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_text(&mut text, document);
    text
}

fn write_text(text: &mut String, document: &DiagnosisDocument) -> std::fmt::Result {
    let (labels, verdict) = (&document.labels, &document.verdict);
    writeln!(
        text,
        "{}, {} with {}: {:.3} px over {} labels of {} points ({} {}, {:.1} s)\n",
        printable(&document.dataset),
        printable(&document.stream),
        printable(&document.depth),
        document.rmse_px,
        labels.scored,
        labels.points,
        labels.blocks,
        labels.blocks_of,
        labels.seconds,
    )?;
    let mut grid = vec![
        ["flaw, fitted alone [95 %]", "leaves px", "explains", "likelier", "labels show"]
            .map(String::from)
            .to_vec(),
    ];
    for flaw in &document.flaws {
        let shown = match flaw.rank {
            0 => "nothing of it".to_string(),
            rank if rank == flaw.of => "it".to_string(),
            rank => format!("{rank} of {} directions", flaw.of),
        };
        grid.push(vec![
            flaw.text.clone(),
            format!("{:.3}", flaw.rmse_px),
            format!("{:.0} %", flaw.explained_percent),
            format!("{:+.0}", flaw.likelier),
            shown,
        ]);
    }
    text.push_str(&table::align(&grid));
    writeln!(text, "\nverdict: {}", verdict.sentence)?;
    match verdict.kind {
        VerdictKind::Named => {
            let [low, high] = [100.0 * verdict.sureness, 100.0].map(|v: f64| v.min(99.9));
            writeln!(text, "sureness: {low:.1} %{}", if low < high { "" } else { " or more" })?;
            for correction in &verdict.corrections {
                writeln!(text, "correction: {correction}")?;
            }
        }
        VerdictKind::CannotTell => writeln!(text, "sureness: {:.1} %", 100.0 * verdict.sureness)?,
        _ => {}
    }
    for help in &verdict.labels_that_help {
        writeln!(text, "labels that would help: {help}")?;
    }
    Ok(())
}
