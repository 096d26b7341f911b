//! What a flaw of the estimate does to its poses, undone.

use std::borrow::Cow;

use nalgebra::{UnitQuaternion, Vector3};

use super::flaw::Flaw;
use super::theta::Theta;
use crate::error::{DataError, DataResult};
use crate::evaluate::trial::PosesAtFrames;
use crate::frames::Rigid;
use crate::imu::{ImuSample, InertialState, integrate_euler};
use crate::time::{Span, Stamp};
use crate::trajectory::Trajectory;

/// The integration that made an inertial estimate, to be run again from another start or with another clock.
#[derive(Clone, Debug)]
pub struct InertialRun {
    /// The samples, any clock offset already added.
    pub samples: Vec<ImuSample>,
    /// Where the integration starts.
    pub start: InertialState,
    /// Where it ends.
    pub end: Stamp,
    /// Gravity in the world, m/s².
    pub gravity_m_s2: Vector3<f64>,
}

impl InertialRun {
    /// The trajectory with the stamps of the samples moved and the start turned about the world's axes.
    ///
    /// # Errors
    /// [`DataError`] if the moved samples do not cover the start.
    pub fn integrate(&self, samples_later: Span, start_turned_rad: Vector3<f64>) -> DataResult<Trajectory> {
        let moved: Cow<'_, [ImuSample]> = if samples_later == Span::ZERO {
            Cow::Borrowed(&self.samples)
        } else {
            self.samples.iter().map(|s| ImuSample { stamp: s.stamp + samples_later, ..*s }).collect()
        };
        let pose = self.start.world_from_body;
        let turned = UnitQuaternion::from_scaled_axis(start_turned_rad) * pose.rotation();
        let start =
            InertialState { world_from_body: Rigid::from_parts(pose.translation(), turned), ..self.start };
        integrate_euler(&moved, &start, self.end, self.gravity_m_s2)
            .map_err(|e| DataError::new("the inertial estimate cannot be integrated again").because(e))
    }
}

/// An estimate, and how its poses follow from a [`Theta`].
pub(super) struct Motion<'a> {
    pub(super) trajectory: &'a Trajectory,
    pub(super) inertial: Option<&'a InertialRun>,
    pub(super) max_gap: Span,
}

impl Motion<'_> {
    /// Poses at stamps, the errors taken out.
    pub(super) fn poses_at(&self, theta: &Theta, stamps: &[Stamp]) -> DataResult<PosesAtFrames> {
        let offset_s = theta.of(Flaw::ClockOffset)[0];
        let too_late = Span::from_secs_f64(offset_s)
            .map_err(|e| DataError::new("the clock offset is no span of time").because(e))?;
        let (trajectory, read_later) = match self.inertial {
            Some(run) if too_late != Span::ZERO || theta.of(Flaw::InitialTilt) != [0.0, 0.0] => {
                let tilt = theta.of(Flaw::InitialTilt);
                let turn = Vector3::new(-tilt[0], -tilt[1], 0.0);
                (Cow::Owned(run.integrate(-too_late, turn)?), Span::ZERO)
            }
            _ => (Cow::Borrowed(self.trajectory), too_late),
        };
        let trajectory = without_drift(trajectory, theta);
        Ok(stamps.iter().map(|stamp| trajectory.pose_at(*stamp + read_later, self.max_gap)).collect())
    }
}

/// Undoes a scale and a constant-rate drift, both counted from the first pose.
///
/// The drift is dead reckoning's: with the yaw error `ψ = rate · t` each step is `Rz(ψ) Δp + velocity · Δt`.
fn without_drift<'t>(trajectory: Cow<'t, Trajectory>, theta: &Theta) -> Cow<'t, Trajectory> {
    let longer = 1.0 + theta.of(Flaw::Scale)[0];
    let drift = theta.of(Flaw::Drift);
    let (velocity, yaw_rate) = (Vector3::new(drift[0], drift[1], drift[2]), drift[3]);
    if longer == 1.0 && drift.iter().all(|v| *v == 0.0) {
        return trajectory;
    }
    let start = trajectory.start();
    let back = |seconds: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -yaw_rate * seconds);
    let first = trajectory.poses()[0].translation();
    let (mut before_s, mut before, mut position) = (0.0, first, first);
    Cow::Owned(trajectory.map_poses(|stamp, pose| {
        let now_s = stamp.since(start).as_secs_f64();
        let step = (pose.translation() - before) / longer - velocity * (now_s - before_s);
        position += match yaw_rate == 0.0 {
            true => step,
            false => back(0.5 * (before_s + now_s)) * step,
        };
        (before_s, before) = (now_s, pose.translation());
        let rotation = if yaw_rate == 0.0 { pose.rotation() } else { back(now_s) * pose.rotation() };
        Rigid::from_parts(position, rotation)
    }))
}
