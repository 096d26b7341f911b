//! Gray values between pixels, by cubic convolution: R. Keys, "Cubic convolution interpolation for digital image
//! processing", 1981, with a = -1/2. Between linear ones a template would match best at whole pixels.

use vice_core::camera::Pixel;

use crate::pyramid::Level;

/// Weights of the pixels at -1, 0, 1 and 2 for a place `t` (0 to 1) beyond pixel 0.
fn weights(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [-0.5 * t + t2 - 0.5 * t3, 1.0 - 2.5 * t2 + 1.5 * t3, 0.5 * t + 2.0 * t2 - 1.5 * t3, -0.5 * t2 + 0.5 * t3]
}

/// The gray value at a place, none where a pixel that it takes lies beyond the border.
#[inline]
pub(crate) fn sample(level: &Level, place: Pixel) -> Option<f64> {
    let (x, y) = (place.u.floor(), place.v.floor());
    // Two to the right and below are needed; written so that NaN is outside.
    let inside = x >= 1.0 && y >= 1.0 && x + 2.0 < level.width as f64 && y + 2.0 < level.height as f64;
    if !inside {
        return None;
    }
    let (across, along) = (weights(place.u - x), weights(place.v - y));
    let start = (y as usize - 1) * level.width + x as usize - 1;
    let mut value = 0.0;
    for (row, weight) in along.iter().enumerate() {
        let pixels = &level.pixels[start + row * level.width..][..4];
        let line = f64::from(pixels[0]) * across[0]
            + f64::from(pixels[1]) * across[1]
            + f64::from(pixels[2]) * across[2]
            + f64::from(pixels[3]) * across[3];
        value += weight * line;
    }
    Some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_comes_back_and_the_border_is_outside() {
        let f = |u: f64, v: f64| 20.0 + 0.5 * u * u + 3.0 * v;
        let pixels = (0..100).map(|i| f(f64::from(i % 10), f64::from(i / 10)).round() as u8).collect();
        let level = Level { width: 10, height: 10, pixels };
        for (u, v) in [(4.0, 5.0), (6.0, 3.25), (2.0, 7.9)] {
            assert!((sample(&level, Pixel::new(u, v)).unwrap() - f(u, v)).abs() < 1e-9);
        }
        for (u, v) in [(0.9, 5.0), (8.0, 5.0), (5.0, 8.0), (f64::NAN, 5.0), (1e300, 2.0), (-5.0, 3.0)] {
            assert!(sample(&level, Pixel::new(u, v)).is_none(), "{u} {v}");
        }
    }
}
