//! Inertial samples and their Euler integration, the on-board estimate of the paper's Blackbird rows.
//!
//! Each sample is held until the next one. Per step of length `dt`, all with the old state:
//! `p += v dt; v += (R (a - b_a) + g) dt; R = R Exp((w - b_w) dt)`. It drifts on purpose: what is evaluated is the
//! sensor, not a filter.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};

use crate::frames::{Rigid, WorldFromBody};
use crate::time::{Span, Stamp};
use crate::trajectory::{Trajectory, TrajectoryError};

/// Gravity in a world whose z points up, m/s² (method page: g = 9.81).
pub const GRAVITY_Z_UP_M_S2: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// One sample, in the body frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// When it was measured.
    pub stamp: Stamp,
    /// Angular rate, rad/s.
    pub gyro_rad_s: Vector3<f64>,
    /// Specific force, m/s²: about +9.81 on the axis that points up, at rest.
    pub accel_m_s2: Vector3<f64>,
}

/// Where integration starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialState {
    /// When.
    pub stamp: Stamp,
    /// Pose of the body.
    pub world_from_body: WorldFromBody,
    /// Velocity of the body in the world, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Bias of the gyroscope, subtracted and held, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Bias of the accelerometer, subtracted and held, m/s².
    pub accel_bias_m_s2: Vector3<f64>,
}

/// Why samples cannot be integrated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImuError {
    /// No sample at or before the start: there is nothing to hold.
    #[error("the inertial samples start at {first} ns, after the start of the integration at {start} ns")]
    StartsLate {
        /// The first sample.
        first: Stamp,
        /// Where integration should start.
        start: Stamp,
    },
    /// No sample after the start.
    #[error("no inertial sample after the start of the integration at {start} ns")]
    EndsEarly {
        /// Where integration should start.
        start: Stamp,
    },
    /// A number is NaN or infinite.
    #[error("inertial sample {row} is not finite")]
    NotFinite {
        /// Which sample, from 0.
        row: usize,
    },
    /// Stamps do not increase.
    #[error("inertial sample {row} at {stamp} ns is not later than the one before")]
    Unsorted {
        /// Which sample, from 0.
        row: usize,
        /// Its stamp.
        stamp: Stamp,
    },
    /// The integrated states are no trajectory: they grew beyond what a double holds.
    #[error("the integrated states are no trajectory")]
    Diverged(#[source] TrajectoryError),
    /// Too few poses around the start to fit a velocity.
    #[error("{got} poses within half a second of {at} ns are too few to fit a velocity")]
    TooFewPoses {
        /// How many there were.
        got: usize,
        /// Around which stamp.
        at: Stamp,
    },
}

/// Checks that samples are finite and strictly ordered.
///
/// # Errors
/// [`ImuError::NotFinite`] or [`ImuError::Unsorted`] with the sample's index.
pub fn validate(samples: &[ImuSample]) -> Result<(), ImuError> {
    for (row, s) in samples.iter().enumerate() {
        if !s.gyro_rad_s.iter().chain(s.accel_m_s2.iter()).all(|v| v.is_finite()) {
            return Err(ImuError::NotFinite { row });
        }
        if row > 0 && s.stamp <= samples[row - 1].stamp {
            return Err(ImuError::Unsorted { row, stamp: s.stamp });
        }
    }
    Ok(())
}

/// Euler integration from `start` to the last sample at or before `end`, with one pose at `start` and one at each later sample.
///
/// `gravity_m_s2` is in the world frame. A start between two samples begins with the earlier one held.
///
/// # Errors
/// [`ImuError`] if samples are out of order or not finite, or do not cover the start.
pub fn integrate_euler(
    samples: &[ImuSample],
    start: &InertialState,
    end: Stamp,
    gravity_m_s2: Vector3<f64>,
) -> Result<Trajectory, ImuError> {
    validate(samples)?;
    let late = |s: &ImuSample| ImuError::StartsLate { first: s.stamp, start: start.stamp };
    let held = samples.partition_point(|s| s.stamp <= start.stamp);
    let Some(first_held) = held.checked_sub(1) else {
        return Err(samples.first().map_or(ImuError::EndsEarly { start: start.stamp }, late));
    };
    if held == samples.len() {
        return Err(ImuError::EndsEarly { start: start.stamp });
    }
    let mut now = start.stamp;
    let mut p = start.world_from_body.translation();
    let mut r = start.world_from_body.rotation();
    let mut v = start.velocity_m_s;
    let mut poses = vec![(now, start.world_from_body)];
    for (held, next) in samples[first_held..].iter().zip(&samples[first_held + 1..]) {
        if next.stamp > end {
            break;
        }
        let dt = next.stamp.since(now).as_secs_f64();
        let accel_world = r * (held.accel_m_s2 - start.accel_bias_m_s2) + gravity_m_s2;
        p += v * dt;
        v += accel_world * dt;
        r *= UnitQuaternion::from_scaled_axis((held.gyro_rad_s - start.gyro_bias_rad_s) * dt);
        r.renormalize();
        now = next.stamp;
        poses.push((now, Rigid::from_parts(p, r)));
    }
    Trajectory::from_poses(poses).map_err(ImuError::Diverged)
}

/// Velocity of a trajectory at `at` (m/s, world frame), from a cubic fitted to the eight poses nearest in time.
///
/// One-sided differences cost a tenth of a pixel on an aggressive flight; a cubic follows its acceleration and jerk.
///
/// # Errors
/// [`ImuError::TooFewPoses`] if fewer than four poses lie within half a second.
pub fn fit_velocity(trajectory: &Trajectory, at: Stamp) -> Result<Vector3<f64>, ImuError> {
    const POSES: usize = 8;
    let reach = Span::from_millis(500);
    let mut nearest: Vec<usize> = {
        let centre = trajectory.stamps().partition_point(|s| *s < at);
        (centre.saturating_sub(POSES)..(centre + POSES).min(trajectory.len())).collect()
    };
    nearest.sort_by_key(|i| (trajectory.stamps()[*i].since(at).abs(), *i));
    nearest.truncate(POSES);
    nearest.retain(|i| trajectory.stamps()[*i].since(at).abs() <= reach);
    let got = nearest.len();
    if got < 4 {
        return Err(ImuError::TooFewPoses { got, at });
    }
    let seconds = |i: usize| trajectory.stamps()[i].since(at).as_secs_f64();
    let scale = nearest.iter().map(|i| seconds(*i).abs()).fold(f64::MIN_POSITIVE, f64::max);
    let powers = DMatrix::from_fn(got, 4, |row, power| (seconds(nearest[row]) / scale).powi(power as i32));
    let solver = powers.svd(true, true);
    let mut velocity = Vector3::zeros();
    for axis in 0..3 {
        let values = DVector::from_fn(got, |row, _| trajectory.poses()[nearest[row]].translation()[axis]);
        // Both factors were asked for, so that `solve` has what it needs.
        let fit = solver.solve(&values, 1e-12).map_err(|_| ImuError::TooFewPoses { got, at })?;
        velocity[axis] = fit[1] / scale;
    }
    Ok(velocity)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn sample(nanos: i64, gyro: [f64; 3], accel: [f64; 3]) -> ImuSample {
        ImuSample { stamp: Stamp::from_nanos(nanos), gyro_rad_s: gyro.into(), accel_m_s2: accel.into() }
    }

    fn at_rest(nanos: i64) -> InertialState {
        InertialState {
            stamp: Stamp::from_nanos(nanos),
            world_from_body: Rigid::identity(),
            velocity_m_s: Vector3::zeros(),
            gyro_bias_rad_s: Vector3::zeros(),
            accel_bias_m_s2: Vector3::zeros(),
        }
    }

    #[test]
    fn at_rest_nothing_moves_and_a_start_between_samples_holds_the_earlier() {
        let up = [0.0, 0.0, 9.81];
        let samples =
            [sample(0, [0.0; 3], up), sample(10_000_000, [0.0; 3], up), sample(20_000_000, [0.0; 3], up)];
        let t = integrate_euler(&samples, &at_rest(5_000_000), Stamp::MAX, GRAVITY_Z_UP_M_S2).unwrap();
        assert_eq!(
            t.stamps().iter().map(|s| s.as_nanos()).collect::<Vec<_>>(),
            [5_000_000, 10_000_000, 20_000_000]
        );
        assert!(t.poses().iter().all(|p| p.translation().norm() == 0.0));
    }

    #[test]
    fn the_old_state_moves_the_position() {
        let samples = [
            sample(0, [0.0; 3], [1.0, 0.0, 9.81]),
            sample(1_000_000_000, [0.0; 3], [0.0, 0.0, 9.81]),
            sample(2_000_000_000, [0.0; 3], [0.0, 0.0, 9.81]),
        ];
        let t = integrate_euler(&samples, &at_rest(0), Stamp::MAX, GRAVITY_Z_UP_M_S2).unwrap();
        let x: Vec<f64> = t.poses().iter().map(|p| p.translation().x).collect();
        assert_eq!(x, [0.0, 0.0, 1.0]);
    }

    #[test]
    fn samples_must_cover_the_start() {
        let samples = [sample(10, [0.0; 3], [0.0; 3]), sample(20, [0.0; 3], [0.0; 3])];
        let run = |nanos| integrate_euler(&samples, &at_rest(nanos), Stamp::MAX, GRAVITY_Z_UP_M_S2);
        assert!(matches!(run(5), Err(ImuError::StartsLate { .. })));
        assert!(matches!(run(20), Err(ImuError::EndsEarly { .. })));
        assert!(run(10).is_ok());
        let back = [samples[1], samples[0]];
        assert!(matches!(validate(&back), Err(ImuError::Unsorted { row: 1, .. })));
    }

    #[test]
    fn a_cubic_gives_its_own_slope() {
        let t = Trajectory::from_poses((0..20).map(|i| {
            let s = f64::from(i) * 0.01;
            let p = Vector3::new(1.0 + 2.0 * s + 3.0 * s * s + 40.0 * s * s * s, -s, 0.5);
            (Stamp::from_nanos(i64::from(i) * 10_000_000), Rigid::from_parts(p, UnitQuaternion::identity()))
        }))
        .unwrap();
        let v = fit_velocity(&t, Stamp::from_nanos(103_000_000)).unwrap();
        let s: f64 = 0.103;
        assert_relative_eq!(v, Vector3::new(2.0 + 6.0 * s + 120.0 * s * s, -1.0, 0.0), epsilon = 1e-9);
        assert!(matches!(
            fit_velocity(&t, Stamp::from_nanos(9_000_000_000)),
            Err(ImuError::TooFewPoses { .. })
        ));
    }
}
