//! Places that can be tracked: the smaller eigenvalue of the gradients around them is large, after J. Shi and
//! C. Tomasi, "Good features to track", 1994.

use vice_core::camera::Pixel;

use crate::pyramid::{Level, Pyramid};

/// Gradients are summed this far around a pixel.
const REACH: usize = 3;
/// Larger images are searched at the first halving that has no more columns than this.
const MAX_COLUMNS: usize = 1400;

/// A corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Where the score is largest, between pixels.
    pub px: Pixel,
    /// Square root of the smaller eigenvalue of the mean gradient product, gray levels a pixel: how much the image
    /// changes along the direction in which it changes least.
    pub score: f64,
}

/// The corners of an image, best first: places where the score is largest among the eight neighbours, at least
/// `border_px` from the border.
///
/// Images of more than 1400 columns are searched at half their size or less; places are those of the image itself.
pub fn corners(image: &Pyramid, border_px: f64) -> Vec<Corner> {
    let levels = image.levels();
    let n = levels.iter().position(|l| l.width <= MAX_COLUMNS).unwrap_or(levels.len() - 1);
    let level = &levels[n];
    let scale = f64::from(1_u32 << n);
    let scores = Scores::of(level);
    let mut found = Vec::new();
    let border = ((border_px.max(0.0) / scale).ceil() as usize).max(REACH + 2);
    for y in border..level.height.saturating_sub(border) {
        for x in border..level.width.saturating_sub(border) {
            if let Some((offset, score)) = scores.peak(x, y) {
                let px = Pixel::new((x as f64 + offset[0]) * scale, (y as f64 + offset[1]) * scale);
                found.push(Corner { px, score });
            }
        }
    }
    // Rows come from the top, so that equals keep an order.
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    found
}

/// The score of each pixel.
struct Scores {
    width: usize,
    values: Vec<f32>,
}

impl Scores {
    fn of(level: &Level) -> Self {
        let (width, height) = (level.width, level.height);
        let mut values = vec![0.0; width * height];
        // Sums along a row of each gradient product, for the rows that the window spans.
        let rows = 2 * REACH + 1;
        let mut ring = vec![[0.0_f32; 3]; width * rows];
        let mut columns = vec![[0.0_f32; 3]; width];
        for y in 1..height.saturating_sub(1) {
            let slot = y % rows;
            for x in 1..width.saturating_sub(1) {
                let at = |dx: usize, dy: usize| f32::from(level.pixels[(y + dy - 1) * width + x + dx - 1]);
                let right =
                    (at(2, 0) - at(0, 0)) * 3.0 + (at(2, 1) - at(0, 1)) * 10.0 + (at(2, 2) - at(0, 2)) * 3.0;
                let down =
                    (at(0, 2) - at(0, 0)) * 3.0 + (at(1, 2) - at(1, 0)) * 10.0 + (at(2, 2) - at(2, 0)) * 3.0;
                let (right, down) = (right / 32.0, down / 32.0);
                ring[slot * width + x] = [right * right, right * down, down * down];
            }
            if y < rows {
                continue;
            }
            for (x, column) in columns.iter_mut().enumerate() {
                *column = [0.0; 3];
                for row in 0..rows {
                    let product = &ring[row * width + x];
                    for k in 0..3 {
                        column[k] += product[k];
                    }
                }
            }
            let line = &mut values[(y - REACH) * width..][..width];
            for x in REACH..width.saturating_sub(REACH) {
                let mut sum = [0.0_f32; 3];
                for column in &columns[x - REACH..=x + REACH] {
                    for k in 0..3 {
                        sum[k] += column[k];
                    }
                }
                let [xx, xy, yy] = sum.map(|s| s / (rows * rows) as f32);
                let smaller = (xx + yy - ((xx - yy).powi(2) + 4.0 * xy * xy).sqrt()) / 2.0;
                line[x] = smaller.max(0.0).sqrt();
            }
        }
        Self { width, values }
    }

    fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// Offset of the top of a parabola through the neighbours, and the score, where the pixel is a peak.
    fn peak(&self, x: usize, y: usize) -> Option<([f64; 2], f64)> {
        let here = self.at(x, y);
        if here <= 0.0 {
            return None;
        }
        for (dx, dy) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
            let other = self.at(x + dx - 1, y + dy - 1);
            // Of equal neighbours the first one is the peak.
            let before = dy == 0 || (dy == 1 && dx == 0);
            if other > here || (before && other == here) {
                return None;
            }
        }
        let top = |before: f32, after: f32| {
            let bend = f64::from(before) + f64::from(after) - 2.0 * f64::from(here);
            let slope = (f64::from(after) - f64::from(before)) / 2.0;
            if bend < 0.0 { (-slope / bend).clamp(-0.5, 0.5) } else { 0.0 }
        };
        let offset = [top(self.at(x - 1, y), self.at(x + 1, y)), top(self.at(x, y - 1), self.at(x, y + 1))];
        Some((offset, f64::from(here)))
    }
}
