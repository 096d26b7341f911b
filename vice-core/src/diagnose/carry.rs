//! Points of the world held against their labels, a register of labels at a time.

use nalgebra::Point3;
use pulp::Simd;

use super::scene::Residual;
use crate::camera::{Bound, Camera, Distortion, Pixel, with_lens};
use crate::frames::{Varying, WorldFromCamera, numbers_of};
use crate::lanes::{Kernel, Lanes, Masked, run};

/// Labels that are worked on at a time: their columns stay in the nearest cache.
const BLOCK: usize = 256;
/// Numbers that a label is carried with: the camera's rotation and place in the world, the point there, and the label's
/// pixel.
const NUMBERS: usize = 12;

/// A label: where the camera is, its point in the world, metres, and its pixel.
pub(super) type Asked = (CameraNumbers, Point3<f64>, Pixel);

/// The numbers of a camera in the world as they are used: the quaternion of the inverse rotation, then the camera's place.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraNumbers([f64; 7]);

impl CameraNumbers {
    pub(super) fn of(camera: &WorldFromCamera) -> Self {
        let [i, j, k, w, x, y, z] = numbers_of(camera);
        Self([-i, -j, -k, w, x, y, z])
    }
}

/// Where each point is seen minus where its label is, pixels; NaN where it is not seen, or where nothing is known of it.
pub(super) fn residuals_px(
    camera: &Camera,
    labels: impl ExactSizeIterator<Item = Option<Asked>>,
) -> Vec<Residual> {
    let mut all = Vec::with_capacity(labels.len());
    with_lens!(camera, bound => fill(bound, labels, &mut all));
    all
}

fn fill<D: Distortion>(
    bound: Bound<D>,
    mut labels: impl ExactSizeIterator<Item = Option<Asked>>,
    all: &mut Vec<Residual>,
) {
    let mut input = [[0.0; BLOCK]; NUMBERS];
    let mut output = [[0.0; BLOCK]; 2];
    while labels.len() > 0 {
        let count = labels.len().min(BLOCK);
        for (place, label) in labels.by_ref().take(count).enumerate() {
            let mut set = |first: usize, numbers: &[f64]| {
                numbers.iter().enumerate().for_each(|(i, number)| input[first + i][place] = *number);
            };
            match label {
                Some((CameraNumbers(camera), point, px)) => {
                    set(0, &camera);
                    set(7, point.coords.as_slice());
                    set(10, &[px.u, px.v]);
                }
                // What is NaN has no pixel.
                None => set(7, &[f64::NAN; 3]),
            }
        }
        let [u, v] = output.each_mut().map(|column| &mut column[..count]);
        run("residuals", Off { bound }, input.each_ref().map(|column| &column[..count]), [u, v], None);
        let [u, v] = output.each_ref().map(|column| &column[..count]);
        all.extend(u.iter().zip(v).map(|(u, v)| Residual::new(*u, *v)));
    }
}

#[derive(Clone, Copy)]
struct Off<D> {
    bound: Bound<D>,
}

impl<D: Distortion> Kernel<NUMBERS, 2> for Off<D> {
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: [Lanes<S>; 2], input: [Lanes<S>; NUMBERS]) -> Masked<S, 2> {
        let [i, j, k, w, tx, ty, tz, x, y, z, label_u, label_v] = input;
        let local = Varying::turn([i, j, k, w], [x - tx, y - ty, z - tz]);
        let ([u, v], valid) = self.bound.project(local);
        Masked { numbers: [u - label_u, v - label_v], valid, unsure: None }
    }

    fn single(&self, _: [f64; 2], input: [f64; NUMBERS]) -> Option<[f64; 2]> {
        let [i, j, k, w, tx, ty, tz, x, y, z, label_u, label_v] = input;
        let local = Varying::turn([i, j, k, w], [x - tx, y - ty, z - tz]);
        let px = self.bound.camera().project(&Point3::from(local)).ok()?;
        Some([px.u - label_u, px.v - label_v])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::lenses;
    use crate::frames::Rigid;
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn each_label_is_that_of_one_by_one(
            labels in prop::collection::vec((prop::array::uniform6(-1.5..1.5_f64), prop::array::uniform3(-4.0..4.0_f64), 0.0..700.0_f64), 1..40),
            times in 1_usize..12,
        ) {
            for (name, camera) in lenses() {
                let asked: Vec<Option<(WorldFromCamera, Point3<f64>, Pixel)>> = (0..times)
                    .flat_map(|_| &labels)
                    .map(|(n, p, u)| {
                        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(n[3], n[4], n[5]));
                        let pose = Rigid::from_parts(Vector3::new(n[0], n[1], n[2]), turn);
                        (*u < 600.0).then(|| (pose, Point3::from(*p), Pixel::new(*u, 0.5 * u)))
                    })
                    .collect();
                let numbers = |label: &Option<(WorldFromCamera, Point3<f64>, Pixel)>| {
                    label.map(|(pose, point, px)| (CameraNumbers::of(&pose), point, px))
                };
                let found = residuals_px(&camera, asked.iter().map(numbers));
                prop_assert_eq!(found.len(), asked.len());
                for (found, label) in found.iter().zip(&asked) {
                    let expected = label.and_then(|(pose, point, px)| {
                        let local = pose.rotation().inverse() * (point.coords - pose.translation());
                        let seen = camera.project(&Point3::from(local)).ok()?;
                        Some([seen.u - px.u, seen.v - px.v])
                    });
                    match expected {
                        Some(expected) => prop_assert_eq!([found.x, found.y].map(f64::to_bits), expected.map(f64::to_bits), "{}", name),
                        None => prop_assert!(found.x.is_nan() && found.y.is_nan(), "{}", name),
                    }
                }
            }
        }
    }
}
