//! The core's values as those of the contract.

use vice_core::camera::{Camera, Model};
use vice_core::dataset::{Floor, PixelFormat};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::Rigid;
use vice_core::imu::{ImuSample, InertialState};
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

use crate::contract;

/// A rigid transform.
pub fn rigid<A, B>(a_from_b: &Rigid<A, B>) -> contract::Rigid {
    let q = a_from_b.rotation();
    contract::Rigid { translation_m: a_from_b.translation().into(), rotation_wxyz: [q.w, q.i, q.j, q.k] }
}

/// A camera.
pub fn camera(camera: &Camera) -> contract::Camera {
    let [fx_px, fy_px, cx_px, cy_px] = camera.fx_fy_cx_cy();
    let given = camera.model().coefficients();
    let mut coefficients = [0.0; contract::MAX_COEFFICIENTS];
    for (to, from) in coefficients.iter_mut().zip(&given) {
        *to = *from;
    }
    contract::Camera {
        width_px: camera.width(),
        height_px: camera.height(),
        fx_px,
        fy_px,
        cx_px,
        cy_px,
        model: match camera.model() {
            Model::Pinhole => contract::MODEL_PINHOLE,
            Model::Radtan(_) => contract::MODEL_RADTAN,
            Model::Rational(_) => contract::MODEL_RATIONAL,
            Model::Equidistant(_) => contract::MODEL_EQUIDISTANT,
            Model::DoubleSphere(_) => contract::MODEL_DS,
            Model::ExtendedUnified(_) => contract::MODEL_EUCM,
            Model::Omnidirectional(_) => contract::MODEL_OMNI,
            Model::FieldOfView(_) => contract::MODEL_FOV,
        },
        coefficient_count: given.len() as u32,
        coefficients,
    }
}

/// What the bytes of an image are.
///
/// # Errors
/// [`DataError`] for pixels that the contract has no word for.
pub fn pixel_format(format: PixelFormat) -> DataResult<i32> {
    match format {
        PixelFormat::Gray8 => Ok(contract::PIXELS_GRAY8),
        PixelFormat::Rgb8 => Ok(contract::PIXELS_RGB8),
        other => Err(DataError::new(format!("pixels {other:?} are unknown to the contract of plugins"))),
    }
}

/// Stamps in nanoseconds.
pub fn stamps(stamps: &[Stamp]) -> Vec<i64> {
    stamps.iter().map(|s| s.as_nanos()).collect()
}

/// The poses of a trajectory.
pub fn poses(trajectory: &Trajectory) -> Vec<contract::Pose> {
    trajectory
        .iter()
        .map(|(stamp, pose)| contract::Pose { stamp_ns: stamp.as_nanos(), world_from_body: rigid(&pose) })
        .collect()
}

/// Inertial samples.
pub fn imu(samples: &[ImuSample]) -> Vec<contract::ImuSample> {
    samples
        .iter()
        .map(|s| contract::ImuSample {
            stamp_ns: s.stamp.as_nanos(),
            gyro_body_rad_s: s.gyro_rad_s.into(),
            accel_body_m_s2: s.accel_m_s2.into(),
        })
        .collect()
}

/// An inertial state.
pub fn inertial_state(state: &InertialState) -> contract::InertialState {
    contract::InertialState {
        stamp_ns: state.stamp.as_nanos(),
        world_from_body: rigid(&state.world_from_body),
        velocity_world_m_s: state.velocity_m_s.into(),
        gyro_bias_body_rad_s: state.gyro_bias_rad_s.into(),
        accel_bias_body_m_s2: state.accel_bias_m_s2.into(),
    }
}

/// A floor.
///
/// # Errors
/// [`DataError`] for one that the contract has no word for.
pub fn floor(floor: &Floor) -> DataResult<contract::Floor> {
    let (frame, normal, d_m) = match floor {
        Floor::World(plane) => (contract::FLOOR_WORLD, plane.normal(), plane.d_m()),
        Floor::Body(plane) => (contract::FLOOR_BODY, plane.normal(), plane.d_m()),
        other => {
            return Err(DataError::new(format!("the floor {other:?} is unknown to the contract of plugins")));
        }
    };
    Ok(contract::Floor { frame, reserved: 0, normal: normal.into_inner().into(), d_m })
}
