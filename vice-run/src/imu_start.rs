//! Where an integration of the IMU starts: from the reference's state at the first key frame.

use nalgebra::Vector3;
use vice_core::dataset::{Dataset, GROUND_TRUTH};
use vice_core::diagnose::InertialRun;
use vice_core::evaluate::Stream;
use vice_core::imu::{GRAVITY_Z_UP_M_S2, ImuSample, InertialState, fit_velocity};
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};

use crate::error::{RunError, RunResult};
use crate::request::IMU_EULER;

/// What an integration is started from.
pub(crate) struct ImuStart<'a> {
    pub(crate) dataset: &'a dyn Dataset,
    pub(crate) reference: &'a Stream,
    pub(crate) time_offset: Span,
    pub(crate) max_gap: Span,
}

impl ImuStart<'_> {
    /// The run from the first key frame to the last evaluated frame, and a gap that a sample is held across.
    pub(crate) fn run(&self, start: Stamp, last: Stamp) -> RunResult<(InertialRun, Option<Suspicion>)> {
        let samples = self.dataset.imu()?;
        if samples.is_empty() {
            return Err(RunError::missing(format!("{IMU_EULER}: the data set has no inertial samples"))
                .of("estimate"));
        }
        let state = self.state(start)?;
        // The clock of the samples is what is off: shifted afterwards, the states would miss the key frame.
        let shifted = |s: &ImuSample| ImuSample { stamp: s.stamp + self.time_offset, ..*s };
        let samples: Vec<ImuSample> = samples.iter().map(shifted).collect();
        let gap = gap(&samples, start, last, self.max_gap);
        // A little beyond, so that the last frame lies between two states.
        let end = last + Span::from_millis(1000);
        Ok((InertialRun { samples, start: state, end, gravity_m_s2: GRAVITY_Z_UP_M_S2 }, gap))
    }

    fn state(&self, stamp: Stamp) -> RunResult<InertialState> {
        if self.reference.name == GROUND_TRUTH
            && self.dataset.streams().iter().any(|s| s == GROUND_TRUTH)
            && let Some(state) = self.dataset.inertial_state(stamp)?
        {
            return Ok(state);
        }
        let lacking = || {
            RunError::usage(
                "estimate",
                format!("{IMU_EULER}: the reference has no state at the first key frame, {stamp} ns"),
            )
        };
        let reference = &self.reference.trajectory;
        Ok(InertialState {
            stamp,
            world_from_body: reference.pose_at(stamp, self.max_gap).map_err(|e| lacking().because(e))?,
            velocity_m_s: fit_velocity(reference, stamp).map_err(|e| lacking().because(e))?,
            gyro_bias_rad_s: Vector3::zeros(),
            accel_bias_m_s2: Vector3::zeros(),
        })
    }
}

/// A sample is held across a gap, which no robot does.
fn gap(samples: &[ImuSample], start: Stamp, end: Stamp, max_gap: Span) -> Option<Suspicion> {
    let gaps = samples.windows(2).map(|w| (w[0].stamp, w[1].stamp.since(w[0].stamp)));
    let inside = gaps.filter(|(at, gap)| *gap > max_gap && *at + *gap > start && *at < end);
    let (at, gap) = inside.max_by_key(|(_, gap)| *gap)?;
    Some(
        Suspicion::new("imu-gap", IMU_EULER, "a sample is held across a gap of the inertial samples")
            .evidence(format!("a gap of {gap} after {at} ns")),
    )
}
