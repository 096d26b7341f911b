//! Radial and tangential distortion (Brown 1966): `x' = x d + 2 p1 x y + p2 (r² + 2 x²)`,
//! `y' = y d + p1 (r² + 2 y²) + 2 p2 x y` with `d = 1 + k1 r² + k2 r⁴ + k3 r⁶`.

use super::{Distortion, poly};
use crate::lanes::Number;

/// Radial-tangential coefficients; `k3` is 0 where a calibration has only four.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)] // The names are the model's own.
pub struct Radtan {
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
    pub k3: f64,
}

impl Distortion for Radtan {
    #[inline(always)]
    fn distort<N: Number>(&self, x: N, y: N) -> (N, N) {
        let (xx, yy, xy) = (x * x, y * y, x * y);
        let s = xx + yy;
        let d = s * (s * (s * self.k3 + self.k2) + self.k1) + 1.0;
        brown(x, y, d, s, xx, yy, xy, self.p1, self.p2)
    }

    #[inline(always)]
    fn tangential<N: Number>(&self, x: N, y: N) -> (N, N) {
        brown_tangential(x, y, self.p1, self.p2)
    }

    #[inline(always)]
    fn distort_with_jacobian<N: Number>(&self, x: N, y: N) -> ((N, N), [N; 4]) {
        let s = x * x + y * y;
        let d = s * (s * (s * self.k3 + self.k2) + self.k1) + 1.0;
        let twice_d_ds = s * (s * (6.0 * self.k3) + 4.0 * self.k2) + 2.0 * self.k1;
        brown_with_jacobian(x, y, d, twice_d_ds, self.p1, self.p2)
    }

    fn max_radius(&self) -> f64 {
        let growth = [1.0, 3.0 * self.k1, 5.0 * self.k2, 7.0 * self.k3];
        poly::first_sign_change(&growth).map_or(f64::INFINITY, f64::sqrt)
    }

    fn radial(&self, r: f64) -> f64 {
        let s = r * r;
        r * (1.0 + s * (self.k1 + s * (self.k2 + s * self.k3)))
    }
}

#[expect(clippy::too_many_arguments, reason = "products that both callers already have")]
#[inline(always)]
pub(super) fn brown<N: Number>(x: N, y: N, d: N, s: N, xx: N, yy: N, xy: N, p1: f64, p2: f64) -> (N, N) {
    (x * d + xy * (2.0 * p1) + (s + xx * 2.0) * p2, y * d + (s + yy * 2.0) * p1 + xy * (2.0 * p2))
}

/// The tangential part of Brown's form.
#[inline(always)]
pub(super) fn brown_tangential<N: Number>(x: N, y: N, p1: f64, p2: f64) -> (N, N) {
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let s = xx + yy;
    (xy * (2.0 * p1) + (s + xx * 2.0) * p2, (s + yy * 2.0) * p1 + xy * (2.0 * p2))
}

/// Brown's form for any radial factor `d(s)` with twice its derivative, `s = r²`.
#[inline(always)]
pub(super) fn brown_with_jacobian<N: Number>(
    x: N,
    y: N,
    d: N,
    twice_d_ds: N,
    p1: f64,
    p2: f64,
) -> ((N, N), [N; 4]) {
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let distorted = brown(x, y, d, xx + yy, xx, yy, xy, p1, p2);
    let cross = xy * twice_d_ds + (x * (2.0 * p1) + y * (2.0 * p2));
    let jacobian = [
        d + xx * twice_d_ds + (y * (2.0 * p1) + x * (6.0 * p2)),
        cross,
        cross,
        d + yy * twice_d_ds + (y * (6.0 * p1) + x * (2.0 * p2)),
    ];
    (distorted, jacobian)
}
