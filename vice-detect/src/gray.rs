//! A gray picture in floats, and the smoothing that detectors share.

use vice_core::dataset::{Image, PixelFormat};

/// A gray picture, rows from the top; values 0 to 255.
#[derive(Clone, Debug)]
pub(crate) struct Gray {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) data: Vec<f32>,
}

impl Gray {
    /// The brightness of an image (ITU-R BT.601 weights for colour).
    pub(crate) fn of(image: &Image) -> Self {
        let data = match image.format() {
            PixelFormat::Rgb8 => image
                .data()
                .chunks_exact(3)
                .map(|p| 0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2]))
                .collect(),
            _ => image.data().iter().map(|v| f32::from(*v)).collect(),
        };
        Self { width: image.width() as usize, height: image.height() as usize, data }
    }

    /// The value between pixels, bilinear; `None` outside the outermost pixel centres.
    pub(crate) fn sample(&self, x: f64, y: f64) -> Option<f32> {
        let (last_x, last_y) = (self.width as f64 - 1.0, self.height as f64 - 1.0);
        if !(x >= 0.0 && y >= 0.0 && x <= last_x && y <= last_y) {
            return None;
        }
        let (column, row) =
            ((x as usize).min(self.width.max(2) - 2), (y as usize).min(self.height.max(2) - 2));
        let (fx, fy) = ((x - column as f64) as f32, (y - row as f64) as f32);
        let at = row * self.width + column;
        let right = usize::from(self.width > 1);
        let below = if self.height > 1 { self.width } else { 0 };
        let top = self.data[at] + fx * (self.data[at + right] - self.data[at]);
        let bottom = self.data[at + below] + fx * (self.data[at + below + right] - self.data[at + below]);
        Some(top + fy * (bottom - top))
    }

    /// Smoothed with a Gaussian of `sigma_px`; the border is repeated outside.
    pub(crate) fn blurred(&self, sigma_px: f32) -> Self {
        let reach = (2.7 * sigma_px).ceil() as usize;
        let mut kernel: Vec<f32> =
            (0..=reach).map(|i| (-0.5 * (i as f32 / sigma_px).powi(2)).exp()).collect();
        let sum = 2.0 * kernel.iter().sum::<f32>() - kernel[0];
        for k in &mut kernel {
            *k /= sum;
        }
        let (w, h) = (self.width, self.height);
        let mut across = vec![0.0; w * h];
        let mut padded = vec![0.0; w + 2 * reach];
        for (row, out) in self.data.chunks_exact(w).zip(across.chunks_exact_mut(w)) {
            padded[..reach].fill(row[0]);
            padded[reach..reach + w].copy_from_slice(row);
            padded[reach + w..].fill(row[w - 1]);
            for (x, o) in out.iter_mut().enumerate() {
                *o = padded[x + reach] * kernel[0];
            }
            for (i, k) in kernel.iter().enumerate().skip(1) {
                let (before, after) = (&padded[reach - i..reach - i + w], &padded[reach + i..reach + i + w]);
                for ((o, a), b) in out.iter_mut().zip(before).zip(after) {
                    *o += k * (a + b);
                }
            }
        }
        let mut data = vec![0.0; w * h];
        for (y, out) in data.chunks_exact_mut(w).enumerate() {
            let row = |dy: isize| {
                let at = y.saturating_add_signed(dy).min(h - 1) * w;
                &across[at..at + w]
            };
            for (o, v) in out.iter_mut().zip(row(0)) {
                *o = v * kernel[0];
            }
            for (i, k) in (1_isize..).zip(&kernel[1..]) {
                for ((o, a), b) in out.iter_mut().zip(row(-i)).zip(row(i)) {
                    *o += k * (a + b);
                }
            }
        }
        Self { width: w, height: h, data }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_pixels_it_is_linear_and_outside_there_is_nothing() {
        let image = Image::new(3, 2, PixelFormat::Gray8, vec![0, 10, 20, 40, 50, 60]).unwrap();
        let gray = Gray::of(&image);
        assert_eq!(gray.sample(0.5, 0.5), Some(25.0));
        assert_eq!(gray.sample(2.0, 1.0), Some(60.0));
        assert_eq!((gray.sample(2.01, 0.0), gray.sample(f64::NAN, 0.0)), (None, None));
        let dot = Image::new(1, 1, PixelFormat::Rgb8, vec![255, 255, 255]).unwrap();
        assert!((Gray::of(&dot).sample(0.0, 0.0).unwrap() - 255.0).abs() < 1e-3);
    }

    #[test]
    fn smoothing_keeps_the_mean_and_an_even_picture() {
        let mut data = vec![100; 21 * 21];
        data[10 * 21 + 10] = 200;
        let gray = Gray::of(&Image::new(21, 21, PixelFormat::Gray8, data).unwrap());
        let smooth = gray.blurred(1.5);
        let sum: f32 = smooth.data.iter().sum();
        assert!((sum - gray.data.iter().sum::<f32>()).abs() < 0.5, "{sum}");
        assert!((smooth.data[0] - 100.0).abs() < 1e-3);
        // The peak of a Gaussian of that width, cut off at its ends.
        assert!((smooth.data[10 * 21 + 10] - 100.0 - 100.0 / (std::f32::consts::TAU * 2.25)).abs() < 0.3);
    }
}
