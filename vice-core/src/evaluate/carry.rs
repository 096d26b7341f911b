//! A point carried through the frames of a segment and held against its labels, a register of labels at a time.

use nalgebra::{Point3, Vector3};
use pulp::Simd;

use crate::camera::{Bound, Camera, Distortion, Pixel, with_lens};
use crate::frames::{Motion, Varying, WorldFromCamera};
use crate::lanes::{Kernel, Lanes, Masked, Number, run};

/// Bits of a double that a float has not.
const BEYOND_FLOAT: u64 = (1 << 29) - 1;
/// An angle of the kernel is within so many units in the last place of that of the standard library.
const UNITS: u64 = 64;

/// Where a point is carried, and how far that is from its labels, label by label.
#[derive(Default)]
pub(super) struct Carried {
    /// The carried point's pixel; NaN where it has none.
    pub(super) tracked_px: [Vec<f64>; 2],
    /// Angle between the rays of the two, radians, and distance of the two at the carried point's depth, metres; NaN where
    /// the label has no ray.
    pub(super) angle_rad: Vec<f64>,
    pub(super) offset_m: Vec<f64>,
    pub(super) valid: Vec<bool>,
}

/// The point that is carried.
#[derive(Clone, Copy)]
pub(super) struct Start<'a> {
    pub(super) camera: &'a Camera,
    pub(super) at_keyframe: &'a WorldFromCamera,
    pub(super) point_camera_m: Point3<f64>,
}

impl Carried {
    /// Fills it: `camera_from_world` as [`crate::track::CameraPath`] has it, labels in pixels.
    pub(super) fn fill(&mut self, start: &Start<'_>, camera_from_world: [&[f64]; 7], label_px: [&[f64]; 2]) {
        let n = label_px[0].len();
        let Self { tracked_px: [u, v], angle_rad, offset_m, valid } = self;
        for column in [&mut *u, &mut *v, angle_rad, offset_m] {
            column.resize(n, 0.0);
        }
        valid.resize(n, false);
        let [i, j, k, w, x, y, z] = camera_from_world;
        let input = [i, j, k, w, x, y, z, label_px[0], label_px[1]];
        let (at_keyframe, point_m) = (Motion::new(start.at_keyframe), start.point_camera_m.into());
        let output = [&mut u[..], &mut v[..], &mut angle_rad[..], &mut offset_m[..]];
        with_lens!(start.camera, bound => {
            let kernel = Compare { bound, at_keyframe, point_m };
            run("carry", kernel, input, output, Some(&mut valid[..]));
            for (place, angle) in angle_rad.iter_mut().enumerate() {
                if is_near_tie(*angle) {
                    let exact = kernel.single([0.0; 4], input.map(|column| column[place]));
                    *angle = exact.map_or(*angle, |[_, _, exact, _]| exact);
                }
            }
        });
    }
}

/// Whether an angle's float may be another than that of the same angle by the standard library.
#[inline]
fn is_near_tie(angle: f64) -> bool {
    let rest = angle.to_bits() & BEYOND_FLOAT;
    rest.abs_diff(1 << 28) <= UNITS || (angle != 0.0 && angle < f64::from(f32::MIN_POSITIVE))
}

#[derive(Clone, Copy)]
struct Compare<D> {
    bound: Bound<D>,
    at_keyframe: Motion,
    point_m: [f64; 3],
}

impl<D: Distortion> Kernel<9, 4> for Compare<D> {
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: [Lanes<S>; 4], input: [Lanes<S>; 9]) -> Masked<S, 4> {
        let [i, j, k, w, tx, ty, tz, u, v] = input;
        let point = Varying::of([i, j, k, w, tx, ty, tz]).times(&self.at_keyframe).apply(self.point_m);
        let ([tracked_u, tracked_v], valid) = self.bound.project(point);
        let ([rx, ry], has_ray, unsure) = self.bound.unproject([u, v]);
        let [x, y, z] = point;
        // The cross product and the product with the ray (rx, ry, 1).
        let (a, b, c) = (y - z * ry, z * rx - x, x * ry - y * rx);
        let along = x * rx + y * ry + z;
        let angle = ((a * a + b * b + c * c).sqrt() / along).atan();
        let (du, dv) = (x - z * rx, y - z * ry);
        let offset = (du * du + dv * dv).sqrt();
        let nan = u.of(f64::NAN);
        let ahead = u.of(0.0).below(along);
        // A right angle and more is left to the formula for one label.
        let sure = u.both(u.negated(unsure), ahead);
        Masked {
            numbers: [
                tracked_u,
                tracked_v,
                Lanes::select(has_ray, angle, nan),
                Lanes::select(has_ray, offset, nan),
            ],
            valid,
            unsure: Some(u.both(u.negated(sure), valid)),
        }
    }

    fn single(&self, _: [f64; 4], input: [f64; 9]) -> Option<[f64; 4]> {
        let [i, j, k, w, tx, ty, tz, u, v] = input;
        let point = Varying::of([i, j, k, w, tx, ty, tz]).times(&self.at_keyframe).apply(self.point_m);
        let camera = self.bound.camera();
        let tracked = camera.project(&Point3::from(point)).ok()?;
        let (mut angle_rad, mut offset_m) = (f64::NAN, f64::NAN);
        if let Ok(ray) = camera.unproject(Pixel::new(u, v)) {
            let point = Vector3::from(point);
            angle_rad = point.cross(&ray).norm().atan2(point.dot(&ray));
            offset_m = (point - point.z * ray).norm();
        }
        Some([tracked.u, tracked.v, angle_rad, offset_m])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::lenses;
    use crate::frames::Rigid;
    use crate::track::{CameraPath, track};
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn each_label_is_that_of_one_by_one(
            motions in prop::collection::vec((prop::array::uniform6(-0.5..0.5_f64), -400.0..1200.0_f64, -300.0..900.0_f64), 1..60),
            z in 0.3..9.0_f64,
        ) {
            let pose = |n: [f64; 6]| -> WorldFromCamera {
                Rigid::from_parts([n[0], n[1], n[2]].into(), UnitQuaternion::from_scaled_axis([n[3], n[4], n[5]].into()))
            };
            let at_keyframe = pose([0.1, -0.2, 0.3, 0.05, 0.1, -0.2]);
            let point_camera_m = Point3::new(0.1 * z, -0.2 * z, z);
            let path = CameraPath::new(motions.iter().map(|m| Some(pose(m.0))));
            let (u, v): (Vec<f64>, Vec<f64>) = motions.iter().map(|m| (m.1, m.2)).unzip();
            for (name, camera) in lenses() {
                let start = Start { camera: &camera, at_keyframe: &at_keyframe, point_camera_m };
                let mut carried = Carried::default();
                carried.fill(&start, path.columns(0..u.len()), [&u, &v]);
                for (i, (motion, label, _)) in motions.iter().map(|m| (m.0, Pixel::new(m.1, m.2), ())).enumerate() {
                    let now = pose(motion);
                    let single = track(&camera, &at_keyframe, &now, &point_camera_m).ok();
                    prop_assert_eq!(carried.valid[i], single.is_some(), "{}", name);
                    let Some(px) = single else { continue };
                    let tracked = [carried.tracked_px[0][i], carried.tracked_px[1][i]];
                    prop_assert_eq!(tracked.map(f64::to_bits), [px.u, px.v].map(f64::to_bits), "{}", name);
                    let local = (now.inverse() * at_keyframe).transform_point(&point_camera_m).coords;
                    let expected = camera.unproject(label).map(|ray| {
                        let angle = local.cross(&ray).norm().atan2(local.dot(&ray));
                        [angle as f32, (local - local.z * ray).norm() as f32]
                    });
                    let expected = expected.unwrap_or([f32::NAN; 2]);
                    let found = [carried.angle_rad[i] as f32, carried.offset_m[i] as f32];
                    prop_assert_eq!(found.map(f32::to_bits), expected.map(f32::to_bits), "{}", name);
                }
            }
        }
    }

    #[test]
    fn ties_of_floats_are_noticed() {
        let middle = f64::from_bits(0.1_f32.to_bits() as u64).max(f64::from(0.1_f32));
        let half = f64::from_bits(middle.to_bits() | (1 << 28));
        assert!(is_near_tie(half) && is_near_tie(f64::from_bits(half.to_bits() - 3)));
        assert!(!is_near_tie(middle) && !is_near_tie(0.0) && is_near_tie(1e-40) && !is_near_tie(f64::NAN));
    }
}
