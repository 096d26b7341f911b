//! From the data set's conventions to the core's: the only place where they meet.
#![doc = include_str!("ned.txt")]

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use vice_core::camera::{Camera, Model};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Body, BodyFromCamera, FrameError, Rigid, World, WorldFromBody};

use crate::layout::Side;

/// North, east, down: the frame of the motion capture.
pub(crate) enum Ned {}

/// A half turn about north.
pub(crate) fn world_from_ned() -> Rigid<World, Ned> {
    // Written out: the quaternion of a half turn is exact, cos(π/2) is not.
    let half_turn = UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0));
    Rigid::from_parts(Vector3::zeros(), half_turn)
}

/// A pose as the files have it: position in NED (m), quaternion `ned_from_body`, w first.
pub(crate) fn pose(position_m: [f64; 3], rotation_wxyz: [f64; 4]) -> Result<WorldFromBody, FrameError> {
    Ok(world_from_ned() * Rigid::<Ned, Body>::try_from_parts(position_m, rotation_wxyz)?)
}

/// A direction, velocity or the like given in NED.
pub(crate) fn direction(ned: [f64; 3]) -> Vector3<f64> {
    world_from_ned().rotate(&Vector3::from(ned))
}

/// What the IMU measures, in the body frame.
pub(crate) fn body_from_imu([x, y, z]: [f64; 3]) -> Vector3<f64> {
    Vector3::new(-y, x, z)
}

/// The virtual camera, the same for all sides.
pub(crate) fn camera() -> DataResult<Camera> {
    let focal_px = 665.107510106;
    Camera::new(1024, 768, [focal_px, focal_px, 511.5, 383.5], Model::Pinhole).map_err(DataError::of)
}

/// Where the cameras of the renderer sit.
pub(crate) fn body_from_camera(side: Side) -> DataResult<BodyFromCamera> {
    #[rustfmt::skip]
    let forward = |y_m| [
        0.0, 0.0, 1.0, 0.0,
        1.0, 0.0, 0.0, y_m,
        0.0, 1.0, 0.0, 0.0,
        0.0, 0.0, 0.0, 1.0,
    ];
    #[rustfmt::skip]
    let down = [
        0.0, -1.0, 0.0, 0.0,
        1.0, 0.0, 0.0, 0.0,
        0.0, 0.0, 1.0, 0.0,
        0.0, 0.0, 0.0, 1.0,
    ];
    let matrix = match side {
        Side::Left => forward(-0.05),
        Side::Right => forward(0.05),
        Side::Down => down,
    };
    BodyFromCamera::try_from_row_major(&matrix).map_err(DataError::of)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn down_becomes_up_and_the_body_stays() {
        let level = pose([1.0, 2.0, -1.2], [1.0, 0.0, 0.0, 0.0]).unwrap();
        assert_eq!(level.translation(), Vector3::new(1.0, -2.0, 1.2));
        assert_eq!(level.rotate(&Vector3::x()), Vector3::x(), "forward is north");
        assert_eq!(level.rotate(&Vector3::y()), -Vector3::y(), "right is east");
        assert_eq!(level.rotate(&Vector3::z()), -Vector3::z(), "the body's z points down");
        // What an accelerometer feels at rest points up.
        assert_eq!(level.rotate(&body_from_imu([0.0, 0.0, -9.81])).z, 9.81);
        assert_eq!(direction([0.5, 0.25, -2.0]), Vector3::new(0.5, -0.25, 2.0));
    }

    #[test]
    fn the_imu_is_turned_by_a_quarter() {
        assert_eq!(body_from_imu([1.0, 0.0, 0.0]), Vector3::y());
        assert_eq!(body_from_imu([0.0, 1.0, 0.0]), -Vector3::x());
    }

    #[test]
    fn cameras_look_where_their_names_say() {
        let ahead = |side, p: [f64; 3]| {
            body_from_camera(side).unwrap().inverse().transform_point(&Point3::from(p)).coords
        };
        let near = |a: Vector3<f64>, b: [f64; 3]| assert!((a - Vector3::from(b)).norm() < 1e-15, "{a}");
        // Five metres ahead, one to the right and half a metre down of the body.
        near(ahead(Side::Left, [5.0, 1.0, 0.5]), [1.05, 0.5, 5.0]);
        near(ahead(Side::Right, [5.0, 1.0, 0.5]), [0.95, 0.5, 5.0]);
        // The down camera's right is the body's right, its down the body's back.
        near(ahead(Side::Down, [-0.5, 1.0, 5.0]), [1.0, 0.5, 5.0]);
    }
}
