//! The IMU, and velocity and biases of the ground truth.

use std::path::Path;
use std::sync::Arc;

use vice_core::error::{DataError, DataResult};
use vice_core::imu::{ImuSample, InertialState};
use vice_core::suspicion::Suspicions;
use vice_core::time::{Span, Stamp};
use vice_files::imu_file;
use vice_files::trajectory::{InertialRow, TrajectoryFile};

use crate::sensor;

/// Widest gap between rows of the ground truth across which its state is interpolated.
const MAX_GAP: Span = Span::from_millis(100);

/// Reads the samples of an IMU's folder, turned into the body frame by its `T_BS`.
///
/// The body of EuRoC is its IMU, so this is the identity there. A lever arm would need the angular acceleration, which
/// no sensor gives: it is refused.
pub(crate) fn samples(folder: &Path) -> DataResult<(Arc<[ImuSample]>, Suspicions)> {
    let body_from_sensor = sensor::body_from_sensor(folder)?;
    let lever_m = body_from_sensor.translation().norm();
    if lever_m > 1e-3 {
        return Err(DataError::new(format!("the IMU lies {lever_m:.3} m off the body's origin"))
            .at(folder.join(sensor::SENSOR_FILE))
            .hint("the body is expected to be the IMU"));
    }
    let path = folder.join("data.csv");
    let file = imu_file::read(&path)?;
    if file.samples.is_empty() {
        return Err(DataError::new("the list holds no samples").at(&path));
    }
    let turned = |s: &ImuSample| ImuSample {
        stamp: s.stamp,
        gyro_rad_s: body_from_sensor.rotate(&s.gyro_rad_s),
        accel_m_s2: body_from_sensor.rotate(&s.accel_m_s2),
    };
    Ok((file.samples.iter().map(turned).collect(), file.suspicions))
}

/// Pose, velocity and biases at a stamp: of the row there, or linear between its neighbours.
///
/// `None` where the file has no velocities, or no neighbours within 0.1 s.
pub(crate) fn state_at(file: &TrajectoryFile, stamp: Stamp) -> Option<InertialState> {
    let inertial = file.inertial.as_ref()?;
    let stamps = file.trajectory.stamps();
    let world_from_body = file.trajectory.pose_at(stamp, MAX_GAP).ok()?;
    let after = stamps.partition_point(|s| *s < stamp);
    let row = match stamps.get(after) {
        Some(at) if *at == stamp => *inertial.get(after)?,
        _ => {
            let before = after.checked_sub(1)?;
            let (t0, t1) = (stamps[before], *stamps.get(after)?);
            let fraction = stamp.since(t0).as_secs_f64() / t1.since(t0).as_secs_f64();
            between(inertial.get(before)?, inertial.get(after)?, fraction)
        }
    };
    Some(InertialState {
        stamp,
        world_from_body,
        velocity_m_s: row.velocity_m_s,
        gyro_bias_rad_s: row.gyro_bias_rad_s,
        accel_bias_m_s2: row.accel_bias_m_s2,
    })
}

fn between(a: &InertialRow, b: &InertialRow, fraction: f64) -> InertialRow {
    InertialRow {
        velocity_m_s: a.velocity_m_s.lerp(&b.velocity_m_s, fraction),
        gyro_bias_rad_s: a.gyro_bias_rad_s.lerp(&b.gyro_bias_rad_s, fraction),
        accel_bias_m_s2: a.accel_bias_m_s2.lerp(&b.accel_bias_m_s2, fraction),
    }
}
