//! Gross errors first: another convention of the whole stream, before any small flaw is fitted.

use crate::parallel::*;

use super::DiagnoseError;
use super::motion::{Motion, Poses};
use super::scene::{LOST_PX, Residual, Scene};
use super::starts::robust_cost;
use super::theta::Theta;
use crate::conventions::{Convention, Given, cure};
use crate::error::DataResult;
use crate::evaluate::Evaluation;
use crate::frames::rotation_angle_rad;
use crate::statistics::middle;
use crate::time::Stamp;
use crate::trajectory::Trajectory;

/// A convention must be better than what was read by this, as a logarithm.
pub(super) const BETTER: f64 = 5.0;
/// So many labels are worth one that is independent, and so many independent ones count at most.
const LABELS_EACH: f64 = 20.0;
const MOST_INDEPENDENT: f64 = 60.0;
/// Rotations that differ by less are the same, radians.
const FROZEN_RAD: f64 = 1e-6;
/// A frozen rotation is no flaw of a robot that does not turn.
const FROZEN_COST: f64 = 1.5;
/// What bodies do: about this fast and this high, within so many natural logarithms.
const SPEED_M_S: f64 = 1.0;
const HEIGHT_M: f64 = 1.5;
const USUAL_LOG: f64 = 1.5;

/// A hypothesis about the stream as a whole.
pub(super) struct Hypothesis {
    pub(super) conventions: Vec<Convention>,
    pub(super) trajectory: Trajectory,
    pub(super) motion: Poses,
    /// Mean robust cost of a label.
    pub(super) cost: f64,
    /// How unlikely it is: the cost of all labels, and what bodies do not do.
    pub(super) unlikely: f64,
}

/// The number of independent labels.
pub(super) fn independent(labels: usize) -> f64 {
    (labels as f64 / LABELS_EACH).min(MOST_INDEPENDENT)
}

/// All hypotheses, as read first, the others by their score.
pub(super) fn hypotheses(
    evaluation: &Evaluation<'_>,
    scene: &Scene<'_>,
    trajectory: &Trajectory,
) -> Result<Vec<Hypothesis>, DiagnoseError> {
    let at = |stamp: Stamp| evaluation.rig.body_from_camera(stamp).ok();
    let given = Given { body_from_camera: Some(&at), first_frame: Some(scene.first_frame) };
    let mut lists: Vec<Vec<Convention>> = vec![vec![]];
    lists.extend(Convention::TRIED.iter().map(|c| vec![*c]));
    for order in [Convention::WFirst, Convention::WLast] {
        lists.push(vec![order, Convention::InversePose]);
        lists.push(vec![order, Convention::ConjugateQuaternion]);
    }
    lists.push(vec![Convention::InversePose, Convention::CameraAsBody]);
    if scene.own_anchor {
        lists.extend(Convention::WORLDS.iter().map(|c| vec![*c]));
    }
    // Whole sets of extrinsics are read at each pose: once.
    let tried: Vec<Option<Hypothesis>> = lists
        .into_par_iter()
        .enumerate()
        .map(|(i, conventions)| {
            let cured: DataResult<Trajectory> = cure(&conventions, trajectory, given);
            let trajectory = cured.ok()?;
            let motion = Motion {
                poses: Poses::new(&trajectory, scene.first_frame),
                inertial: None,
                first_frame: scene.first_frame,
                id: 1 + i as u64,
            };
            let residuals = scene.residuals(&Theta::zero(), &motion).ok()?;
            let lost = Residual::new(1000.0, 0.0);
            let residuals: Vec<Residual> =
                residuals.into_iter().map(|r| if r.norm() < LOST_PX { r } else { lost }).collect();
            let cost = robust_cost(&residuals);
            let unlikely = cost * independent(residuals.len()) + unusual(scene, &trajectory);
            Some(Hypothesis { conventions, trajectory, motion: motion.poses, cost, unlikely })
        })
        .collect();
    let mut tried = tried.into_iter();
    let Some(Some(as_read)) = tried.next() else {
        return Err(DiagnoseError::CannotEvaluate("the poses as they were read".to_string()));
    };
    let mut others: Vec<Hypothesis> = tried.flatten().collect();
    others.sort_by(|a, b| {
        let parts = |h: &Hypothesis| h.conventions.len();
        a.unlikely.total_cmp(&b.unlikely).then(parts(a).cmp(&parts(b)))
    });
    others.insert(0, as_read);
    Ok(others)
}

/// How much a stream does what bodies do not do.
fn unusual(scene: &Scene<'_>, trajectory: &Trajectory) -> f64 {
    let seconds = trajectory.end().since(trajectory.start()).as_secs_f64().max(1e-3);
    let speed = trajectory.path_length_m() / seconds;
    let beyond = |value: f64, usual: f64| {
        let off = ((value.max(1e-9) / usual).ln().abs() - USUAL_LOG).max(0.0);
        0.5 * off * off
    };
    // A robot that stands is no other unit.
    let mut sum =
        if speed > SPEED_M_S { beyond(speed, SPEED_M_S) } else { beyond(speed.max(0.02), SPEED_M_S) };
    if scene.own_anchor {
        let mut heights: Vec<f64> = trajectory.poses().iter().map(|p| p.translation().z.abs()).collect();
        if let Some(height) = middle(&mut heights, f64::total_cmp) {
            sum += beyond(height.max(0.02), HEIGHT_M);
        }
    }
    sum
}

/// Whether the rotation never changes though it should.
pub(super) fn is_frozen(as_read: &Hypothesis) -> bool {
    let poses = as_read.trajectory.poses();
    let first = poses[0].rotation();
    poses.len() > 4
        && as_read.cost > FROZEN_COST
        && poses.iter().all(|p| rotation_angle_rad(&(first.inverse() * p.rotation())) < FROZEN_RAD)
}
