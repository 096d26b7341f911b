//! Double sphere (Usenko, Demmel and Cremers 2018): a point is projected to a unit sphere, from there to a second one
//! whose centre is shifted by `ξ`, and from there by a pinhole that is shifted by `α/(1 - α)`.
//!
//! With `Z = 1`: `d1 = √(r² + 1)`, `t = ξ d1 + 1`, `d2 = √(r² + t²)` and
//! `(x', y') = (x, y)/(α d2 + (1 - α) t)`. The inverse has a closed form.

use super::seed::Seed;
use super::{Distortion, UnprojectError, solve};
use crate::lanes::Number;

/// Double sphere: the shift of the second sphere, and that of the pinhole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)] // The names are the model's own.
pub struct DoubleSphere {
    pub xi: f64,
    pub alpha: f64,
}

impl DoubleSphere {
    /// The denominator of the projection, and its derivative by `r²`.
    #[inline(always)]
    fn denominator<N: Number>(&self, s: N) -> (N, N) {
        let d1 = (s + 1.0).sqrt();
        let t = d1 * self.xi + 1.0;
        let t_ds = s.of(0.5 * self.xi) / d1;
        let d2 = (s + t * t).sqrt();
        let d2_ds = (t * t_ds + 0.5) / d2;
        (d2 * self.alpha + t * (1.0 - self.alpha), d2_ds * self.alpha + t_ds * (1.0 - self.alpha))
    }

    /// The cosine of the largest angle off the axis that has a pixel, where it is one below 90 degrees.
    ///
    /// On the second sphere the image of an angle `φ` grows up to `cos φ = -w`, and `φ` is the angle under which the
    /// second centre sees the place on the first sphere. (The bound in the paper is a little off this one.)
    fn rim_cosine(&self) -> Option<f64> {
        let w =
            if self.alpha <= 0.5 { self.alpha / (1.0 - self.alpha) } else { (1.0 - self.alpha) / self.alpha };
        let rest = 1.0 - w * w;
        let inside = 1.0 - self.xi * self.xi * rest;
        if inside < 0.0 {
            return None;
        }
        Some(-self.xi * rest - w * inside.sqrt()).filter(|cosine| *cosine > 0.0)
    }

    /// The ray of a place in the distorted plane, and whether it points forward from a place that the model reaches.
    #[inline(always)]
    fn lift<N: Number>(&self, xd: N, yd: N) -> (N, N, N::Mask) {
        let s = xd * xd + yd * yd;
        let under = s * -(2.0 * self.alpha - 1.0) + 1.0;
        let z = (s * -(self.alpha * self.alpha) + 1.0) / (under.sqrt() * self.alpha + (1.0 - self.alpha));
        let zz = z * z;
        let on_sphere = (z * self.xi + (zz + s * (1.0 - self.xi * self.xi)).sqrt()) / (zz + s);
        let forward = on_sphere * z - self.xi;
        let scale = on_sphere / forward;
        let reached = s.both(s.of(0.0).at_most(under), s.of(0.0).below(forward));
        (xd * scale, yd * scale, reached)
    }
}

impl Distortion for DoubleSphere {
    #[inline(always)]
    fn distort<N: Number>(&self, x: N, y: N) -> (N, N) {
        let (d, _) = self.denominator(x * x + y * y);
        let scale = x.of(1.0) / d;
        (x * scale, y * scale)
    }

    #[inline(always)]
    fn distort_with_jacobian<N: Number>(&self, x: N, y: N) -> ((N, N), [N; 4]) {
        let (d, d_ds) = self.denominator(x * x + y * y);
        let scale = x.of(1.0) / d;
        solve::radial_with_jacobian(x, y, scale, scale * scale * d_ds * -2.0)
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
        let rim = self.rim_cosine().map_or(f64::INFINITY, solve::radius_of_cosine);
        // Up to a half it is a pole, and strictly inside it the pixel is still a number.
        if self.alpha <= 0.5 { rim * (1.0 - 1e-9) } else { rim }
    }

    fn radial(&self, r: f64) -> f64 {
        self.distort(r, 0.0).0
    }
}
