//! Equidistant (fisheye) distortion, Kannala and Brandt 2006: with `θ = atan(r)`,
//! `θ' = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)` and `(x', y') = θ'/r (x, y)`.

use std::f64::consts::FRAC_PI_2;

use super::seed::Seed;
use super::{Distortion, poly, solve};
use crate::lanes::Number;

/// Equidistant coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)] // The names are the model's own.
pub struct Equidistant {
    pub k1: f64,
    pub k2: f64,
    pub k3: f64,
    pub k4: f64,
}

impl Equidistant {
    #[inline(always)]
    fn angle<N: Number>(&self, theta: N) -> N {
        let t = theta * theta;
        theta * (t * (t * (t * (t * self.k4 + self.k3) + self.k2) + self.k1) + 1.0)
    }

    /// Derivative of the distorted by the undistorted angle.
    #[inline(always)]
    fn angle_rate<N: Number>(&self, theta: N) -> N {
        let t = theta * theta;
        t * (t * (t * (t * (9.0 * self.k4) + 7.0 * self.k3) + 5.0 * self.k2) + 3.0 * self.k1) + 1.0
    }
}

/// Below this radius the scale is 1 to the last bit, and the quotient of small numbers is not.
const NEAR_AXIS: f64 = 1e-12;

/// After a step so small (squared, radians) what is left is below rounding: it shrinks with the square.
const LAST_STEP_SQUARED: f64 = 1e-16;

impl Distortion for Equidistant {
    #[inline(always)]
    fn distort<N: Number>(&self, x: N, y: N) -> (N, N) {
        let r = (x * x + y * y).sqrt();
        let scale = N::select(r.at_most(r.of(NEAR_AXIS)), r.of(1.0), self.angle(r.atan()) / r);
        (x * scale, y * scale)
    }

    #[inline(always)]
    fn distort_with_jacobian<N: Number>(&self, x: N, y: N) -> ((N, N), [N; 4]) {
        let s = x * x + y * y;
        let r = s.sqrt();
        let on_axis = r.at_most(r.of(NEAR_AXIS));
        let theta = r.atan();
        let scale = N::select(on_axis, r.of(1.0), self.angle(theta) / r);
        // d(scale)/dr / r, with dθ/dr = 1/(1 + r²).
        let slope = N::select(on_axis, r.of(0.0), (self.angle_rate(theta) / (s + 1.0) - scale) / s);
        let cross = x * y * slope;
        ((x * scale, y * scale), [scale + x * x * slope, cross, cross, scale + y * y * slope])
    }

    /// In one dimension: the angle off the axis alone is solved for.
    #[inline(always)]
    fn undistort_fast<N: Number>(&self, seed: &Seed, quick_radius: f64, (xd, yd): (N, N)) -> (N, N, N::Mask) {
        let rd2 = xd * xd + yd * yd;
        let rd = rd2.sqrt();
        let mut theta = rd * solve::seeded(seed, rd2);
        if seed.more_steps {
            theta = theta - (self.angle(theta) - rd) / self.angle_rate(theta);
        }
        let step = (self.angle(theta) - rd) / self.angle_rate(theta);
        theta = theta - step;
        let done = (step * step).at_most(rd.of(LAST_STEP_SQUARED));
        let r = theta.tan();
        let scale = N::select(rd.at_most(rd.of(NEAR_AXIS)), rd.of(1.0), r / rd);
        let settled = rd.both(rd2.at_most(rd.of(seed.max_rd2)), done);
        let inside = rd.both(theta.below(rd.of(FRAC_PI_2)), r.at_most(rd.of(quick_radius)));
        (xd * scale, yd * scale, rd.both(settled, inside))
    }

    /// For the angle, which grows with the distorted radius.
    fn seed(&self, reach: f64) -> Seed {
        let rim = self.max_radius().atan();
        Seed::fit(|theta| self.angle(theta), rim, reach.min(self.angle(rim)))
    }

    fn max_radius(&self) -> f64 {
        let growth = [1.0, 3.0 * self.k1, 5.0 * self.k2, 7.0 * self.k3, 9.0 * self.k4];
        match poly::first_sign_change(&growth).map(f64::sqrt) {
            Some(theta) if theta < FRAC_PI_2 => theta.tan(),
            _ => f64::INFINITY,
        }
    }

    fn radial(&self, r: f64) -> f64 {
        self.angle(Number::atan(r))
    }
}
