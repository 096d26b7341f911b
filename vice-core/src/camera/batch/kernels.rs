//! The formulas of a camera for a register of points. They follow [`Camera::project`], [`Camera::unproject`] and
//! [`crate::track::track`] operation by operation.

use nalgebra::{Point3, Vector3};
use pulp::Simd;

use super::super::solve;
use super::{Camera, Motion};
use crate::camera::{Distortion, Pixel};
use crate::frames::Varying;
use crate::lanes::{Kernel, Lanes, Masked, Number, Yes};

/// No distortion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pinhole;

impl Distortion for Pinhole {
    const DISTORTS: bool = false;

    #[inline(always)]
    fn distort<N: Number>(&self, x: N, y: N) -> (N, N) {
        (x, y)
    }

    #[inline(always)]
    fn distort_with_jacobian<N: Number>(&self, x: N, y: N) -> ((N, N), [N; 4]) {
        ((x, y), [x.of(1.0), x.of(0.0), x.of(0.0), x.of(1.0)])
    }

    fn max_radius(&self) -> f64 {
        f64::INFINITY
    }

    fn radial(&self, r: f64) -> f64 {
        r
    }
}

/// A camera whose lens is known at compile time.
#[derive(Clone, Copy)]
pub(crate) struct Bound<D> {
    camera: Camera,
    lens: D,
    /// What the squared radius is compared with: infinite ones are outside too.
    max_r2: f64,
    per_fx_fy: [f64; 2],
    quick_radius: f64,
}

impl<D: Distortion> Bound<D> {
    pub(crate) fn new(camera: &Camera, lens: D) -> Self {
        let max_r2 = (camera.max_radius * camera.max_radius).min(f64::MAX);
        let per_fx_fy = [1.0 / camera.fx, 1.0 / camera.fy];
        let quick_radius = solve::quick_radius(camera.max_radius);
        Self { camera: *camera, lens, max_r2, per_fx_fy, quick_radius }
    }

    /// The camera itself.
    pub(crate) const fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Pixel, and whether there is one.
    #[inline(always)]
    pub(crate) fn project<S: Simd>(&self, [x, y, z]: [Lanes<S>; 3]) -> ([Lanes<S>; 2], Yes<S>) {
        let (x, y) = (x / z, y / z);
        let r2 = x * x + y * y;
        let valid = z.both(z.of(0.0).below(z), r2.at_most(r2.of(self.max_r2)));
        let (xd, yd) = self.lens.distort(x, y);
        ([xd * self.camera.fx + self.camera.cx, yd * self.camera.fy + self.camera.cy], valid)
    }

    /// Ray, whether there is one, and where the single-point function must decide.
    #[inline(always)]
    pub(crate) fn unproject<S: Simd>(&self, [u, v]: [Lanes<S>; 2]) -> ([Lanes<S>; 2], Yes<S>, Yes<S>) {
        let c = &self.camera;
        let (xd, yd) = ((u - c.cx) * self.per_fx_fy[0], (v - c.cy) * self.per_fx_fy[1]);
        if !D::DISTORTS {
            let largest = u.of(f64::MAX);
            let finite = u.both(xd.abs().at_most(largest), yd.abs().at_most(largest));
            return ([xd, yd], finite, u.of(1.0).below(u.of(0.0)));
        }
        let (x, y, found) = self.lens.undistort_fast(&c.seed, self.quick_radius, (xd, yd));
        ([x, y], found, u.negated(found))
    }
}

/// Points of the camera frame to pixels.
#[derive(Clone, Copy)]
pub(super) struct Project<D> {
    pub(super) bound: Bound<D>,
}

impl<D: Distortion> Kernel<3, 2> for Project<D> {
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: [Lanes<S>; 2], xyz_m: [Lanes<S>; 3]) -> Masked<S, 2> {
        let (numbers, valid) = self.bound.project(xyz_m);
        Masked { numbers, valid, unsure: None }
    }

    fn single(&self, _: [f64; 2], xyz_m: [f64; 3]) -> Option<[f64; 2]> {
        self.bound.camera.project(&Point3::from(xyz_m)).ok().map(Into::into)
    }
}

/// Points of another frame to pixels.
#[derive(Clone, Copy)]
pub(super) struct ProjectMoved<D> {
    pub(super) bound: Bound<D>,
    pub(super) motion: Motion,
}

impl<D: Distortion> Kernel<3, 2> for ProjectMoved<D> {
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: [Lanes<S>; 2], xyz_m: [Lanes<S>; 3]) -> Masked<S, 2> {
        let (numbers, valid) = self.bound.project(self.motion.apply(xyz_m));
        Masked { numbers, valid, unsure: None }
    }

    fn single(&self, _: [f64; 2], xyz_m: [f64; 3]) -> Option<[f64; 2]> {
        self.bound.camera.project(&Point3::from(self.motion.apply(xyz_m))).ok().map(Into::into)
    }
}

/// Pixels to rays.
#[derive(Clone, Copy)]
pub(super) struct Unproject<D> {
    pub(super) bound: Bound<D>,
}

impl<D: Distortion> Kernel<2, 2> for Unproject<D> {
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: [Lanes<S>; 2], uv_px: [Lanes<S>; 2]) -> Masked<S, 2> {
        let (numbers, valid, unsure) = self.bound.unproject(uv_px);
        Masked { numbers, valid, unsure: Some(unsure) }
    }

    fn single(&self, _: [f64; 2], [u, v]: [f64; 2]) -> Option<[f64; 2]> {
        self.bound.camera.unproject(Pixel::new(u, v)).ok().map(|ray| [ray.x, ray.y])
    }
}

/// Equation 1: pixels of a key frame with their depth to pixels of a later frame.
#[derive(Clone, Copy)]
pub(crate) struct Track<D> {
    pub(crate) bound: Bound<D>,
    pub(crate) now_from_keyframe: Motion,
}

impl<D: Distortion> Kernel<1, 2> for Track<D> {
    #[inline(always)]
    fn lanes<S: Simd>(&self, uv_px: [Lanes<S>; 2], [z_m]: [Lanes<S>; 1]) -> Masked<S, 2> {
        let ([x, y], has_ray, unsure) = self.bound.unproject(uv_px);
        let point = self.now_from_keyframe.apply([x * z_m, y * z_m, z_m]);
        let (numbers, valid) = self.bound.project(point);
        Masked { numbers, valid: z_m.both(has_ray, valid), unsure: Some(unsure) }
    }

    fn single(&self, [u, v]: [f64; 2], [z_m]: [f64; 1]) -> Option<[f64; 2]> {
        let ray: Vector3<f64> = self.bound.camera.unproject(Pixel::new(u, v)).ok()?;
        let point = self.now_from_keyframe.apply([ray.x * z_m, ray.y * z_m, z_m]);
        self.bound.camera.project(&Point3::from(point)).ok().map(Into::into)
    }
}

/// Equation 1 the other way round: one point of a key frame in many cameras.
#[derive(Clone, Copy)]
pub(crate) struct TrackAlong<D> {
    pub(crate) bound: Bound<D>,
    pub(crate) at_keyframe: Motion,
    pub(crate) point_m: [f64; 3],
}

impl<D: Distortion> Kernel<7, 2> for TrackAlong<D> {
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: [Lanes<S>; 2], camera_from_world: [Lanes<S>; 7]) -> Masked<S, 2> {
        let point = Varying::of(camera_from_world).times(&self.at_keyframe).apply(self.point_m);
        let (numbers, valid) = self.bound.project(point);
        Masked { numbers, valid, unsure: None }
    }

    fn single(&self, _: [f64; 2], camera_from_world: [f64; 7]) -> Option<[f64; 2]> {
        let point = Varying::of(camera_from_world).times(&self.at_keyframe).apply(self.point_m);
        self.bound.camera.project(&Point3::from(point)).ok().map(Into::into)
    }
}
