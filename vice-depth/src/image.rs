//! Whole depth images, from any source.

use vice_core::camera::Pixel;
use vice_core::dataset::DepthImage;
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::DataResult;

/// What a source says about each pixel of a key frame.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap {
    width: u32,
    height: u32,
    pixels: Vec<Result<DepthSample, DepthMiss>>,
}

impl DepthMap {
    /// Columns.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// The pixels, row by row from the top.
    pub fn pixels(&self) -> &[Result<DepthSample, DepthMiss>] {
        &self.pixels
    }

    /// Metres along the optical axis, row by row, NaN where there is no depth.
    pub fn z_m(&self) -> Vec<f64> {
        self.pixels.iter().map(|p| p.map_or(f64::NAN, |d| d.z_m)).collect()
    }

    /// Number of pixels that have a depth.
    pub fn answered(&self) -> usize {
        self.pixels.iter().filter(|p| p.is_ok()).count()
    }

    /// Why pixels have no depth and how many, by reason.
    pub fn misses(&self) -> Vec<(DepthMiss, usize)> {
        let mut misses: Vec<DepthMiss> = self.pixels.iter().filter_map(|p| p.err()).collect();
        misses.sort_unstable();
        misses.chunk_by(|a, b| a == b).map(|same| (same[0], same.len())).collect()
    }

    /// The same as a data set gives it, in single precision.
    ///
    /// # Errors
    /// Never for a map from [`depth_image`], whose size is the camera's.
    pub fn to_image(&self, keyframe: &Keyframe<'_>) -> DataResult<DepthImage> {
        let z_m = self.z_m().into_iter().map(|z| z as f32).collect();
        DepthImage::new(keyframe.stamp, self.width, self.height, z_m)
    }
}

/// Asks a source for every pixel of a key frame at once.
///
/// # Errors
/// As [`DepthSource::depths`].
pub fn depth_image(source: &dyn DepthSource, keyframe: &Keyframe<'_>) -> DataResult<DepthMap> {
    let (width, height) = (keyframe.camera.width(), keyframe.camera.height());
    let row = |v: u32| (0..width).map(move |u| Pixel::new(u.into(), v.into()));
    let pixels: Vec<Pixel> = (0..height).flat_map(row).collect();
    Ok(DepthMap { width, height, pixels: source.depths(keyframe, &pixels)? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FloorDepth;
    use crate::scene::{camera, look};

    #[test]
    fn each_pixel_has_a_depth_or_a_reason() {
        let camera = camera();
        let keyframe = look(&camera, [0.0, 0.0, 1.5], [3.0, 0.0, 1.0]);
        let map = depth_image(&FloorDepth::new(), &keyframe).unwrap();
        let misses = map.misses();
        assert_eq!(misses.len(), 1);
        assert_eq!(misses[0].0, DepthMiss::AboveHorizon);
        assert_eq!(map.answered() + misses[0].1, 752 * 480);
        let image = map.to_image(&keyframe).unwrap();
        assert_eq!((image.width(), image.height()), (map.width(), map.height()));
        assert!(map.z_m()[0].is_nan() && image.get(0, 0).is_none());
        assert_eq!(
            image.get(100, 479).map(f64::from),
            map.pixels()[479 * 752 + 100].ok().map(|d| f64::from(d.z_m as f32))
        );
    }
}
