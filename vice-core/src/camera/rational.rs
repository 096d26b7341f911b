//! Rational distortion, the paper's k1..k6, p1, p2: Brown's form with
//! `d = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)`.

use super::{Distortion, poly, radtan};
use crate::lanes::Number;

/// Rational coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)] // The names are the model's own.
pub struct Rational {
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
    pub k3: f64,
    pub k4: f64,
    pub k5: f64,
    pub k6: f64,
}

impl Rational {
    #[inline(always)]
    fn factor<N: Number>(&self, s: N) -> N {
        let n = s * (s * (s * self.k3 + self.k2) + self.k1) + 1.0;
        // As the Jacobian has it, so that both say the same bits.
        n * (s.of(1.0) / (s * (s * (s * self.k6 + self.k5) + self.k4) + 1.0))
    }
}

impl Distortion for Rational {
    #[inline(always)]
    fn distort<N: Number>(&self, x: N, y: N) -> (N, N) {
        let (xx, yy, xy) = (x * x, y * y, x * y);
        let s = xx + yy;
        radtan::brown(x, y, self.factor(s), s, xx, yy, xy, self.p1, self.p2)
    }

    #[inline(always)]
    fn tangential<N: Number>(&self, x: N, y: N) -> (N, N) {
        radtan::brown_tangential(x, y, self.p1, self.p2)
    }

    #[inline(always)]
    fn distort_with_jacobian<N: Number>(&self, x: N, y: N) -> ((N, N), [N; 4]) {
        let s = x * x + y * y;
        let n = s * (s * (s * self.k3 + self.k2) + self.k1) + 1.0;
        let m = s * (s * (s * self.k6 + self.k5) + self.k4) + 1.0;
        let n_ds = s * (s * (6.0 * self.k3) + 4.0 * self.k2) + 2.0 * self.k1;
        let m_ds = s * (s * (6.0 * self.k6) + 4.0 * self.k5) + 2.0 * self.k4;
        let per_m = x.of(1.0) / m;
        let d = n * per_m;
        radtan::brown_with_jacobian(x, y, d, (n_ds - d * m_ds) * per_m, self.p1, self.p2)
    }

    fn max_radius(&self) -> f64 {
        let n = [1.0, self.k1, self.k2, self.k3];
        let m = [1.0, self.k4, self.k5, self.k6];
        // d/dr of r N(s)/M(s) has the sign of N M + 2 s (N' M - N M').
        let mut growth = poly::multiply(&n, &m);
        let up = poly::multiply(&poly::derivative(&n), &m);
        let down = poly::multiply(&n, &poly::derivative(&m));
        for (i, (u, d)) in up.iter().zip(&down).enumerate() {
            growth[i + 1] += 2.0 * (u - d);
        }
        let fold = poly::first_sign_change(&growth).unwrap_or(f64::INFINITY);
        let pole = poly::first_sign_change(&m).unwrap_or(f64::INFINITY);
        // Strictly inside the pole, where the quotient is still a number.
        fold.min(pole * (1.0 - 1e-9)).sqrt()
    }

    fn radial(&self, r: f64) -> f64 {
        r * self.factor(r * r)
    }
}
