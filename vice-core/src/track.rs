//! Equation 1 of the paper: a key point carried along by ego-motion.
//!
//! At a key frame `k` the pixel is lifted with its depth, `p_camera = z (x, y, 1)`, and placed in the world of the pose
//! stream under evaluation, `p_world = world_from_body(k) body_from_camera(k) p_camera`. At a later frame `t` its pixel
//! is the projection of `(world_from_body(t) body_from_camera(t))⁻¹ p_world`. Only the motion between the two frames
//! enters, so that the stream's own world frame does not matter.

use std::ops::Range;

use nalgebra::Point3;

use crate::camera::{Camera, Pixel, ProjectError, Track, TrackAlong, UnprojectError, with_lens};
use crate::frames::{self, Motion, Rigid, WorldFromCamera, numbers_of};
use crate::lanes::{Element, run};

/// The scene point of a pixel: `z (x, y, 1)` in the camera frame, metres; `z_m` is along the optical axis.
///
/// # Errors
/// [`UnprojectError`] if the pixel has no ray.
pub fn lift(camera: &Camera, px: Pixel, z_m: f64) -> Result<Point3<f64>, UnprojectError> {
    Ok(Point3::from(camera.unproject(px)? * z_m))
}

/// Where the camera at a later frame sees a point that was lifted at a key frame.
///
/// `point_camera_m` is in the camera frame of the key frame. The two poses are of the same pose stream.
///
/// # Errors
/// [`ProjectError`] if the point has no pixel there. A pixel outside the image is no error.
pub fn track(
    camera: &Camera,
    at_keyframe: &WorldFromCamera,
    now: &WorldFromCamera,
    point_camera_m: &Point3<f64>,
) -> Result<Pixel, ProjectError> {
    let now_from_keyframe: Rigid<frames::Camera, frames::Camera> = now.inverse() * *at_keyframe;
    camera.project(&now_from_keyframe.transform_point(point_camera_m))
}

/// [`lift`] and [`track`] for many pixels of one key frame, in structure-of-arrays form and one pass over memory.
///
/// `uv_px` are pixels of the key frame, `z_m` their depths, metres. The tracked pixels replace them. Where a pixel has no ray
/// or its point no pixel, `valid[i]` is false and the pixel NaN. Returns how many are valid.
///
/// # Panics
/// If the slices differ in length.
pub fn track_batch<T: Element>(
    camera: &Camera,
    at_keyframe: &WorldFromCamera,
    now: &WorldFromCamera,
    uv_px: [&mut [T]; 2],
    z_m: &[T],
    valid: &mut [bool],
) -> usize {
    let now_from_keyframe: Rigid<frames::Camera, frames::Camera> = now.inverse() * *at_keyframe;
    let now_from_keyframe = Motion::new(&now_from_keyframe);
    with_lens!(camera, bound => {
        run("track_batch", Track { bound, now_from_keyframe }, [z_m], uv_px, Some(valid))
    })
}

/// Where a camera was over time, in structure-of-arrays form: what [`track_along`] carries a point through.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraPath {
    /// The world in the camera: i, j, k, w of the unit quaternion, then the translation, metres; NaN where it is not known.
    columns: [Vec<f64>; 7],
}

impl CameraPath {
    /// The poses of a camera in order; `None` where one is not known.
    pub fn new(cameras: impl IntoIterator<Item = Option<WorldFromCamera>>) -> Self {
        let mut path = Self::default();
        for camera in cameras {
            let numbers = camera.map_or([f64::NAN; 7], |camera| numbers_of(&camera.inverse()));
            path.columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
        }
        path
    }

    /// How many poses.
    pub fn len(&self) -> usize {
        self.columns[0].len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The poses at some places.
    pub(crate) fn some(&self, places: impl Iterator<Item = usize> + Clone) -> Self {
        Self {
            columns: self
                .columns
                .each_ref()
                .map(|column| places.clone().map(|place| column[place]).collect()),
        }
    }

    /// Some of them, as numbers.
    pub(crate) fn columns(&self, range: Range<usize>) -> [&[f64]; 7] {
        self.columns.each_ref().map(|column| &column[range.clone()])
    }
}

/// [`track`] of one point to many cameras, in structure-of-arrays form.
///
/// `point_camera_m` is in the camera frame of the key frame. The pixels at the poses `range` of the path are written to `uv_px`;
/// where the point has none, or the pose is not known, `valid[i]` is false and the pixel NaN. Returns how many are valid.
///
/// # Panics
/// If the slices and the range differ in length, or the range ends behind the path.
pub fn track_along(
    camera: &Camera,
    at_keyframe: &WorldFromCamera,
    point_camera_m: &Point3<f64>,
    (path, range): (&CameraPath, Range<usize>),
    uv_px: [&mut [f64]; 2],
    valid: &mut [bool],
) -> usize {
    let (at_keyframe, point_m) = (Motion::new(at_keyframe), (*point_camera_m).into());
    with_lens!(camera, bound => {
        let kernel = TrackAlong { bound, at_keyframe, point_m };
        run("track_along", kernel, path.columns(range), uv_px, Some(valid))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Model;
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn camera() -> Camera {
        let model =
            Model::from_name("radtan", &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]).unwrap();
        Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], model).unwrap()
    }

    fn any_pose(reach: f64) -> impl Strategy<Value = WorldFromCamera> {
        let numbers = prop::array::uniform6(-1.0..1.0_f64);
        numbers.prop_map(move |n| {
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(n[3], n[4], n[5]) * reach);
            Rigid::from_parts(Vector3::new(n[0], n[1], n[2]) * reach, rotation)
        })
    }

    proptest! {
        #[test]
        fn without_motion_a_point_stays(pose in any_pose(3.0), u in 5.0..740.0_f64, v in 5.0..470.0_f64, z in 0.1..30.0_f64) {
            let c = camera();
            let p = lift(&c, Pixel::new(u, v), z).unwrap();
            prop_assert!((p.z - z).abs() < 1e-12 * z);
            let px = track(&c, &pose, &pose, &p).unwrap();
            prop_assert!(px.distance_px(Pixel::new(u, v)) < 1e-7);
        }

        #[test]
        fn the_world_frame_does_not_matter(
            other_from_world in any_pose(5.0), k in any_pose(0.3), t in any_pose(0.3), z in 1.0..8.0_f64,
        ) {
            let c = camera();
            let p = lift(&c, Pixel::new(300.0, 200.0), z).unwrap();
            let other: Rigid<frames::World, frames::World> = other_from_world.reinterpret();
            let (a, b) = (track(&c, &k, &t, &p), track(&c, &(other * k), &(other * t), &p));
            match (a, b) {
                (Ok(a), Ok(b)) => prop_assert!(a.distance_px(b) < 1e-6),
                (a, b) => prop_assert_eq!(a.is_err(), b.is_err()),
            }
        }

        #[test]
        fn the_batch_is_the_single_point(k in any_pose(0.3), t in any_pose(0.3), zs in prop::collection::vec(-1.0..8.0_f64, 1..20)) {
            let c = camera();
            let n = zs.len();
            let us: Vec<f64> = (0..n).map(|i| 40.0 * i as f64 - 30.0).collect();
            let (mut u, mut v, mut valid) = (us.clone(), vec![200.0; n], vec![true; n]);
            track_batch(&c, &k, &t, [&mut u, &mut v], &zs, &mut valid);
            for i in 0..n {
                let single = lift(&c, Pixel::new(us[i], 200.0), zs[i]).ok().and_then(|p| track(&c, &k, &t, &p).ok());
                prop_assert_eq!(valid[i], single.is_some());
                if let Some(px) = single {
                    prop_assert_eq!(px, Pixel::new(u[i], v[i]));
                }
            }
        }

        #[test]
        fn along_a_path_it_is_the_single_point(
            k in any_pose(0.3), path in prop::collection::vec(prop::option::of(any_pose(0.6)), 1..40), z in 0.3..8.0_f64,
        ) {
            for (name, c) in crate::camera::lenses() {
                let p = Point3::new(0.2 * z, -0.1 * z, z);
                let n = path.len();
                let (mut u, mut v, mut valid) = (vec![1.0; n + 1], vec![1.0; n + 1], vec![true; n + 1]);
                let all = CameraPath::new(std::iter::once(None).chain(path.iter().copied()));
                let count = track_along(&c, &k, &p, (&all, 1..n + 1), [&mut u[1..], &mut v[1..]], &mut valid[1..]);
                prop_assert_eq!(count, valid[1..].iter().filter(|v| **v).count());
                for (i, now) in path.iter().enumerate() {
                    let single = now.and_then(|now| track(&c, &k, &now, &p).ok());
                    prop_assert_eq!(valid[i + 1], single.is_some(), "{}", name);
                    match single {
                        Some(px) => {
                            let (a, b) = ([u[i + 1], v[i + 1]], [px.u, px.v]);
                            prop_assert_eq!(a.map(f64::to_bits), b.map(f64::to_bits), "{}", name);
                        }
                        None => prop_assert!(u[i + 1].is_nan() && v[i + 1].is_nan()),
                    }
                }
            }
        }
    }
}
