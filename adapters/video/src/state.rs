//! Where an integration of inertial samples starts, for data sets that record poses but no velocities.

use nalgebra::Vector3;
use vice_core::error::{DataError, DataResult};
use vice_core::imu::{InertialState, fit_velocity};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;

/// How far apart two poses may be to read one between them (method page: 0.1 s).
const MAX_GAP: Span = Span::from_millis(100);

/// The state at a stamp: the pose between its neighbours, the velocity given (m/s, world frame) or that of
/// [`fit_velocity`], and no biases. `None` where the trajectory has no pose at that stamp.
///
/// # Errors
/// [`DataError`] if too few poses are near to fit a velocity.
pub fn reference_state(
    trajectory: &Trajectory,
    stamp: Stamp,
    velocity_m_s: Option<Vector3<f64>>,
) -> DataResult<Option<InertialState>> {
    let Ok(world_from_body) = trajectory.pose_at(stamp, MAX_GAP) else { return Ok(None) };
    let velocity_m_s = match velocity_m_s {
        Some(velocity) => velocity,
        None => fit_velocity(trajectory, stamp)
            .map_err(|e| DataError::new("no velocity to start the integration with").because(e))?,
    };
    let none = Vector3::zeros();
    Ok(Some(InertialState {
        stamp,
        world_from_body,
        velocity_m_s,
        gyro_bias_rad_s: none,
        accel_bias_m_s2: none,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::frames::Rigid;

    #[test]
    fn a_state_needs_poses_around_it() {
        let poses = |n: i64| {
            Trajectory::from_poses((0..n).map(|i| {
                let x = 0.02 * i as f64;
                (
                    Stamp::from_nanos(i * 10_000_000),
                    Rigid::from_parts([x, 0.0, 0.0].into(), Default::default()),
                )
            }))
            .unwrap()
        };
        let at = Stamp::from_nanos(55_000_000);
        let state = reference_state(&poses(20), at, None).unwrap().unwrap();
        assert!((state.velocity_m_s - Vector3::new(2.0, 0.0, 0.0)).norm() < 1e-9);
        assert!((state.world_from_body.translation().x - 0.11).abs() < 1e-12);
        let given = reference_state(&poses(20), at, Some(Vector3::z())).unwrap().unwrap();
        assert_eq!(given.velocity_m_s, Vector3::z());
        assert_eq!(reference_state(&poses(3), at, None).unwrap(), None);
        let few = reference_state(&poses(3), Stamp::from_nanos(15_000_000), None).unwrap_err();
        assert!(few.to_string().contains("no velocity"));
    }
}
