//! An estimate without what a diagnosis found in it.

use std::borrow::Cow;

use super::document::DiagnosisDocument;
use super::flaw::{Flaw, PARAMETERS};
use super::motion::{Motion, Poses};
use super::theta::Theta;
use crate::conventions::{Convention, Given, cure};
use crate::error::{DataError, DataResult, ErrorKind};
use crate::time::{Span, Stamp};
use crate::trajectory::Trajectory;

impl DiagnosisDocument {
    /// The named values, zero where none is named.
    pub fn theta(&self) -> Theta {
        let mut theta = Theta::zero();
        for part in &self.verdict.fitted {
            for value in &part.parameters {
                if let Some(at) = PARAMETERS.iter().position(|p| p.name == value.name) {
                    theta[at] = value.value;
                }
            }
        }
        theta
    }

    /// The conventions of the estimate that are named.
    ///
    /// # Errors
    /// [`DataError`] if one is not known.
    pub fn conventions(&self) -> DataResult<Vec<Convention>> {
        let read = |word: &String| word.parse::<Convention>().map_err(DataError::new);
        self.verdict.estimate_as.iter().map(read).collect()
    }
}

/// The estimate of a diagnosis without its conventions, clock offset, rate and step, scale and drift. Flaws of the camera
/// are left: they are no matter of the estimate.
///
/// `given.first_frame` is where the clock's rate and step count from.
///
/// # Errors
/// [`DataError`] if nothing is named that could be mended in an estimate, or stamps leave their range.
pub fn mend(
    document: &DiagnosisDocument,
    trajectory: &Trajectory,
    given: Given<'_>,
) -> DataResult<Trajectory> {
    let theta = document.theta();
    let conventions = document.conventions()?;
    let of_the_estimate = [Flaw::ClockOffset, Flaw::ClockRate, Flaw::ClockStep, Flaw::Scale, Flaw::Drift];
    let any = of_the_estimate.iter().any(|f| theta.of(*f).iter().any(|v| *v != 0.0));
    if !any && conventions.is_empty() {
        return Err(DataError::of_kind(
            ErrorKind::Contradictory,
            format!("nothing to mend in the estimate: {}", document.verdict.sentence),
        ));
    }
    let cured: Cow<'_, Trajectory> = match conventions.is_empty() {
        true => Cow::Borrowed(trajectory),
        false => Cow::Owned(cure(&conventions, trajectory, given)?),
    };
    if !any {
        return Ok(cured.into_owned());
    }
    let first = given.first_frame.ok_or_else(|| {
        DataError::of_kind(ErrorKind::Usage, "a clock is mended from the camera's first frame on")
    })?;
    // The clocks as they are read; poses of the stream at its own stamps.
    let mut of_poses = Theta::zero();
    for flaw in [Flaw::Scale, Flaw::Drift] {
        of_poses = of_poses.with(flaw, theta.of(flaw));
    }
    let motion = Motion { poses: Poses::new(&cured, first), inertial: None, first_frame: first, id: 0 };
    let reader = motion.reader(&of_poses)?;
    let [offset_s, fast] = [theta.of(Flaw::ClockOffset)[0], theta.of(Flaw::ClockRate)[0]];
    let [step_s, step_at_s] = [theta.of(Flaw::ClockStep)[0], theta.of(Flaw::ClockStep)[1]];
    let mut poses: Vec<(Stamp, crate::frames::WorldFromBody)> = Vec::with_capacity(cured.len());
    for stamp in cured.stamps() {
        let read_s = stamp.since(first).as_secs_f64();
        let before = (read_s - offset_s) / (1.0 + fast);
        let after = (read_s - offset_s - step_s) / (1.0 + fast);
        let mut true_s = if before < step_at_s { before } else { after };
        if before >= step_at_s && after < step_at_s {
            // Stamps that the step leaves out, or puts twice: the later ones hold.
            if step_s > 0.0 {
                continue;
            }
            true_s = after;
        }
        let span = Span::from_secs_f64(true_s)
            .map_err(|e| DataError::new("a mended stamp is out of range").because(e))?;
        let at = first + span;
        while poses.last().is_some_and(|(last, _)| *last >= at) {
            poses.pop();
        }
        poses.push((at, reader.at(read_s)));
    }
    Trajectory::from_poses(poses).map_err(|e| DataError::new("nothing is left of the estimate").because(e))
}
