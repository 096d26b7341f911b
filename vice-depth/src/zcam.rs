//! Depth from a depth camera: the data set's depth images, registered to the colour images.
//!
//! Bilinear over those of the four neighbours that are valid, their weights renormalised. A neighbour without a
//! reading (0 or NaN in the file) or out of the range asked for is not valid.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use vice_core::camera::Pixel;
use vice_core::dataset::{Dataset, DepthImage, Floor, depth_unit_doubt};
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::{DataError, DataResult};
use vice_core::suspicion::{Suspicion, Suspicions};

use crate::units::AgainstFloor;

/// How depth images are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZCamOptions {
    /// Readings outside of these are not trusted, metres.
    pub range_m: [f64; 2],
    /// Neighbours that differ by more than this part of the nearer one straddle an edge, by default 0.05: a floor
    /// seen by a camera a metre above it changes by less from one pixel to the next, up to 20 m away.
    pub edge: f64,
}

impl Default for ZCamOptions {
    fn default() -> Self {
        Self { range_m: [0.0, f64::INFINITY], edge: 0.05 }
    }
}

/// Depth from the depth images of one camera of a data set.
pub struct ZCamDepth {
    dataset: Arc<dyn Dataset>,
    camera: String,
    options: ZCamOptions,
    /// The image decoded last, so that none is decoded twice for a key frame.
    last: Mutex<Option<(usize, Arc<DepthImage>)>>,
    seen: Mutex<Seen>,
}

/// What was noticed on the way.
#[derive(Debug, Default)]
struct Seen {
    against_floor: AgainstFloor,
    said: Suspicions,
}

impl Seen {
    /// Says a doubt, unless one of its kind was said before.
    fn say(&mut self, camera: &str, doubt: Option<Suspicion>) {
        let Some(doubt) = doubt else { return };
        if self.said.iter().all(|s| s.code != doubt.code) {
            let doubt = Suspicion { about: format!("depth of camera {camera}"), ..doubt };
            self.said.add(doubt);
        }
    }
}

impl ZCamDepth {
    /// Depth from the depth images registered to a camera.
    ///
    /// # Errors
    /// [`DataError`] if the camera has no depth images or the range is empty.
    pub fn new(dataset: Arc<dyn Dataset>, camera: &str, options: ZCamOptions) -> DataResult<Self> {
        let [near, far] = options.range_m;
        if !(near >= 0.0 && far > near) {
            return Err(DataError::new(format!("the depth range {near},{far} m is empty"))
                .hint("give it as nearest,farthest in metres, such as 0.2,10"));
        }
        if !dataset.has_depth(camera) {
            let name = dataset.name();
            return Err(DataError::new(format!("{name} has no depth images for camera `{camera}`")));
        }
        Ok(Self {
            dataset,
            camera: camera.to_string(),
            options,
            last: Mutex::new(None),
            seen: Mutex::default(),
        })
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The depth image of a frame; `None` where that frame has none.
    fn image(&self, frame: usize) -> DataResult<Option<Arc<DepthImage>>> {
        // A panic elsewhere leaves at worst an image behind that is right.
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((index, image)) = &*last
            && *index == frame
        {
            return Ok(Some(Arc::clone(image)));
        }
        let Some(image) = self.dataset.depth_image(&self.camera, frame)? else { return Ok(None) };
        if image.z_m().iter().all(|z| z.is_nan()) {
            tracing::warn!("{}: the depth image of frame {frame} has no valid value", self.dataset.name());
        }
        self.seen().say(&self.camera, depth_unit_doubt(&image));
        let image = Arc::new(image);
        *last = Some((frame, Arc::clone(&image)));
        Ok(Some(image))
    }
}

impl DepthSource for ZCamDepth {
    fn name(&self) -> &str {
        "zcam"
    }

    fn needs_world(&self, _: &Floor) -> bool {
        false
    }

    fn needs_images(&self) -> bool {
        true
    }

    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        let Some(image) = self.image(keyframe.frame)? else {
            return Ok(vec![Err(DepthMiss::NoDepth); pixels.len()]);
        };
        let (size, expected) =
            ((image.width(), image.height()), (keyframe.camera.width(), keyframe.camera.height()));
        if size != expected {
            return Err(DataError::new(format!(
                "the depth image of frame {} of {} has {}x{} pixels, the colour image {}x{}",
                keyframe.frame,
                self.dataset.name(),
                size.0,
                size.1,
                expected.0,
                expected.1
            ))
            .hint("depth images have to be registered to the colour images"));
        }
        let depths: Vec<_> = pixels.iter().map(|px| sample(&image, *px, &self.options)).collect();
        self.seen().against_floor.add(keyframe, pixels, &depths);
        Ok(depths)
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        let mut seen = self.seen();
        let doubt = seen.against_floor.doubt();
        seen.say(&self.camera, doubt);
        seen.said.iter().cloned().collect()
    }
}

/// Depth of an image between its pixels.
fn sample(image: &DepthImage, px: Pixel, options: &ZCamOptions) -> Result<DepthSample, DepthMiss> {
    let (width, height) = (f64::from(image.width()), f64::from(image.height()));
    // NaN is not inside either.
    if !(px.u >= -0.5 && px.v >= -0.5 && px.u < width - 0.5 && px.v < height - 0.5) {
        return Err(DepthMiss::OutsideImage);
    }
    let (left, top) = (px.u.floor(), px.v.floor());
    let (right_part, lower_part) = (px.u - left, px.v - top);
    let [near, far] = options.range_m;
    let (mut sum, mut weights, mut out_of_range) = (0.0, 0.0, false);
    let (mut nearest, mut farthest) = (f64::INFINITY, 0.0_f64);
    for (column, row, weight) in [
        (left, top, (1.0 - right_part) * (1.0 - lower_part)),
        (left + 1.0, top, right_part * (1.0 - lower_part)),
        (left, top + 1.0, (1.0 - right_part) * lower_part),
        (left + 1.0, top + 1.0, right_part * lower_part),
    ] {
        if weight <= 0.0 || column < 0.0 || row < 0.0 {
            continue;
        }
        let Some(z_m) = image.get(column as u32, row as u32).map(f64::from) else { continue };
        if z_m < near || z_m > far {
            out_of_range = true;
            continue;
        }
        (sum, weights) = (sum + weight * z_m, weights + weight);
        (nearest, farthest) = (nearest.min(z_m), farthest.max(z_m));
    }
    if weights == 0.0 {
        return Err(if out_of_range { DepthMiss::OutOfRange } else { DepthMiss::NoDepth });
    }
    Ok(DepthSample { z_m: sum / weights, on_edge: farthest > nearest * (1.0 + options.edge) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scene, camera, grid, look};
    use std::sync::atomic::{AtomicUsize, Ordering};
    use vice_core::camera::Camera;
    use vice_core::dataset::Image;
    use vice_core::frames::BodyFromCamera;
    use vice_core::time::Stamp;
    use vice_core::trajectory::Trajectory;

    /// A data set of one depth image.
    struct One(Option<DepthImage>, AtomicUsize);

    impl Dataset for One {
        fn name(&self) -> &str {
            "one"
        }
        fn format(&self) -> &str {
            "test"
        }
        fn cameras(&self) -> Vec<String> {
            vec!["cam".into()]
        }
        fn camera(&self, _: &str) -> DataResult<Camera> {
            Ok(camera())
        }
        fn frames(&self, _: &str) -> DataResult<Arc<[Stamp]>> {
            Ok(Arc::new([Stamp::default()]))
        }
        fn image(&self, _: &str, _: usize) -> DataResult<Image> {
            Err(DataError::new("no images"))
        }
        fn body_from_camera(&self, _: &str, _: Stamp) -> DataResult<BodyFromCamera> {
            Ok(BodyFromCamera::identity())
        }
        fn streams(&self) -> Vec<String> {
            vec![]
        }
        fn trajectory(&self, _: &str) -> DataResult<Trajectory> {
            Err(DataError::new("no streams"))
        }
        fn has_depth(&self, camera: &str) -> bool {
            camera == "cam"
        }
        fn depth_image(&self, _: &str, _: usize) -> DataResult<Option<DepthImage>> {
            self.1.fetch_add(1, Ordering::Relaxed);
            Ok(self.0.clone())
        }
    }

    fn source(image: Option<DepthImage>, options: ZCamOptions) -> (Arc<One>, ZCamDepth) {
        let one = Arc::new(One(image, AtomicUsize::new(0)));
        let source = ZCamDepth::new(one.clone(), "cam", options).unwrap();
        (one, source)
    }

    fn small(z_m: [f32; 6]) -> DepthImage {
        DepthImage::new(Stamp::default(), 3, 2, z_m.to_vec()).unwrap()
    }

    fn at(image: &DepthImage, u: f64, v: f64, range_m: [f64; 2]) -> Result<DepthSample, DepthMiss> {
        sample(image, Pixel::new(u, v), &ZCamOptions { range_m, ..ZCamOptions::default() })
    }

    #[test]
    fn weights_of_missing_neighbours_go_to_the_others() {
        let image = small([1.0, 1.02, 0.0, 1.04, f32::NAN, 4.0]);
        let all = [0.0, f64::INFINITY];
        let z = |u, v| at(&image, u, v, all).map(|d| ((d.z_m * 1e6).round() / 1e6, d.on_edge));
        assert_eq!(z(0.0, 0.0), Ok((1.0, false)));
        assert_eq!(z(-0.4, -0.4), Ok((1.0, false)), "half a pixel belongs to the border");
        assert_eq!(z(0.25, 0.0), Ok((1.005, false)));
        assert_eq!(z(0.5, 0.5), Ok((1.02, false)), "the fourth neighbour has no reading");
        assert_eq!(z(1.0, 1.0), Err(DepthMiss::NoDepth));
        assert_eq!(z(1.5, 0.5), Ok((2.51, true)), "a step is scored and flagged");
        for (u, v) in [(2.5, 0.0), (0.0, -0.6), (f64::NAN, 0.0), (0.0, f64::INFINITY)] {
            assert_eq!(z(u, v), Err(DepthMiss::OutsideImage));
        }
        assert_eq!(at(&image, 2.0, 1.0, [0.2, 3.0]), Err(DepthMiss::OutOfRange));
        assert!(!at(&image, 1.5, 0.5, [0.2, 3.0]).unwrap().on_edge);
    }

    #[test]
    fn what_cannot_be_used_is_said() {
        let pixels = [Pixel::new(1.0, 1.0)];
        let (camera, scene) = (camera(), Scene::room());
        let keyframe = look(&camera, [0.0, 0.0, 1.5], [2.0, 0.0, 0.5]);
        let error = source(Some(small([1.0; 6])), ZCamOptions::default()).1.depths(&keyframe, &pixels);
        let error = error.unwrap_err().to_string();
        assert!(error.contains("has 3x2 pixels, the colour image 752x480"), "{error}");
        let (_, none) = source(None, ZCamOptions::default());
        assert_eq!(none.depths(&keyframe, &pixels).unwrap(), [Err(DepthMiss::NoDepth)]);
        let zero = DepthImage::new(Stamp::default(), 752, 480, vec![0.0; 752 * 480]).unwrap();
        let (one, zero) = source(Some(zero), ZCamOptions::default());
        for _ in 0..2 {
            assert_eq!(zero.depths(&keyframe, &pixels).unwrap(), [Err(DepthMiss::NoDepth)]);
        }
        assert_eq!(one.1.load(Ordering::Relaxed), 1, "decoded once");
        let empty = ZCamOptions { range_m: [3.0, 1.0], ..ZCamOptions::default() };
        assert!(ZCamDepth::new(one.clone(), "cam", empty).is_err());
        assert!(ZCamDepth::new(one, "left", ZCamOptions::default()).is_err());
        assert!(scene.depth(&keyframe, pixels[0]) > 0.0);
    }

    #[test]
    fn between_pixels_it_is_exact_on_smooth_surfaces_and_flags_edges() {
        let (camera, scene) = (camera(), Scene::room());
        let keyframe = look(&camera, [-2.0, -1.0, 1.6], [1.0, -0.3, 0.6]);
        let z_m = grid(&camera, 1).into_iter().map(|px| scene.depth(&keyframe, px) as f32).collect();
        let image = DepthImage::new(Stamp::default(), 752, 480, z_m).unwrap();
        let (_, source) = source(Some(image), ZCamOptions::default());
        let pixels: Vec<Pixel> = grid(&camera, 5)
            .into_iter()
            .map(|p| Pixel::new(p.u + 0.37, p.v + 0.61))
            .filter(|p| camera.contains(*p))
            .collect();
        let depths = source.depths(&keyframe, &pixels).unwrap();
        let mut flagged = 0;
        for (px, depth) in pixels.iter().zip(depths) {
            let (depth, exact) = (depth.unwrap(), scene.depth(&keyframe, *px));
            flagged += usize::from(depth.on_edge);
            let off = (depth.z_m - exact).abs() / exact;
            assert!(depth.on_edge || off < 0.05, "{px:?}: {} instead of {exact}", depth.z_m);
        }
        assert!(flagged > 10 && flagged < pixels.len() / 20, "{flagged} of {}", pixels.len());
    }
}
