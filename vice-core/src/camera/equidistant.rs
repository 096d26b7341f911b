//! Equidistant (fisheye) distortion, Kannala and Brandt 2006: with `θ = atan(r)`,
//! `θ' = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)` and `(x', y') = θ'/r (x, y)`.

use super::{Distortion, poly};

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
    fn angle(&self, theta: f64) -> f64 {
        let t = theta * theta;
        theta * (1.0 + t * (self.k1 + t * (self.k2 + t * (self.k3 + t * self.k4))))
    }

    /// Derivative of the distorted by the undistorted angle.
    fn angle_rate(&self, theta: f64) -> f64 {
        let t = theta * theta;
        1.0 + t * (3.0 * self.k1 + t * (5.0 * self.k2 + t * (7.0 * self.k3 + t * 9.0 * self.k4)))
    }
}

impl Distortion for Equidistant {
    fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        let r = (x * x + y * y).sqrt();
        // Below this the scale is 1 to the last bit, and r may underflow.
        let scale = if r > 1e-12 { self.angle(r.atan()) / r } else { 1.0 };
        (x * scale, y * scale)
    }

    fn distort_with_jacobian(&self, x: f64, y: f64) -> ((f64, f64), [f64; 4]) {
        let s = x * x + y * y;
        let r = s.sqrt();
        if r <= 1e-12 {
            return ((x, y), [1.0, 0.0, 0.0, 1.0]);
        }
        let theta = r.atan();
        let scale = self.angle(theta) / r;
        // d(scale)/dr / r, with dθ/dr = 1/(1 + r²).
        let slope = (self.angle_rate(theta) / (1.0 + s) - scale) / s;
        let cross = x * y * slope;
        ((x * scale, y * scale), [scale + x * x * slope, cross, cross, scale + y * y * slope])
    }

    fn max_radius(&self) -> f64 {
        let growth = [1.0, 3.0 * self.k1, 5.0 * self.k2, 7.0 * self.k3, 9.0 * self.k4];
        match poly::first_sign_change(&growth).map(f64::sqrt) {
            Some(theta) if theta < std::f64::consts::FRAC_PI_2 => theta.tan(),
            _ => f64::INFINITY,
        }
    }

    fn radial(&self, r: f64) -> f64 {
        self.angle(r.atan())
    }
}
