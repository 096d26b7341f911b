//! Dots on an image: where the labels say a point is, and where pose streams carried it.

use vice_core::camera::Pixel;
use vice_core::dataset::{Image, PixelFormat};
use vice_core::error::DataResult;

/// Red, green, blue.
pub(crate) type Colour = [u8; 3];

/// The paper's colours, shifted so that people who are colour-blind can tell them apart (Okabe and Ito).
pub(crate) const LABEL_BLUE: Colour = [0, 114, 178];
/// The on-board estimate.
pub(crate) const ESTIMATE_GREEN: Colour = [0, 158, 115];
/// A second estimate.
pub(crate) const ESTIMATE_YELLOW: Colour = [240, 228, 66];

/// A colour image to draw on.
pub(crate) struct Canvas {
    width: i64,
    height: i64,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A colour copy of an image.
    pub(crate) fn new(image: &Image) -> Self {
        let rgb = match image.format() {
            PixelFormat::Gray8 => image.data().iter().flat_map(|g| [*g; 3]).collect(),
            _ => image.data().to_vec(),
        };
        Self { width: i64::from(image.width()), height: i64::from(image.height()), rgb }
    }

    /// The picture.
    pub(crate) fn into_image(self) -> DataResult<Image> {
        Image::new(self.width as u32, self.height as u32, PixelFormat::Rgb8, self.rgb)
    }

    /// A filled dot with a white rim, anti-aliased.
    pub(crate) fn dot(&mut self, centre: Pixel, radius_px: f64, colour: Colour) {
        self.shade(centre, radius_px + 1.5, [255, 255, 255], |d| radius_px + 1.5 - d);
        self.shade(centre, radius_px, colour, |d| radius_px - d);
    }

    /// A ring, which leaves what it marks in view.
    pub(crate) fn ring(&mut self, centre: Pixel, radius_px: f64, colour: Colour) {
        self.shade(centre, radius_px + 3.0, [255, 255, 255], |d| 3.0 - (d - radius_px).abs());
        self.shade(centre, radius_px + 2.0, colour, |d| 1.8 - (d - radius_px).abs());
    }

    /// A straight line.
    pub(crate) fn line(&mut self, from: Pixel, to: Pixel, colour: Colour) {
        let steps = (from.distance_px(to).ceil() as usize).clamp(1, 10_000);
        for i in 0..=steps {
            let f = i as f64 / steps as f64;
            let at = Pixel::new(from.u + (to.u - from.u) * f, from.v + (to.v - from.v) * f);
            self.shade(at, 1.0, colour, |d| 1.2 - d);
        }
    }

    /// A filled rectangle from its top left corner; what lies outside the image is left out.
    pub(crate) fn fill(&mut self, (left, top): (i64, i64), (width, height): (i64, i64), colour: Colour) {
        for row in top.max(0)..(top + height).min(self.height) {
            for column in left.max(0)..(left + width).min(self.width) {
                let at = 3 * (row * self.width + column) as usize;
                self.rgb[at..at + 3].copy_from_slice(&colour);
            }
        }
    }

    /// Blends a colour in where `cover` of the distance from the centre is above zero.
    fn shade(&mut self, centre: Pixel, reach_px: f64, colour: Colour, cover: impl Fn(f64) -> f64) {
        let reach = reach_px + 1.0;
        // The casts saturate, so that a point far outside draws nothing.
        let columns = ((centre.u - reach).floor() as i64).max(0)
            ..=((centre.u + reach).ceil() as i64).min(self.width - 1);
        let rows = ((centre.v - reach).floor() as i64).max(0)
            ..=((centre.v + reach).ceil() as i64).min(self.height - 1);
        for row in rows {
            for column in columns.clone() {
                let distance = centre.distance_px(Pixel::new(column as f64, row as f64));
                let alpha = (cover(distance) + 0.5).clamp(0.0, 1.0);
                let at = 3 * (row * self.width + column) as usize;
                for (channel, value) in self.rgb[at..at + 3].iter_mut().zip(colour) {
                    *channel = (f64::from(*channel) * (1.0 - alpha) + f64::from(value) * alpha).round() as u8;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dot_colours_its_centre_and_nothing_far_away() {
        let image = Image::new(20, 10, PixelFormat::Gray8, vec![7; 200]).unwrap();
        let mut canvas = Canvas::new(&image);
        canvas.dot(Pixel::new(5.0, 5.0), 2.0, LABEL_BLUE);
        canvas.dot(Pixel::new(1e12, -1e12), 2.0, LABEL_BLUE);
        canvas.ring(Pixel::new(-50.0, 5.0), 2.0, LABEL_BLUE);
        let picture = canvas.into_image().unwrap();
        let at = |column: usize, row: usize| &picture.data()[3 * (row * 20 + column)..][..3];
        assert_eq!(at(5, 5), LABEL_BLUE);
        assert_eq!(at(19, 9), [7, 7, 7]);
    }
}
