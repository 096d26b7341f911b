//! Coordinate frames and the rigid transforms between them.
//!
//! | frame | meaning |
//! | --- | --- |
//! | [`World`] | the fixed global frame of one pose stream; z up, floor at z = 0 unless the data set says otherwise |
//! | [`Body`] | the agent: IMU or robot base |
//! | [`Camera`] | x right, y down, z forward |
//! | image | pixels; centres at integers, (0, 0) is the centre of the top left pixel |
//!
//! A transform carries its frames in its type and is named `dst_from_src`, the paper's `T^{dst,src}`: it takes
//! coordinates in `src` to coordinates in `dst`. Composition reads by itself and a wrong order does not compile:
//!
//! ```
//! use vice_core::frames::{Body, Camera, Rigid, World};
//! let world_from_body = Rigid::<World, Body>::identity();
//! let body_from_camera = Rigid::<Body, Camera>::identity();
//! let world_from_camera: Rigid<World, Camera> = world_from_body * body_from_camera;
//! ```
//!
//! ```compile_fail
//! use vice_core::frames::{Body, Camera, Rigid, World};
//! let world_from_body = Rigid::<World, Body>::identity();
//! let body_from_camera = Rigid::<Body, Camera>::identity();
//! let wrong = body_from_camera * world_from_body;
//! ```

use std::fmt;
use std::marker::PhantomData;
use std::ops::Mul;

mod batch;

pub(crate) use batch::{Motion, Varying, numbers_of};

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// The fixed global frame of a pose stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum World {}

/// The agent: IMU or robot base.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {}

/// The optical frame of a camera: x right, y down, z forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Camera {}

/// The frame in which a point cloud was scanned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cloud {}

/// The frame whose poses an estimate gives, where that is not the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensor {}

/// A rotation and translation (metres) that takes coordinates in `Src` to coordinates in `Dst`.
///
/// ```
/// use vice_core::frames::{BodyFromCamera, Rigid, WorldFromBody, WorldFromCamera};
/// use vice_core::nalgebra::{Point3, UnitQuaternion, Vector3};
///
/// // The body is 1 m up and turned a quarter to the left; the camera sits 0.1 m before its centre.
/// let quarter = UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
/// let world_from_body: WorldFromBody = Rigid::from_parts(Vector3::new(0.0, 0.0, 1.0), quarter);
/// let body_from_camera: BodyFromCamera = Rigid::from_parts(Vector3::new(0.1, 0.0, 0.0), UnitQuaternion::identity());
/// let world_from_camera: WorldFromCamera = world_from_body * body_from_camera;
/// let centre = world_from_camera.transform_point(&Point3::origin());
/// assert!((centre - Point3::new(0.0, 0.1, 1.0)).norm() < 1e-12);
/// ```
pub struct Rigid<Dst, Src> {
    isometry: Isometry3<f64>,
    frames: PhantomData<fn(Src) -> Dst>,
}

/// Pose of the body in the world.
pub type WorldFromBody = Rigid<World, Body>;
/// Pose of the camera in the body: the extrinsics.
pub type BodyFromCamera = Rigid<Body, Camera>;
/// Pose of the camera in the world.
pub type WorldFromCamera = Rigid<World, Camera>;

/// How far from unit length a quaternion may be and still be meant as a rotation (method page: 1e-3).
pub const UNIT_TOLERANCE: f64 = 1e-3;

/// Why numbers are no rigid transform.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// A number is NaN or infinite.
    #[error("{0} is not finite")]
    NotFinite(&'static str),
    /// The quaternion is not a unit quaternion.
    #[error("the quaternion has length {length:.6}, not 1 (within {UNIT_TOLERANCE})")]
    NotUnit {
        /// Its length.
        length: f64,
    },
    /// The matrix is not a rotation.
    #[error("the rotation matrix is off orthonormal by {off:.2e}{}", if *.mirrored { " and mirrored" } else { "" })]
    NotRotation {
        /// Largest entry of `RᵀR - I`.
        off: f64,
        /// Whether its determinant is negative.
        mirrored: bool,
    },
    /// The last row of a 4x4 matrix is not 0 0 0 1.
    #[error("the last row of the 4x4 matrix is not 0 0 0 1")]
    NotHomogeneous,
}

impl<Dst, Src> Rigid<Dst, Src> {
    /// Wraps an isometry that is known to take `Src` to `Dst`.
    pub const fn from_isometry(isometry: Isometry3<f64>) -> Self {
        Self { isometry, frames: PhantomData }
    }

    /// From a translation in metres and a unit quaternion.
    pub fn from_parts(translation_m: Vector3<f64>, rotation: UnitQuaternion<f64>) -> Self {
        Self::from_isometry(Isometry3::from_parts(Translation3::from(translation_m), rotation))
    }

    /// From numbers as files have them, checked.
    ///
    /// # Errors
    /// [`FrameError`] if a number is not finite or the quaternion is further than [`UNIT_TOLERANCE`] from unit length.
    pub fn try_from_parts(translation_m: [f64; 3], rotation_wxyz: [f64; 4]) -> Result<Self, FrameError> {
        if !translation_m.iter().all(|v| v.is_finite()) {
            return Err(FrameError::NotFinite("the translation"));
        }
        if !rotation_wxyz.iter().all(|v| v.is_finite()) {
            return Err(FrameError::NotFinite("the quaternion"));
        }
        let [w, x, y, z] = rotation_wxyz;
        let raw = Quaternion::new(w, x, y, z);
        let length = raw.norm();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            return Err(FrameError::NotUnit { length });
        }
        Ok(Self::from_parts(Vector3::from(translation_m), UnitQuaternion::from_quaternion(raw)))
    }

    /// From a row-major 4x4 matrix as calibration files have it; a rotation within 1e-3 is made orthonormal.
    ///
    /// # Errors
    /// [`FrameError`] if a number is not finite, the last row is not 0 0 0 1 or the 3x3 part is no rotation.
    pub fn try_from_row_major(m: &[f64; 16]) -> Result<Self, FrameError> {
        if !m.iter().all(|v| v.is_finite()) {
            return Err(FrameError::NotFinite("the 4x4 matrix"));
        }
        let last = [m[12], m[13], m[14], m[15] - 1.0];
        if last.iter().any(|v| v.abs() > 1e-6) {
            return Err(FrameError::NotHomogeneous);
        }
        let r = Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
        let off = (r.transpose() * r - Matrix3::identity()).abs().max();
        let mirrored = r.determinant() < 0.0;
        if off > UNIT_TOLERANCE || mirrored {
            return Err(FrameError::NotRotation { off, mirrored });
        }
        // The quaternion read off a nearly orthonormal matrix is renormalised: this is where the rounding of a
        // printed calibration ends up.
        let rotation = UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(r));
        let rotation = UnitQuaternion::new_normalize(rotation.into_inner());
        Ok(Self::from_parts(Vector3::new(m[3], m[7], m[11]), rotation))
    }

    /// No rotation and no translation.
    pub fn identity() -> Self {
        Self::from_isometry(Isometry3::identity())
    }

    /// The transform the other way round.
    pub fn inverse(&self) -> Rigid<Src, Dst> {
        Rigid::from_isometry(self.isometry.inverse())
    }

    /// Coordinates in `Dst` of a point given in `Src`, metres.
    pub fn transform_point(&self, point: &Point3<f64>) -> Point3<f64> {
        self.isometry.transform_point(point)
    }

    /// Components in `Dst` of a direction given in `Src`.
    pub fn rotate(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        self.isometry.rotation.transform_vector(direction)
    }

    /// The origin of `Src` in `Dst`, metres.
    pub fn translation(&self) -> Vector3<f64> {
        self.isometry.translation.vector
    }

    /// The rotation part.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.isometry.rotation
    }

    /// The underlying isometry.
    pub const fn isometry(&self) -> &Isometry3<f64> {
        &self.isometry
    }

    /// The same motion under other frame names, where two frames are known to coincide.
    pub fn reinterpret<NewDst, NewSrc>(&self) -> Rigid<NewDst, NewSrc> {
        Rigid::from_isometry(self.isometry)
    }

    /// Rotation matrix and translation, for loops over many points.
    pub fn to_matrix_and_translation(&self) -> (Matrix3<f64>, Vector3<f64>) {
        (self.isometry.rotation.to_rotation_matrix().into_inner(), self.isometry.translation.vector)
    }

    /// The row-major 4x4 matrix.
    pub fn to_row_major(&self) -> [f64; 16] {
        let (r, t) = self.to_matrix_and_translation();
        let mut m = [0.0; 16];
        for row in 0..3 {
            for col in 0..3 {
                m[4 * row + col] = r[(row, col)];
            }
            m[4 * row + 3] = t[row];
        }
        m[15] = 1.0;
        m
    }
}

/// Rotation vector of a unit quaternion, with the angle by atan2 so that tiny and near-π angles survive.
///
/// The vector's length is in `[0, π]` radians.
pub fn rotation_vector_rad(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    // q and -q are the same rotation: take the one with the short way round.
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    let v = Vector3::new(q.i, q.j, q.k) * sign;
    let s = v.norm();
    if s == 0.0 {
        return Vector3::zeros();
    }
    v * (2.0 * s.atan2(q.w * sign) / s)
}

/// Rotation angle `|Log(R)|` in `[0, π]` radians, by atan2.
pub fn rotation_angle_rad(rotation: &UnitQuaternion<f64>) -> f64 {
    let q = rotation.quaternion();
    let s = Vector3::new(q.i, q.j, q.k).norm();
    2.0 * s.atan2(q.w.abs())
}

impl<Dst, Src> Clone for Rigid<Dst, Src> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<Dst, Src> Copy for Rigid<Dst, Src> {}

impl<Dst, Src> PartialEq for Rigid<Dst, Src> {
    fn eq(&self, other: &Self) -> bool {
        self.isometry == other.isometry
    }
}

impl<Dst, Src> fmt::Debug for Rigid<Dst, Src> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let t = self.translation();
        let q = self.isometry.rotation;
        write!(f, "Rigid(t = [{}, {}, {}], q_wxyz = [{}, {}, {}, {}])", t.x, t.y, t.z, q.w, q.i, q.j, q.k)
    }
}

impl<A, B, C> Mul<Rigid<B, C>> for Rigid<A, B> {
    type Output = Rigid<A, C>;
    fn mul(self, rhs: Rigid<B, C>) -> Rigid<A, C> {
        Rigid::from_isometry(self.isometry * rhs.isometry)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_point_goes_there_and_back() {
        let t = Rigid::<World, Body>::try_from_parts([1.0, -2.0, 0.5], [0.5, 0.5, -0.5, 0.5]).unwrap();
        let p = Point3::new(0.3, 0.2, 0.1);
        assert_relative_eq!(t.inverse().transform_point(&t.transform_point(&p)), p, epsilon = 1e-15);
        let again = Rigid::<World, Body>::try_from_row_major(&t.to_row_major()).unwrap();
        assert_relative_eq!(
            again.isometry().to_homogeneous(),
            t.isometry().to_homogeneous(),
            epsilon = 1e-15
        );
    }

    #[test]
    fn bad_numbers_are_named() {
        type T = Rigid<World, Body>;
        assert!(matches!(
            T::try_from_parts([f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]),
            Err(FrameError::NotFinite(_))
        ));
        assert!(matches!(
            T::try_from_parts([0.0; 3], [1.01, 0.0, 0.0, 0.0]),
            Err(FrameError::NotUnit { .. })
        ));
        assert!(T::try_from_parts([0.0; 3], [1.0009, 0.0, 0.0, 0.0]).is_ok());
        let mut mirrored = T::identity().to_row_major();
        mirrored[0] = -1.0;
        assert!(matches!(
            T::try_from_row_major(&mirrored),
            Err(FrameError::NotRotation { mirrored: true, .. })
        ));
    }

    #[test]
    fn small_and_large_angles_survive() {
        for angle in [1e-12, 1e-8, 0.1, 3.0, std::f64::consts::PI - 1e-9] {
            let q = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, angle, 0.0));
            assert_relative_eq!(rotation_angle_rad(&q), angle, max_relative = 1e-12);
            assert_relative_eq!(rotation_vector_rad(&q).y, angle, max_relative = 1e-12);
            let minus = UnitQuaternion::new_unchecked(-q.into_inner());
            assert_relative_eq!(rotation_angle_rad(&minus), angle, max_relative = 1e-12);
        }
    }
}
