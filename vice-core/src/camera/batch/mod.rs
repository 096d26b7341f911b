//! Many points at once, in structure-of-arrays form.
//!
//! The single-point functions are the definition; these give the same numbers for slices, without allocating, as fast
//! as memory brings the points ([`crate::lanes`] says how), equal to the last bit.
//!
//! Slices hold `f64` or `f32` ([`Element`]).

mod kernels;
mod rows;

use super::Camera;
use crate::frames::{self, Motion, Rigid};
use crate::lanes::{Element, run};

pub(crate) use kernels::{Bound, Pinhole, Track, TrackAlong};
use kernels::{Project, ProjectMoved, Unproject};

/// Runs an expression with `$bound` as the camera, its lens known at compile time.
macro_rules! with_lens {
    ($camera:expr, $bound:ident => $then:expr) => {{
        use $crate::camera::{Bound, Model, Pinhole};
        match $camera.model() {
            Model::Pinhole => {
                let $bound = Bound::new($camera, Pinhole);
                $then
            }
            Model::Radtan(lens) => {
                let $bound = Bound::new($camera, *lens);
                $then
            }
            Model::Rational(lens) => {
                let $bound = Bound::new($camera, *lens);
                $then
            }
            Model::Equidistant(lens) => {
                let $bound = Bound::new($camera, *lens);
                $then
            }
            Model::DoubleSphere(lens) => {
                let $bound = Bound::new($camera, *lens);
                $then
            }
            Model::ExtendedUnified(lens) => {
                let $bound = Bound::new($camera, *lens);
                $then
            }
            Model::Omnidirectional(lens) => {
                let $bound = Bound::new($camera, *lens);
                $then
            }
            Model::FieldOfView(lens) => {
                let $bound = Bound::new($camera, *lens);
                $then
            }
        }
    }};
}
pub(crate) use with_lens;

impl Camera {
    /// Projects the points `(x[i], y[i], z[i])` of the camera frame (metres) to the pixels `(u[i], v[i])`.
    ///
    /// Where a point does not project, `valid[i]` is false and the pixel NaN. Returns how many are valid.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn project_batch<T: Element>(
        &self,
        xyz_m: [&[T]; 3],
        uv_px: [&mut [T]; 2],
        valid: &mut [bool],
    ) -> usize {
        with_lens!(self, bound => run("project_batch", Project { bound }, xyz_m, uv_px, Some(valid)))
    }

    /// Projects points of another frame, which `camera_from_source` takes to the camera's: [`Rigid::transform_batch`]
    /// and [`Camera::project_batch`] in one pass over memory.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn project_from_batch<T: Element, F>(
        &self,
        camera_from_source: &Rigid<frames::Camera, F>,
        xyz_m: [&[T]; 3],
        uv_px: [&mut [T]; 2],
        valid: &mut [bool],
    ) -> usize {
        let motion = Motion::new(camera_from_source);
        with_lens!(self, bound => {
            run("project_from_batch", ProjectMoved { bound, motion }, xyz_m, uv_px, Some(valid))
        })
    }

    /// The rays `(x[i], y[i], 1)` of the pixels `(u[i], v[i])`.
    ///
    /// Where a pixel has no ray, `valid[i]` is false and the ray NaN. Returns how many are valid.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn unproject_batch<T: Element>(
        &self,
        uv_px: [&[T]; 2],
        xy: [&mut [T]; 2],
        valid: &mut [bool],
    ) -> usize {
        with_lens!(self, bound => run("unproject_batch", Unproject { bound }, uv_px, xy, Some(valid)))
    }
}

#[cfg(test)]
pub(super) mod tests;
