//! Which flaw explains the pixel errors, and how RMSE_2D answers to each: from a request to the documents.

use serde::{Deserialize, Serialize};
use vice_core::diagnose::{
    Diagnosed, Diagnosis, DiagnosisDocument, Flaw, OdometryNoise, Options, SensitivityDocument, Theta,
    VerdictKind, diagnose, sensitivity,
};
use vice_core::error::ErrorKind;
use vice_core::evaluate::Evaluation;
use vice_core::frames::BodyFromCamera;
use vice_core::result::Role;
use vice_core::suspicion::Suspicions;
use vice_core::time::{Span, Stamp};
use vice_files::calibration::{CalibrationFile, CameraOverride};

use crate::error::{Context, RunError, RunResult};
use crate::open::Opened;
use crate::progress::Progress;
use crate::request::Request;
use crate::streams::LoadedStreams;
use crate::tracking_summary::TrackingSummary;

/// What is looked for, and how.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Looking {
    /// Flaws to look for; empty: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub flaws: Vec<Flaw>,
    /// How much the odometry may wander and still be healthy.
    #[serde(default)]
    pub odometry_noise: OdometryNoise,
}

impl Looking {
    fn options(&self) -> Options {
        Options { odometry_noise: self.odometry_noise }
    }

    /// The flaws to look for.
    pub fn flaws(&self) -> Vec<Flaw> {
        if self.flaws.is_empty() { Flaw::ALL.to_vec() } else { self.flaws.clone() }
    }
}

/// A diagnosis with what was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiagnosisResult {
    /// What was found.
    #[serde(flatten)]
    pub diagnosis: DiagnosisDocument,
    /// What was asked for.
    pub request: Request,
    /// Seconds that were added to the estimate's stamps.
    pub time_offset_s: f64,
    /// How the labels came about, where no person made them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracking: Option<TrackingSummary>,
}

/// The answer for one estimate with one depth source.
pub struct Answer {
    /// Name of the estimate.
    pub stream: String,
    /// Name of the depth source.
    pub depth: String,
    /// What was found, and the calibration without it, or why there is none.
    pub outcome: RunResult<(DiagnosisResult, RunResult<CalibrationFile>)>,
}

/// The answers, and what looked wrong on the way to them.
pub struct Answers {
    /// One for each estimate with each depth source.
    pub list: Vec<Answer>,
    /// What looks wrong in the data.
    pub suspicions: Suspicions,
}

/// Diagnoses each estimate with each depth source. One that fails does not take the others with it.
///
/// # Errors
/// [`RunError`] if nothing can be evaluated at all.
pub fn diagnose_all(
    request: &Request,
    opened: &Opened,
    looking: &Looking,
    progress: &Progress<'_>,
) -> RunResult<Answers> {
    let flaws = looking.flaws();
    request.depth.check_of_frames()?;
    request.with_evaluation(opened, false, progress, |evaluation, streams, tracking| {
        let mut answers = Vec::new();
        for stream in estimates(evaluation) {
            for depth in 0..evaluation.depths.len() {
                let inertial = streams.inertial_run(stream);
                let options = looking.options();
                let diagnosis = Diagnosis { evaluation, stream, depth, inertial, flaws: &flaws, options };
                let names =
                    (evaluation.streams[stream].name.clone(), evaluation.depths[depth].name().to_string());
                let outcome = diagnose(&diagnosis, &|done, total| progress("fitting", done, total))
                    .context(|| format!("{} with {}", names.0, names.1));
                let outcome = outcome.map(|found| {
                    let calibration = corrected(opened, evaluation, streams, &found);
                    let result = DiagnosisResult {
                        diagnosis: found.document,
                        request: request.without_secrets(),
                        time_offset_s: evaluation.streams[stream].time_offset.as_secs_f64(),
                        tracking: tracking.cloned(),
                    };
                    (result, calibration)
                });
                answers.push(Answer { stream: names.0, depth: names.1, outcome });
            }
        }
        Ok(Answers { list: answers, suspicions: suspicions(evaluation, streams) })
    })
}

/// What was doubted of the data, the depths and the streams.
fn suspicions(evaluation: &Evaluation<'_>, streams: &LoadedStreams) -> Suspicions {
    let mut list: Suspicions = evaluation.rig.suspicions().into_iter().collect();
    list.extend(evaluation.depths.iter().flat_map(|source| source.suspicions()));
    list.extend(streams.suspicions.clone());
    list
}

/// How RMSE_2D of one estimate with one depth source answers to each flaw.
///
/// # Errors
/// [`RunError`] if several are asked for, or it cannot be evaluated.
pub fn sensitivity_of(
    request: &Request,
    opened: &Opened,
    looking: &Looking,
    progress: &Progress<'_>,
) -> RunResult<(SensitivityDocument, Suspicions)> {
    let flaws = looking.flaws();
    request.depth.check_of_frames()?;
    request.with_evaluation(opened, false, progress, |evaluation, streams, _| {
        let estimates = estimates(evaluation);
        let ([stream], [_]) = (estimates.as_slice(), evaluation.depths) else {
            return Err(RunError::usage("estimate", "a sensitivity takes one estimate and one depth source"));
        };
        let inertial = streams.inertial_run(*stream);
        let options = looking.options();
        let diagnosis = Diagnosis { evaluation, stream: *stream, depth: 0, inertial, flaws: &flaws, options };
        let document = sensitivity(&diagnosis, &|done, total| progress("injecting", done, total))?;
        Ok((document, suspicions(evaluation, streams)))
    })
}

/// Indices of the estimates among the streams.
fn estimates(evaluation: &Evaluation<'_>) -> Vec<usize> {
    let all = evaluation.streams.iter().enumerate();
    all.filter(|(_, s)| s.role == Role::Estimate).map(|(index, _)| index).collect()
}

/// The calibration in use without the named flaws.
fn corrected(
    opened: &Opened,
    evaluation: &Evaluation<'_>,
    streams: &LoadedStreams,
    diagnosed: &Diagnosed,
) -> RunResult<CalibrationFile> {
    let (theta, verdict) = (&diagnosed.theta, &diagnosed.document.verdict);
    let refused = |why: String| RunError::new(ErrorKind::Contradictory, why).of("apply");
    if verdict.kind != VerdictKind::Named {
        return Err(refused(format!("nothing to apply, and nothing is written: {}", verdict.sentence)));
    }
    let in_a_calibration = [
        Flaw::ClockOffset,
        Flaw::ExtrinsicRotation,
        Flaw::ExtrinsicTranslation,
        Flaw::FocalLength,
        Flaw::PrincipalPoint,
        Flaw::Distortion,
        Flaw::Aspect,
    ];
    let known = |name: &str| in_a_calibration.iter().any(|flaw| flaw.name() == name);
    if let Some(flaw) = verdict.flaws.iter().find(|name| !known(name)) {
        return Err(refused(format!(
            "{flaw} is a flaw of the estimate, which no calibration can correct: nothing is written"
        )));
    }
    let mut file = CalibrationFile::new();
    let offset_s = streams.time_offset.as_secs_f64() - theta.of(Flaw::ClockOffset)[0];
    file.time_offset = Some(Span::from_secs_f64(offset_s)?);
    let camera = theta.correct_camera(evaluation.camera)?;
    let body_from_camera = corrected_extrinsics(opened, evaluation, theta)?;
    file.insert(evaluation.rig.camera_name(), CameraOverride::of(&camera, body_from_camera));
    Ok(file)
}

/// Extrinsics to write: none where they are right, since those of the data set may change with time.
fn corrected_extrinsics(
    opened: &Opened,
    evaluation: &Evaluation<'_>,
    theta: &Theta,
) -> RunResult<Option<BodyFromCamera>> {
    let wrong = [Flaw::ExtrinsicRotation, Flaw::ExtrinsicTranslation]
        .iter()
        .any(|flaw| theta.of(*flaw).iter().any(|v| *v != 0.0));
    // The new file takes the place of the one in use, and so has to say what that one said.
    let given = opened.calibration.as_ref().and_then(|c| c.body_from_camera(&opened.camera_name));
    if let Some(fixed) = given {
        return Ok(Some(theta.correct_extrinsics(&fixed)));
    }
    if !wrong {
        return Ok(None);
    }
    let at = |stamp: &Stamp| evaluation.rig.body_from_camera(*stamp);
    let (Some(first), Some(last)) = (evaluation.frames.first(), evaluation.frames.last()) else {
        return Err(RunError::missing("the camera has no frames"));
    };
    let fixed = at(first)?;
    if fixed != at(last)? {
        return Err(RunError::new(
            ErrorKind::Contradictory,
            "the camera moves against the body, so that no calibration file can hold its place: nothing is written",
        )
        .of("apply"));
    }
    Ok(Some(theta.correct_extrinsics(&fixed)))
}
