//! Omnidirectional (Mei and Rives 2007), OpenCV's `omnidir`: a point is projected to the unit sphere, from there by a
//! pinhole that is shifted by `ξ`, and what that makes is distorted radially and tangentially.
//!
//! With `Z = 1`: `m = (x, y)/(1 + ξ √(r² + 1))`, then Brown's form of `m`. The inverse of the first step has a closed
//! form; that of the second is solved as for a plain lens, in the plane of `m`, where no angle is far away.

use super::seed::Seed;
use super::{Distortion, Radtan, UnprojectError, solve};
use crate::lanes::Number;

/// Omnidirectional: the shift of the pinhole, and Brown's coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)] // The names are the model's own.
pub struct Omnidirectional {
    pub xi: f64,
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
}

impl Omnidirectional {
    const fn brown(&self) -> Radtan {
        Radtan { k1: self.k1, k2: self.k2, p1: self.p1, p2: self.p2, k3: 0.0 }
    }

    /// One over what a point of the plane `Z = 1` is divided by, and twice its derivative by `r²`.
    #[inline(always)]
    fn shrink<N: Number>(&self, s: N) -> (N, N) {
        let d = (s + 1.0).sqrt();
        let scale = s.of(1.0) / (d * self.xi + 1.0);
        (scale, scale * scale * -self.xi / d)
    }

    /// From the plane of `m` to the plane `Z = 1`, and whether the ray points forward.
    #[inline(always)]
    fn lift<N: Number>(&self, (mx, my): (N, N)) -> (N, N, N::Mask) {
        let s = mx * mx + my * my;
        // Of the two places on the sphere the one in front.
        let on_sphere = ((s * (1.0 - self.xi * self.xi) + 1.0).sqrt() + self.xi) / (s + 1.0);
        let forward = on_sphere - self.xi;
        let scale = on_sphere / forward;
        (mx * scale, my * scale, s.of(0.0).below(forward))
    }
}

impl Distortion for Omnidirectional {
    #[inline(always)]
    fn distort<N: Number>(&self, x: N, y: N) -> (N, N) {
        let (scale, _) = self.shrink(x * x + y * y);
        self.brown().distort(x * scale, y * scale)
    }

    #[inline(always)]
    fn distort_with_jacobian<N: Number>(&self, x: N, y: N) -> ((N, N), [N; 4]) {
        let (scale, twice_slope) = self.shrink(x * x + y * y);
        let ((mx, my), [a, b, c, d]) = solve::radial_with_jacobian(x, y, scale, twice_slope);
        let (distorted, [e, f, g, h]) = self.brown().distort_with_jacobian(mx, my);
        (distorted, [e * a + f * c, e * b + f * d, g * a + h * c, g * b + h * d])
    }

    #[inline(always)]
    fn undistort_fast<N: Number>(
        &self,
        seed: &Seed,
        quick_radius: f64,
        distorted: (N, N),
    ) -> (N, N, N::Mask) {
        // How far out is asked once, of the ray: the farther it is in one plane, the farther in the other.
        let (mx, my, found) = solve::in_the_plane(&self.brown(), seed, f64::MAX.sqrt(), distorted);
        let (x, y, inside) = solve::closed(self.lift((mx, my)), quick_radius);
        (x, y, mx.both(found, inside))
    }

    fn undistort_slow(&self, max_radius: f64, distorted: (f64, f64)) -> Result<(f64, f64), UnprojectError> {
        let brown = self.brown();
        let m = solve::search(&brown, brown.max_radius(), distorted)?;
        solve::closed_to_the_rim(self.lift(m), max_radius)
    }

    fn seed(&self, reach: f64) -> Seed {
        self.brown().seed(reach)
    }

    fn max_radius(&self) -> f64 {
        // Where a negative shift leaves no image, and where the polynomial folds back.
        let pole =
            if self.xi < 0.0 { solve::radius_of_cosine(-self.xi) * (1.0 - 1e-9) } else { f64::INFINITY };
        let rim = self.brown().max_radius();
        let fold = match rim.is_finite().then(|| self.lift((rim, 0.0))) {
            Some((r, _, true)) => r,
            _ => f64::INFINITY,
        };
        pole.min(fold)
    }

    fn radial(&self, r: f64) -> f64 {
        self.brown().radial(r * self.shrink(r * r).0)
    }
}
