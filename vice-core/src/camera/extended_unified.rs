//! Extended unified (Khomutenko, Garcia and Martinet 2016): a point is projected to an ellipsoid, and from there by a
//! pinhole. With `Z = 1`: `(x', y') = (x, y)/(α √(β r² + 1) + 1 - α)`. The inverse has a closed form.

use super::seed::Seed;
use super::{Distortion, UnprojectError, solve};
use crate::lanes::Number;

/// Extended unified: how much of the ellipsoid there is, and its shape.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)] // The names are the model's own.
pub struct ExtendedUnified {
    pub alpha: f64,
    pub beta: f64,
}

impl ExtendedUnified {
    /// The denominator of the projection, and `√(β r² + 1)`.
    #[inline(always)]
    fn denominator<N: Number>(&self, s: N) -> (N, N) {
        let d = (s * self.beta + 1.0).sqrt();
        (d * self.alpha + (1.0 - self.alpha), d)
    }

    /// The ray of a place in the distorted plane, and whether it points forward from a place that the model reaches.
    #[inline(always)]
    fn lift<N: Number>(&self, xd: N, yd: N) -> (N, N, N::Mask) {
        let s = xd * xd + yd * yd;
        let under = s * -((2.0 * self.alpha - 1.0) * self.beta) + 1.0;
        let above = s * -(self.beta * self.alpha * self.alpha) + 1.0;
        let scale = (under.sqrt() * self.alpha + (1.0 - self.alpha)) / above;
        let reached = s.both(s.of(0.0).at_most(under), s.of(0.0).below(above));
        (xd * scale, yd * scale, reached)
    }
}

impl Distortion for ExtendedUnified {
    #[inline(always)]
    fn distort<N: Number>(&self, x: N, y: N) -> (N, N) {
        let scale = x.of(1.0) / self.denominator(x * x + y * y).0;
        (x * scale, y * scale)
    }

    #[inline(always)]
    fn distort_with_jacobian<N: Number>(&self, x: N, y: N) -> ((N, N), [N; 4]) {
        let (denominator, d) = self.denominator(x * x + y * y);
        let scale = x.of(1.0) / denominator;
        let twice_slope = scale * scale * -(self.alpha * self.beta) / d;
        solve::radial_with_jacobian(x, y, scale, twice_slope)
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

    /// The image of an angle grows up to 90 degrees off the axis, and beyond.
    fn max_radius(&self) -> f64 {
        f64::INFINITY
    }

    fn radial(&self, r: f64) -> f64 {
        self.distort(r, 0.0).0
    }
}
