//! From pixels to their cause: which flaw of an estimate or a calibration explains the errors.
//!
//! 1. [`Theta`] holds all flaws as numbers; the residuals of RMSE_2D are a function of it, by the evaluation's stages.
//! 2. Each [`Flaw`] is fitted alone: robust least squares, depth asked again where it depends on the flaw.
//! 3. Intervals come from resampling points and blocks of time; [`FlawPart::rank`] says what the labels can show.
//! 4. Fits are compared on labels they have not seen. The flaw that does best is named if it beats no flaw and every
//!    other flaw; further ones are added while they take away enough of what is left.
//!
//! No ground truth is needed: the labels are the truth. Where the estimate itself places the camera for depth, its
//! flaws move the depth as well, and that is fitted too.

mod blocks;
mod bootstrap;
mod document;
mod flaw;
mod motion;
mod noise;
mod observability;
mod problem;
mod rough;
mod sensitivity;
mod solve;
mod theta;
mod unseen;
mod verdict;
mod words;

pub use document::{
    DiagnosisDocument, Estimated, FlawPart, LabelsPart, Overlap, SCHEMA, Verdict, VerdictKind,
};
pub use flaw::{Flaw, PARAMETER_COUNT, PARAMETERS, ParameterInfo};
pub use motion::InertialRun;
pub use sensitivity::{Curve, CurvePoint, SENSITIVITY_SCHEMA, SensitivityDocument, sensitivity};
pub use theta::Theta;

use blocks::Blocks;
use bootstrap::Resampled;
use noise::Noise;
use observability::{Observability, overlap};
use problem::{Problem, rmse_px};
use solve::Fit;
use unseen::Ruler;
use verdict::{Found, Judge, singles};

use crate::evaluate::{EvaluateError, Evaluation};

/// Fewer scored labels than these say nothing about a cause.
const FEWEST_LABELS: usize = 8;
/// Fewer blocks of time than these leave nothing to compare on.
const FEWEST_BLOCKS: usize = 3;
/// An overlap that is worth a word.
const LARGE_OVERLAP: f64 = 0.5;

/// Why nothing could be diagnosed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DiagnoseError {
    /// Too little to fit to.
    #[error(
        "too few labels to fit a cause to: {scored} scored labels of {points} points at {blocks} instants; at least {FEWEST_LABELS} labels at {FEWEST_BLOCKS} instants after a key frame are needed"
    )]
    TooFewLabels {
        /// Scored labels.
        scored: usize,
        /// Points with one.
        points: usize,
        /// Blocks of time.
        blocks: usize,
    },
    /// No flaw is left to look for.
    #[error("no flaw is left to look for: an initial tilt is only fitted to an inertial estimate")]
    NoFlaws,
    /// A trial value cannot be evaluated.
    #[error("a trial value cannot be evaluated: {0}")]
    CannotEvaluate(String),
    /// The residuals could not be made.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
}

/// How it is diagnosed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Resamples of points and blocks for intervals and comparisons.
    pub resamples: usize,
    /// Seed of the resampling.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { resamples: 1000, seed: 1 }
    }
}

/// What is diagnosed: one stream of an evaluation with one of its depth sources.
#[derive(Clone, Copy)]
pub struct Diagnosis<'a> {
    /// The evaluation that the stream belongs to.
    pub evaluation: &'a Evaluation<'a>,
    /// Index of the stream in it.
    pub stream: usize,
    /// Index of the depth source in it.
    pub depth: usize,
    /// How the stream was integrated, where it is an inertial estimate: the only one that has an initial tilt.
    pub inertial: Option<&'a InertialRun>,
    /// The flaws to look for.
    pub flaws: &'a [Flaw],
    /// How.
    pub options: Options,
}

/// A diagnosis and the numbers behind its verdict.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    /// The document.
    pub document: DiagnosisDocument,
    /// The named flaws; zero where none is.
    pub theta: Theta,
}

/// Runs a diagnosis. `progress` is called with (done, total) as flaws are fitted.
///
/// # Errors
/// [`DiagnoseError`] if there is too little to fit to or the stream cannot be evaluated.
pub fn diagnose(
    diagnosis: &Diagnosis<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Diagnosed, DiagnoseError> {
    let Diagnosis { evaluation, stream, depth, options, .. } = *diagnosis;
    let Alone { problem, blocks, labels, fits, noise, .. } = Alone::fit(diagnosis, progress)?;
    let judge =
        Judge { problem: &problem, blocks: &blocks, options, noise, ruler: Ruler::new(&noise, &blocks) };
    let found = judge.decide(&fits)?;
    let theta = found.named.fit.theta;
    let rmse = rmse_px(&problem.base);
    let part = |fit: &Fit, flaw: Flaw| flaw_part(&judge, fit, flaw, rmse);
    let time_offset_s = evaluation.streams[stream].time_offset.as_secs_f64();
    let fitted: Vec<FlawPart> =
        found.named.fit.flaws.iter().map(|flaw| part(&found.named.fit, *flaw)).collect();
    let document = DiagnosisDocument {
        schema: SCHEMA.to_string(),
        vice_version: env!("CARGO_PKG_VERSION").to_string(),
        dataset: evaluation.dataset.name().to_string(),
        format: evaluation.dataset.format().to_string(),
        camera: evaluation.camera_name.to_string(),
        stream: evaluation.streams[stream].name.clone(),
        depth: evaluation.depths[depth].name().to_string(),
        labels,
        rmse_px: rmse,
        label_noise_px: noise.label_px,
        wander_px_root_s: noise.wander_px,
        flaws: fits.iter().flat_map(|fit| fit.flaws.iter().map(|flaw| part(fit, *flaw))).collect(),
        overlaps: overlaps(&fits),
        verdict: verdict_of(&found, &fits, fitted, rmse, time_offset_s),
    };
    Ok(Diagnosed { document, theta })
}

/// What a diagnosis and a sensitivity begin with: each flaw fitted alone.
struct Alone<'a> {
    problem: Problem<'a>,
    blocks: Blocks,
    labels: LabelsPart,
    /// How many flaws were tried; those that cannot be evaluated have no fit.
    tried: usize,
    fits: Vec<Fit>,
    /// That of the fit that leaves least of it.
    noise: Noise,
}

impl<'a> Alone<'a> {
    /// `progress` is called with (done, total) as flaws are fitted.
    fn fit(diagnosis: &Diagnosis<'a>, progress: impl Fn(usize, usize)) -> Result<Self, DiagnoseError> {
        let Diagnosis { evaluation, stream, depth, inertial, .. } = *diagnosis;
        let flaws = flaws_of(diagnosis)?;
        let problem = Problem::new(evaluation, stream, depth, inertial)?;
        let blocks = Blocks::new(&problem.labels).with_pulls(&problem.rough_segments);
        let labels = labels_part(&problem, &blocks);
        check_labels(&labels)?;
        let mut done = 0;
        let fits = singles(&problem, &blocks, &flaws, || {
            done += 1;
            progress(done, flaws.len());
        })?;
        let noise = least_noise(&fits, &problem, &blocks);
        Ok(Self { problem, blocks, labels, tried: flaws.len(), fits, noise })
    }
}

/// The flaws to look for, in their own order.
fn flaws_of(diagnosis: &Diagnosis<'_>) -> Result<Vec<Flaw>, DiagnoseError> {
    let can_be =
        |f: &Flaw| diagnosis.flaws.contains(f) && (*f != Flaw::InitialTilt || diagnosis.inertial.is_some());
    let flaws: Vec<Flaw> = Flaw::ALL.into_iter().filter(can_be).collect();
    if flaws.is_empty() { Err(DiagnoseError::NoFlaws) } else { Ok(flaws) }
}

/// The noise of the fit that leaves least of it.
fn least_noise(fits: &[Fit], problem: &Problem<'_>, blocks: &Blocks) -> Noise {
    let nothing = Fit::of_nothing(problem, blocks).noise;
    let typical_s = blocks.typical_seconds();
    fits.iter().map(|fit| fit.noise).fold(nothing, |least, noise| {
        if noise.after_px(typical_s) < least.after_px(typical_s) { noise } else { least }
    })
}

fn labels_part(problem: &Problem<'_>, blocks: &Blocks) -> LabelsPart {
    LabelsPart {
        scored: problem.labels.len(),
        points: problem.point_count(),
        blocks: blocks.len(),
        blocks_of: if blocks.of_keyframes { "keyframes" } else { "frames" }.to_string(),
    }
}

fn check_labels(labels: &LabelsPart) -> Result<(), DiagnoseError> {
    let LabelsPart { scored, points, blocks, .. } = *labels;
    match scored < FEWEST_LABELS || blocks < FEWEST_BLOCKS {
        true => Err(DiagnoseError::TooFewLabels { scored, points, blocks }),
        false => Ok(()),
    }
}

/// What one flaw of a fit comes to.
fn flaw_part(judge: &Judge<'_>, fit: &Fit, flaw: Flaw, rmse_before_px: f64) -> FlawPart {
    let resampled = Resampled::new(fit, judge.blocks, judge.options.resamples, judge.options.seed);
    let first = fit.parameters.iter().position(|p| *p == flaw.parameters().start).unwrap_or(0);
    let estimated = |name: &str, value: f64, number: &dyn Fn(&[f64]) -> f64| {
        let [low, high] = resampled.interval(number);
        Estimated { name: name.to_string(), value, low, high }
    };
    let parameters: Vec<Estimated> = flaw
        .parameters()
        .enumerate()
        .map(|(i, p)| estimated(PARAMETERS[p].name, fit.theta[p], &|values| values[first + i]))
        .collect();
    // The yaw rate of a drift is of another unit than its velocity.
    let vector = if flaw == Flaw::Drift { 3 } else { parameters.len() };
    let length = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let size = (vector > 1 && flaw != Flaw::PrincipalPoint).then(|| {
        let name = PARAMETERS[flaw.parameters().start].name.replacen("_x", "", 1);
        estimated(&name, length(&fit.theta.of(flaw)[..vector]), &|values| {
            length(&values[first..first + vector])
        })
    });
    let alone = if fit.flaws.len() == 1 { None } else { Some(fit.only(flaw)) };
    let seen = Observability::of(alone.as_ref().unwrap_or(fit));
    let candidate = judge.candidate(fit.clone());
    let nothing = judge.candidate(Fit::of_nothing(judge.problem, judge.blocks));
    FlawPart {
        flaw,
        text: words::line(flaw, &parameters, size.as_ref()),
        of: parameters.len(),
        parameters,
        size,
        rmse_px: fit.rmse_px(),
        explained_percent: 100.0 * (1.0 - (fit.rmse_px() / rmse_before_px.max(f64::MIN_POSITIVE)).powi(2)),
        likelier: nothing.unseen.total() - candidate.unseen.total(),
        sureness: judge.sureness(&candidate, &nothing),
        rank: seen.rank(judge.blocks, &judge.noise),
        weakest_px: seen.weakest_px,
        strongest_px: seen.strongest_px,
    }
}

fn overlaps(fits: &[Fit]) -> Vec<Overlap> {
    let mut overlaps = Vec::new();
    for of in fits {
        for with in fits.iter().filter(|with| with.flaws != of.flaws) {
            let share = overlap(of, with);
            if let ([of], [with], true) = (of.flaws.as_slice(), with.flaws.as_slice(), share > LARGE_OVERLAP)
            {
                overlaps.push(Overlap { of: *of, with: *with, share });
            }
        }
    }
    overlaps
}

fn verdict_of(
    found: &Found,
    singles: &[Fit],
    fitted: Vec<FlawPart>,
    rmse_before_px: f64,
    time_offset_s: f64,
) -> Verdict {
    let named = &found.named.fit;
    let rmse_px = named.rmse_px();
    let corrections: Vec<String> = named
        .flaws
        .iter()
        .map(|flaw| words::correction(*flaw, named.theta.of(*flaw), time_offset_s))
        .collect();
    let help = |flaws: &[Flaw]| flaws.iter().map(|f| format!("{f}: {}", f.labels_that_help())).collect();
    let (kind, flaws, sentence, labels_that_help) = match (named.flaws.as_slice(), found.doubt.as_slice()) {
        ([], []) => {
            let sentence = format!(
                "no flaw found above the label noise ({rmse_before_px:.2} px, of which no flaw explains enough)"
            );
            (VerdictKind::NoFlaw, vec![], sentence, vec![])
        }
        ([], doubt) => {
            let sentence = format!(
                "cannot tell {} apart: each explains much of the {rmse_before_px:.2} px (likeliest: {}, which leaves {:.2} px)",
                words::listed(doubt, "and"),
                doubt[0],
                singles.iter().find(|f| f.flaws == doubt[..1]).map_or(f64::NAN, Fit::rmse_px)
            );
            (VerdictKind::CannotTell, doubt.to_vec(), sentence, help(doubt))
        }
        (flaws, doubt) => {
            let values: Vec<&str> = fitted.iter().map(|f| f.text.as_str()).collect();
            let rest = if doubt.is_empty() {
                String::new()
            } else {
                format!("; what is left could be {}", words::listed(doubt, "or"))
            };
            let sentence = format!(
                "most likely {}: {rmse_before_px:.2} px become {rmse_px:.2} px without it{rest}",
                values.join("; ")
            );
            (VerdictKind::Named, flaws.to_vec(), sentence, help(doubt))
        }
    };
    let sureness = found.sureness;
    Verdict { kind, flaws, sureness, fitted, rmse_px, sentence, corrections, labels_that_help }
}
