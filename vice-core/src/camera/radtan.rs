//! Radial and tangential distortion (Brown 1966): `x' = x d + 2 p1 x y + p2 (r² + 2 x²)`,
//! `y' = y d + p1 (r² + 2 y²) + 2 p2 x y` with `d = 1 + k1 r² + k2 r⁴ + k3 r⁶`.

use super::{Distortion, poly};

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
    fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        let (xx, yy, xy) = (x * x, y * y, x * y);
        let s = xx + yy;
        let d = 1.0 + s * (self.k1 + s * (self.k2 + s * self.k3));
        tangential(x, y, d, s, xx, yy, xy, self.p1, self.p2)
    }

    fn distort_with_jacobian(&self, x: f64, y: f64) -> ((f64, f64), [f64; 4]) {
        let s = x * x + y * y;
        let d = 1.0 + s * (self.k1 + s * (self.k2 + s * self.k3));
        let d_ds = self.k1 + s * (2.0 * self.k2 + s * 3.0 * self.k3);
        brown_with_jacobian(x, y, d, d_ds, self.p1, self.p2)
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
pub(super) fn tangential(
    x: f64,
    y: f64,
    d: f64,
    s: f64,
    xx: f64,
    yy: f64,
    xy: f64,
    p1: f64,
    p2: f64,
) -> (f64, f64) {
    (x * d + 2.0 * p1 * xy + p2 * (s + 2.0 * xx), y * d + p1 * (s + 2.0 * yy) + 2.0 * p2 * xy)
}

/// Brown's form for any radial factor `d(s)` with derivative `d_ds`, `s = r²`.
pub(super) fn brown_with_jacobian(
    x: f64,
    y: f64,
    d: f64,
    d_ds: f64,
    p1: f64,
    p2: f64,
) -> ((f64, f64), [f64; 4]) {
    let (xx, yy, xy) = (x * x, y * y, x * y);
    let distorted = tangential(x, y, d, xx + yy, xx, yy, xy, p1, p2);
    let cross = 2.0 * xy * d_ds + 2.0 * p1 * x + 2.0 * p2 * y;
    let jacobian = [
        d + 2.0 * xx * d_ds + 2.0 * p1 * y + 6.0 * p2 * x,
        cross,
        cross,
        d + 2.0 * yy * d_ds + 6.0 * p1 * y + 2.0 * p2 * x,
    ];
    (distorted, jacobian)
}
