//! From pixels to their cause: which flaw of an estimate or a calibration explains the errors.
//!
//! 1. Gross errors first (`gross`): other conventions, units and frames of the whole stream.
//! 2. `scene` makes the residuals of RMSE_2D a function of all flaws at once ([`Theta`]); depth is asked again where it
//!    depends on them.
//! 3. `filter` makes the residuals independent: labels are noisy, an odometry wanders, and all labels of a frame share its
//!    pose, all labels of a segment its key frame. One Kalman pass, linear in time.
//! 4. No flaw, each [`Flaw`] alone and pairs are fitted (`fit`, `search`), each with its own sizes of noise, and compared by
//!    how likely they make the labels with their values integrated over.
//! 5. `verdict` names flaws only if they are likelier than all else, fit better than every rival, and the odometry is
//!    healthy; else it says what cannot be told apart, or that nothing known explains what is left.
//!
//! No ground truth is needed: the labels are the truth. Where the estimate itself places the camera for depth, its
//! flaws move the depth as well, and that is fitted too.

mod carry;
mod document;
mod filter;
mod fit;
mod flaw;
mod geometry;
mod gross;
mod mend;
mod motion;
mod newton;
mod noise;
mod normal;
mod outliers;
mod report;
mod scene;
mod search;
mod sensitivity;
mod sentence;
mod sizes;
mod starts;
mod theta;
mod verdict;
mod view;
mod width;
mod words;

pub use document::{
    CauseName, DiagnosisDocument, Estimated, FlawPart, HypothesisPart, LabelsPart, OdometryPart, Overlap,
    SCHEMA, Verdict, VerdictKind,
};
pub use flaw::{Flaw, PARAMETER_COUNT, PARAMETERS, ParameterInfo, Unit};
pub use mend::mend;
pub use motion::InertialRun;
pub use noise::OdometryNoise;
pub use sensitivity::{Curve, CurvePoint, SENSITIVITY_SCHEMA, SensitivityDocument, sensitivity};
pub use theta::Theta;

use fit::Work;
use gross::{BETTER, Hypothesis, hypotheses, independent, is_frozen};
use motion::{Motion, Poses};
use noise::NoiseModel;
use scene::Scene;
use search::search;
use starts::{robust_cost, start};

use crate::conventions::Convention;
use crate::evaluate::trial::Trial;
use crate::evaluate::{EvaluateError, Evaluation};

/// Of more points than these at once some are left out: the cost grows with their square, and what all points of a frame
/// share is known from these.
const MOST_POINTS: usize = 10;

/// A convention must be likelier than what was read by this times the root of the number of labels, as a logarithm, where
/// both may wander. Of a cart on a plane the mirror turns the sign of the errors of height, roll and pitch and of nothing
/// else: which sign is likelier is chance, with a deviation of twice the root of what the labels show of these errors.
const BETTER_THAN_WANDER: f64 = 10.0;

/// Why nothing could be diagnosed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DiagnoseError {
    /// Nothing can be scored at all.
    #[error(
        "no label can be scored, so that there is nothing to diagnose: see the reasons that `vice evaluate` lists"
    )]
    NothingScored,
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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// How much an odometry may wander and still be healthy.
    pub odometry_noise: OdometryNoise,
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
    /// What the poses are, where they were read as something else: the cure that is named.
    pub conventions: Vec<Convention>,
}

/// Runs a diagnosis. `progress` is called with (done, total) as hypotheses are fitted.
///
/// # Errors
/// [`DiagnoseError`] if there is nothing to fit to or the stream cannot be evaluated. Too few labels are a verdict.
pub fn diagnose(
    diagnosis: &Diagnosis<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Diagnosed, DiagnoseError> {
    let flaws = flaws_of(diagnosis)?;
    let prepared = Prepared::new(diagnosis, &flaws)?;
    let Prepared { scene, motion, gross, .. } = &prepared;
    let noise =
        NoiseModel { odometry: diagnosis.options.odometry_noise, inertial: diagnosis.inertial.is_some() };
    let mut work = Work::new(scene, motion, noise, &Theta::zero())?;
    let found = search(&mut work, &flaws, progress)?;
    Ok(report::diagnosed(diagnosis, &prepared, &work, &found, gross))
}

/// What is wrong with the stream as a whole.
struct Gross {
    conventions: Vec<Convention>,
    frozen: bool,
    /// How much likelier it is than what was read, as a logarithm.
    likelier: f64,
}

/// Labels, poses as they are taken, and the RMSE_2D of what was read.
struct Prepared<'a> {
    scene: Scene<'a>,
    motion: Motion<'a>,
    /// The same poses as they are read, not smoothed.
    plain: Motion<'a>,
    gross: Gross,
    rmse_px: f64,
    scored: usize,
}

impl<'a> Prepared<'a> {
    fn new(diagnosis: &Diagnosis<'a>, flaws: &[Flaw]) -> Result<Self, DiagnoseError> {
        let Diagnosis { evaluation, stream, depth, inertial, .. } = *diagnosis;
        let trial = Trial::new(evaluation);
        let frames = evaluation.selection.stamp_range(evaluation.frames).ok_or(EvaluateError::EmptyWindow)?;
        evaluation.streams[stream].check_overlap(frames)?;
        let (rmse_px, scored) = trial.pooled_rmse_px(stream, depth)?;
        let trajectory = &evaluation.streams[stream].trajectory;
        let mut scene = Scene::new(evaluation, stream, depth)?;
        // Labels outside of the stream, or in its gaps, are no matter of a convention.
        let posed: Vec<bool> =
            scene.frames.iter().map(|f| trajectory.pose_at(f.stamp, evaluation.max_gap).is_ok()).collect();
        let keep: Vec<bool> =
            scene.labels.iter().map(|l| posed[l.frame] && posed[scene.segments[l.segment].frame]).collect();
        scene.only(&keep);
        scene.thin(MOST_POINTS);
        if scene.labels.is_empty() {
            return Err(DiagnoseError::NothingScored);
        }
        let first_frame = scene.first_frame;
        let as_read = Motion { poses: Poses::new(trajectory, first_frame), inertial, first_frame, id: 0 };
        let (motion, gross) = match inertial {
            Some(_) => (as_read, Gross { conventions: vec![], frozen: false, likelier: 0.0 }),
            None => conventions(diagnosis, &scene, as_read, flaws)?,
        };
        // A key point that has no depth wherever the camera is thought to be is nobody's flaw.
        if scene.fixed_depth {
            let points = scene.view(&Theta::zero(), &motion)?.points;
            let keep: Vec<bool> = scene.labels.iter().map(|l| points[l.segment].is_some()).collect();
            scene.only(&keep);
        }
        if scene.labels.is_empty() {
            return Err(DiagnoseError::NothingScored);
        }
        let plain = motion;
        let motion = match inertial {
            Some(_) => plain.clone(),
            None => Motion { poses: plain.poses.smoothed(), id: 2_000, ..plain.clone() },
        };
        Ok(Self { scene, motion, plain, gross, rmse_px, scored })
    }
}

/// The convention that explains the labels far better than what was read and better than any flaw does.
fn conventions<'a>(
    diagnosis: &Diagnosis<'a>,
    scene: &Scene<'a>,
    as_read: Motion<'a>,
    flaws: &[Flaw],
) -> Result<(Motion<'a>, Gross), DiagnoseError> {
    let trajectory = &diagnosis.evaluation.streams[diagnosis.stream].trajectory;
    let mut all = hypotheses(diagnosis.evaluation, scene, trajectory)?;
    let frozen = is_frozen(&all[0]);
    let nothing = Gross { conventions: vec![], frozen, likelier: 0.0 };
    let better = |h: &Hypothesis, than: f64| than - h.unlikely > BETTER;
    if all.len() < 2 || frozen || !better(&all[1], all[0].unlikely) {
        return Ok((as_read, nothing));
    }
    let unusual = all[0].unlikely - all[0].cost * independent(scene.labels.len());
    let by_flaw = best_flaw_cost(scene, &as_read, flaws)? * independent(scene.labels.len());
    if !better(&all[1], by_flaw + unusual) {
        return Ok((as_read, nothing));
    }
    let likelier = (all[0].unlikely).min(by_flaw + unusual) - all[1].unlikely;
    let best = all.swap_remove(1);
    let motion = Motion { poses: best.motion, id: 1_000, ..as_read.clone() };
    // What an odometry that wanders explains as well is no other convention.
    let noise = NoiseModel { odometry: diagnosis.options.odometry_noise, inertial: false };
    let by_wander = as_healthy(scene, &motion, noise)? - as_healthy(scene, &as_read, noise)?;
    if by_wander < BETTER_THAN_WANDER * (scene.labels.len() as f64).sqrt() {
        return Ok((as_read, nothing));
    }
    Ok((motion, Gross { conventions: best.conventions, likelier, ..nothing }))
}

/// How likely the labels are with poses that only wander, as a logarithm.
fn as_healthy<'a>(scene: &Scene<'a>, motion: &Motion<'a>, noise: NoiseModel) -> Result<f64, DiagnoseError> {
    let zero = Theta::zero();
    let mut work = Work::new(scene, motion, noise, &zero)?;
    work.weights = outliers::by_neighbours(&work, &work.residuals(&zero)?);
    let fit = work.newton(&[], &zero, &[0.0; 6], &[], 0)?;
    Ok(work.sized(fit, 4).score)
}

/// The least robust cost that any flaw alone leaves of the poses as they were read.
fn best_flaw_cost<'a>(scene: &Scene<'a>, motion: &Motion<'a>, flaws: &[Flaw]) -> Result<f64, DiagnoseError> {
    // Far from the answer the poses' noise says little: a wide one lets each flaw do what it can.
    let noise = NoiseModel { odometry: OdometryNoise::WHEEL, inertial: false };
    let work = Work::new(scene, motion, noise, &Theta::zero())?;
    let zero = Theta::zero();
    let mut least = robust_cost(&work.residuals(&zero)?);
    for flaw in flaws {
        let from = start(&work, *flaw, &zero);
        if let Ok(fit) = work.newton(&[*flaw], &from, &[0.0; 6], &[], 4) {
            let values = fit.values();
            let plausible = fit.parameters.iter().all(|p| values[*p].abs() <= PARAMETERS[*p].plausible);
            if plausible {
                least = least.min(robust_cost(&fit.residuals)).min(robust_cost(&work.residuals(&from)?));
            }
        }
    }
    Ok(least)
}

/// The flaws to look for, in their own order.
fn flaws_of(diagnosis: &Diagnosis<'_>) -> Result<Vec<Flaw>, DiagnoseError> {
    let inertial = diagnosis.inertial.is_some();
    let can_be = |f: &Flaw| {
        diagnosis.flaws.contains(f)
            && match f {
                Flaw::InitialTilt => inertial,
                // An integration has one clock, and is long in no unit of its own.
                Flaw::ClockRate | Flaw::ClockStep => !inertial,
                _ => true,
            }
    };
    let flaws: Vec<Flaw> = Flaw::ALL.into_iter().filter(can_be).collect();
    if flaws.is_empty() { Err(DiagnoseError::NoFlaws) } else { Ok(flaws) }
}
