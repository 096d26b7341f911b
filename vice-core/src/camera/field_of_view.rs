//! Field of view (Devernay and Faugeras 2001), also ATAN: with `k = 2 tan(w/2)`, `r' = atan(k r)/w` and
//! `(x', y') = r'/r (x, y)`. The inverse has a closed form.

use std::f64::consts::FRAC_PI_2;

use super::seed::Seed;
use super::{Distortion, UnprojectError, solve};
use crate::lanes::Number;

/// Field of view: the angle of the ideal fisheye, radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOfView {
    w: f64,
    /// `2 tan(w/2)`.
    k: f64,
}

/// Below this radius the scale is that of the axis to the last bit, and the quotient of small numbers is not.
const NEAR_AXIS: f64 = 1e-12;

impl FieldOfView {
    /// The lens of an angle in radians, above 0 and below π.
    pub fn new(w: f64) -> Self {
        Self { w, k: 2.0 * (0.5 * w).tan() }
    }

    /// The angle, radians.
    pub const fn w(&self) -> f64 {
        self.w
    }

    #[inline(always)]
    fn scale<N: Number>(&self, r: N) -> N {
        N::select(r.at_most(r.of(NEAR_AXIS)), r.of(self.k / self.w), (r * self.k).atan() / (r * self.w))
    }

    /// The ray of a place in the distorted plane, and whether the model reaches the place.
    #[inline(always)]
    fn lift<N: Number>(&self, xd: N, yd: N) -> (N, N, N::Mask) {
        let rd = (xd * xd + yd * yd).sqrt();
        let angle = rd * self.w;
        let on_axis = rd.at_most(rd.of(NEAR_AXIS));
        let scale = N::select(on_axis, rd.of(self.w / self.k), angle.tan() / (rd * self.k));
        (xd * scale, yd * scale, angle.below(angle.of(FRAC_PI_2)))
    }
}

impl Distortion for FieldOfView {
    #[inline(always)]
    fn distort<N: Number>(&self, x: N, y: N) -> (N, N) {
        let scale = self.scale((x * x + y * y).sqrt());
        (x * scale, y * scale)
    }

    #[inline(always)]
    fn distort_with_jacobian<N: Number>(&self, x: N, y: N) -> ((N, N), [N; 4]) {
        let s = x * x + y * y;
        let r = s.sqrt();
        let scale = self.scale(r);
        let rate = s.of(self.k / self.w) / (s * (self.k * self.k) + 1.0);
        let slope = N::select(r.at_most(r.of(NEAR_AXIS)), r.of(0.0), (rate - scale) / s);
        solve::radial_with_jacobian(x, y, scale, slope)
    }

    #[inline(always)]
    fn undistort_fast<N: Number>(&self, _: &Seed, quick_radius: f64, (xd, yd): (N, N)) -> (N, N, N::Mask) {
        solve::closed(self.lift(xd, yd), quick_radius)
    }

    fn undistort_slow(&self, max_radius: f64, (xd, yd): (f64, f64)) -> Result<(f64, f64), UnprojectError> {
        solve::closed_to_the_rim(self.lift(xd, yd), max_radius)
    }

    fn seed(&self, _: f64) -> Seed {
        Seed::NONE
    }

    fn max_radius(&self) -> f64 {
        f64::INFINITY
    }

    fn radial(&self, r: f64) -> f64 {
        self.distort(r, 0.0).0
    }
}
