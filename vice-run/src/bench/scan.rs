//! A scan of any size.

use nalgebra::Point3;
use vice_core::random::Congruential;

/// The inside of a box before a camera at the origin: 10 m wide and deep, 6 m high, its open side towards the camera.
pub(super) fn room(n: usize) -> Vec<Point3<f32>> {
    let mut numbers = Congruential::new(42);
    (0..n)
        .map(|_| {
            let (a, b) = (numbers.uniform(-1.0, 1.0), numbers.uniform(0.0, 1.0));
            // Back wall, floor and ceiling, left and right wall, by their areas.
            let [x, y, z] = match numbers.uniform(0.0, 38.0) {
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
