//! From the poses as read to the poses that were meant.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::Convention;
use crate::error::{DataError, DataResult, ErrorKind};
use crate::frames::{BodyFromCamera, Rigid, WorldFromBody};
use crate::time::Stamp;
use crate::trajectory::Trajectory;

/// What some cures need beside the poses.
#[derive(Clone, Copy, Default)]
pub struct Given<'a> {
    /// Extrinsics at a stamp: for `camera` and `body`.
    pub body_from_camera: Option<&'a (dyn Fn(Stamp) -> Option<BodyFromCamera> + Sync)>,
    /// The camera's first frame: for `from-zero`.
    pub first_frame: Option<Stamp>,
}

/// The poses that were meant, of poses that are all of these: in whatever order they are named, the quaternion is put
/// right first, then units, then inversion, then axes, the frame and the stamps.
///
/// # Errors
/// [`DataError`] if a convention cannot be mended or lacks what it needs.
pub fn cure(conventions: &[Convention], trajectory: &Trajectory, given: Given<'_>) -> DataResult<Trajectory> {
    let mut ordered = conventions.to_vec();
    ordered.sort_unstable();
    let mut cured = None;
    for convention in ordered {
        cured = Some(convention.cured(cured.as_ref().unwrap_or(trajectory), given)?);
    }
    Ok(cured.unwrap_or_else(|| trajectory.clone()))
}

impl Convention {
    /// The poses that were meant. See [`cure`] for several.
    ///
    /// # Errors
    /// As [`cure`].
    pub fn cured(self, trajectory: &Trajectory, given: Given<'_>) -> DataResult<Trajectory> {
        let unit = self.unit_m();
        let scaled = |pose: WorldFromBody, m: f64| Rigid::from_parts(pose.translation() * m, pose.rotation());
        let turned = |pose: WorldFromBody, rotation: UnitQuaternion<f64>| {
            Rigid::from_parts(pose.translation(), rotation)
        };
        let map = |f: &dyn Fn(WorldFromBody) -> WorldFromBody| trajectory.map_poses(|_, pose| f(pose));
        Ok(match self {
            Self::WFirst => map(&|pose| {
                let read = pose.rotation().coords;
                turned(pose, unit_quaternion(read.x, read.y, read.z, read.w))
            }),
            Self::WLast => map(&|pose| {
                let read = pose.rotation().coords;
                turned(pose, unit_quaternion(read.z, read.w, read.x, read.y))
            }),
            Self::ConjugateQuaternion => map(&|pose| turned(pose, pose.rotation().inverse())),
            Self::Radians => map(&|pose| {
                let (roll, pitch, yaw) = pose.rotation().euler_angles();
                let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
                turned(pose, UnitQuaternion::from_euler_angles(roll, pitch, yaw))
            }),
            Self::Millimetres | Self::Centimetres | Self::Feet | Self::Inches => {
                map(&|pose| scaled(pose, unit.unwrap_or(1.0)))
            }
            Self::InversePose => map(&|pose| pose.inverse().reinterpret()),
            Self::AxisOrder(axes) => {
                map(&|pose| Rigid::from_parts(axes.apply(&pose.translation()), pose.rotation()))
            }
            Self::LeftHanded(axis) => {
                let mut mirror = Matrix3::identity();
                let at = usize::from(axis.min(2));
                mirror[(at, at)] = -1.0;
                map(&|pose| mirrored(pose, &mirror))
            }
            Self::WorldAxes(axes) => {
                let turn = rotation(&axes.matrix())?;
                map(&|pose| Rigid::from_parts(turn * pose.translation(), turn * pose.rotation()))
            }
            Self::BodyAxes(axes) => {
                let back = rotation(&axes.matrix())?.inverse();
                map(&|pose| turned(pose, pose.rotation() * back))
            }
            Self::CameraAsBody => self.with_extrinsics(trajectory, given, |pose, camera| {
                pose * camera.inverse().reinterpret::<crate::frames::Body, crate::frames::Body>()
            })?,
            Self::BodyAsCamera => self.with_extrinsics(trajectory, given, |pose, camera| {
                pose * camera.reinterpret::<crate::frames::Body, crate::frames::Body>()
            })?,
            Self::StampsFromZero => {
                let first = given.first_frame.ok_or_else(|| self.lacks("the camera's frames"))?;
                let shift = first.since(trajectory.start());
                trajectory.shifted(shift).map_err(|e| self.lacks("stamps in range").because(e))?
            }
            Self::StampsInMicroseconds => self.longer_stamps(trajectory, 1_000)?,
            Self::StampsInMilliseconds => self.longer_stamps(trajectory, 1_000_000)?,
            Self::StampsInSeconds => self.longer_stamps(trajectory, 1_000_000_000)?,
            Self::Degrees | Self::FrozenRotation | Self::OtherCamera => {
                return Err(DataError::of_kind(
                    ErrorKind::Usage,
                    format!("`{self}` cannot be mended in poses: {}", self.words()),
                ));
            }
        })
    }

    fn with_extrinsics(
        self,
        trajectory: &Trajectory,
        given: Given<'_>,
        f: impl Fn(WorldFromBody, BodyFromCamera) -> WorldFromBody,
    ) -> DataResult<Trajectory> {
        let extrinsics = given.body_from_camera.ok_or_else(|| self.lacks("a camera with extrinsics"))?;
        let mut poses = Vec::with_capacity(trajectory.len());
        for (stamp, pose) in trajectory.iter() {
            let camera = extrinsics(stamp).ok_or_else(|| self.lacks("extrinsics at every pose"))?;
            poses.push((stamp, f(pose, camera)));
        }
        Trajectory::from_poses(poses).map_err(|e| self.lacks("finite extrinsics").because(e))
    }

    fn longer_stamps(self, trajectory: &Trajectory, times: i64) -> DataResult<Trajectory> {
        let poses = trajectory
            .iter()
            .map(|(stamp, pose)| {
                let nanos = stamp.as_nanos().checked_mul(times)?;
                Some((Stamp::from_nanos(nanos), pose))
            })
            .collect::<Option<Vec<_>>>()
            .ok_or_else(|| self.lacks("stamps in range"))?;
        Trajectory::from_poses(poses).map_err(|e| self.lacks("stamps in range").because(e))
    }

    fn lacks(self, what: &str) -> DataError {
        DataError::of_kind(ErrorKind::Usage, format!("`{self}` cannot be applied here: it needs {what}"))
    }
}

fn unit_quaternion(w: f64, x: f64, y: f64, z: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

fn mirrored(pose: WorldFromBody, mirror: &Matrix3<f64>) -> WorldFromBody {
    let (rotation, position): (Matrix3<f64>, Vector3<f64>) = pose.to_matrix_and_translation();
    let rotation = Rotation3::from_matrix_unchecked(mirror * rotation * mirror);
    Rigid::from_parts(mirror * position, UnitQuaternion::from_rotation_matrix(&rotation))
}

fn rotation(matrix: &Matrix3<f64>) -> DataResult<UnitQuaternion<f64>> {
    if matrix.determinant() < 0.5 {
        return Err(DataError::of_kind(
            ErrorKind::Usage,
            "axes that are mirrored are no rotation: use mirror-x, mirror-y or mirror-z",
        ));
    }
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*matrix)))
}

#[cfg(test)]
mod tests {
    use super::super::all;
    use super::*;
    use crate::frames::rotation_angle_rad;

    fn flight() -> Trajectory {
        let poses = (0..40).map(|i| {
            let t = 0.1 * f64::from(i);
            let turn = UnitQuaternion::from_euler_angles(0.003 * t.sin(), 0.002 * t, 0.01 * t);
            let at = Vector3::new(t.cos(), 2.0 * t.sin(), 1.0 + 0.2 * t);
            (Stamp::from_nanos(1_000_000_000 + 100_000_000 * i64::from(i)), Rigid::from_parts(at, turn))
        });
        Trajectory::from_poses(poses).unwrap()
    }

    fn extrinsics() -> BodyFromCamera {
        Rigid::from_parts(Vector3::new(0.1, -0.2, 0.05), UnitQuaternion::from_euler_angles(1.2, 0.4, -0.9))
    }

    /// What a file of this convention reads as; the way there is written down apart from the cure where there is one.
    fn misread(convention: Convention, right: &Trajectory) -> Trajectory {
        let map = |f: &dyn Fn(WorldFromBody) -> WorldFromBody| right.map_poses(|_, pose| f(pose));
        let times = |k: i64| {
            Trajectory::from_poses(right.iter().map(|(s, p)| (Stamp::from_nanos(s.as_nanos() / k), p)))
                .unwrap()
        };
        match convention {
            // x y z w of the reader are w x y z of the file.
            Convention::WFirst => map(&|p| {
                let q = p.rotation().coords;
                Rigid::from_parts(p.translation(), unit_quaternion(q.z, q.w, q.x, q.y))
            }),
            Convention::WLast => map(&|p| {
                let q = p.rotation().coords;
                Rigid::from_parts(p.translation(), unit_quaternion(q.x, q.y, q.z, q.w))
            }),
            Convention::Radians => map(&|p| {
                let (r, q, y) = p.rotation().euler_angles();
                let [r, q, y] = [r, q, y].map(f64::to_radians);
                Rigid::from_parts(p.translation(), UnitQuaternion::from_euler_angles(r, q, y))
            }),
            Convention::Millimetres => map(&|p| Rigid::from_parts(p.translation() * 1e3, p.rotation())),
            Convention::Centimetres => map(&|p| Rigid::from_parts(p.translation() * 1e2, p.rotation())),
            Convention::Feet => map(&|p| Rigid::from_parts(p.translation() / 0.3048, p.rotation())),
            Convention::Inches => map(&|p| Rigid::from_parts(p.translation() / 0.0254, p.rotation())),
            Convention::ConjugateQuaternion => {
                map(&|p| Rigid::from_parts(p.translation(), p.rotation().inverse()))
            }
            Convention::InversePose => map(&|p| p.inverse().reinterpret()),
            Convention::AxisOrder(axes) => {
                map(&|p| Rigid::from_parts(axes.matrix().transpose() * p.translation(), p.rotation()))
            }
            Convention::LeftHanded(axis) => map(&|p| {
                // A mirrored axis turns the other two components of the rotation's axis round.
                let signs = Vector3::from_fn(|i, _| if i == usize::from(axis) { 1.0 } else { -1.0 });
                let q = p.rotation().coords;
                let at = p.translation().component_mul(&-signs);
                Rigid::from_parts(at, unit_quaternion(q.w, q.x * signs.x, q.y * signs.y, q.z * signs.z))
            }),
            Convention::WorldAxes(axes) => map(&|p| {
                let turn = rotation(&axes.matrix().transpose()).unwrap();
                Rigid::from_parts(turn * p.translation(), turn * p.rotation())
            }),
            Convention::BodyAxes(axes) => {
                map(&|p| Rigid::from_parts(p.translation(), p.rotation() * rotation(&axes.matrix()).unwrap()))
            }
            Convention::CameraAsBody => map(&|p| p * extrinsics().reinterpret()),
            Convention::BodyAsCamera => map(&|p| p * extrinsics().inverse().reinterpret()),
            Convention::StampsFromZero => {
                right.shifted(crate::time::Span::from_nanos(-right.start().as_nanos())).unwrap()
            }
            Convention::StampsInMicroseconds => times(1_000),
            Convention::StampsInMilliseconds => times(1_000_000),
            Convention::StampsInSeconds => times(100_000_000),
            other => panic!("{other} has no cure"),
        }
    }

    #[test]
    fn a_cure_gives_back_what_was_meant() {
        let right = flight();
        let at = |_: Stamp| Some(extrinsics());
        let given = Given { body_from_camera: Some(&at), first_frame: Some(right.start()) };
        for convention in all().filter(|c| c.curable()) {
            if convention == Convention::StampsInSeconds {
                continue; // whole seconds cannot hold this flight's stamps
            }
            let cured = convention.cured(&misread(convention, &right), given).unwrap();
            for ((s, a), (t, b)) in right.iter().zip(cured.iter()) {
                assert_eq!(s, t, "{convention}");
                assert!((a.translation() - b.translation()).norm() < 1e-9, "{convention}");
                let turn = rotation_angle_rad(&(a.rotation().inverse() * b.rotation()));
                assert!(turn < 1e-9, "{convention}: {turn}");
            }
        }
    }

    #[test]
    fn the_order_of_the_list_does_not_matter() {
        let right = flight();
        let both = misread(Convention::WFirst, &misread(Convention::InversePose, &right));
        for list in
            [[Convention::WFirst, Convention::InversePose], [Convention::InversePose, Convention::WFirst]]
        {
            let cured = cure(&list, &both, Given::default()).unwrap();
            let off = cured.poses()[7].translation() - right.poses()[7].translation();
            assert!(off.norm() < 1e-9);
        }
        assert!(cure(&[Convention::FrozenRotation], &right, Given::default()).is_err());
        assert!(cure(&[Convention::CameraAsBody], &right, Given::default()).is_err());
    }
}
