//! A scan of any size, and numbers that are the same on every run.

use nalgebra::Point3;

/// A linear congruential generator (Knuth's MMIX constants): plenty for spreading points.
pub(super) struct Numbers(u64);

impl Numbers {
    pub(super) const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in `[low, high)`.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn list(&mut self, n: usize, low: f64, high: f64) -> Vec<f64> {
        (0..n).map(|_| self.between(low, high)).collect()
    }
}

/// The inside of a box before a camera at the origin: 10 m wide and deep, 6 m high, its open side towards the camera.
pub(super) fn room(n: usize) -> Vec<Point3<f32>> {
    let mut numbers = Numbers::new(42);
    (0..n)
        .map(|_| {
            let (a, b) = (numbers.between(-1.0, 1.0), numbers.between(0.0, 1.0));
            // Back wall, floor and ceiling, left and right wall, by their areas.
            let [x, y, z] = match numbers.between(0.0, 38.0) {
                wall if wall < 6.0 => [5.0 * a, 6.0 * b - 3.0, 12.0],
                wall if wall < 16.0 => [5.0 * a, 3.0, 2.0 + 10.0 * b],
                wall if wall < 26.0 => [5.0 * a, -3.0, 2.0 + 10.0 * b],
                wall if wall < 32.0 => [-5.0, 3.0 * a, 2.0 + 10.0 * b],
                _ => [5.0, 3.0 * a, 2.0 + 10.0 * b],
            };
            Point3::new(x as f32, y as f32, z as f32)
        })
        .collect()
}
