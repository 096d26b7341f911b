//! Depth source `stereo`: at a key frame, from where the second camera of a calibrated pair sees the same place.
//!
//! The neighbourhood of a pixel is carried to the second camera as if it stood upright at a depth, for all depths along
//! the ray; where it looks most alike is the depth. The tracker must find the place there too, without knowing of the
//! line that it has to lie on.

mod sweep;

use std::sync::{Arc, Mutex, PoisonError};

use rayon::prelude::*;
use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::{Dataset, Floor};
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{self, Rigid};
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};

use crate::{PointTrack, Pyramid, TrackOptions};
use sweep::{Pair, Sweep};

/// Two exposures of a pair are at most so far apart.
const SAME_TIME: Span = Span::from_millis(2);

/// How sure a place in the second image is, pixels.
const MATCH_PX: f64 = 0.3;

/// The tracker may be off the line of the sweep by this, pixels.
const OFF_LINE_PX: f64 = 1.5;

/// A depth less sure than this part of it is flagged, as that of tags is.
const UNSURE: f64 = 0.01;

/// A depth less sure than this part of it is none.
const USELESS: f64 = 0.2;

/// More pixels than this are a whole image: each is looked for along its own line, which takes milliseconds.
const MOST_PIXELS: usize = 10_000;

/// Nearer cameras than this are no pair, metres.
const LEAST_BASELINE_M: f64 = 1e-3;

/// Depth of pixels from a second camera. The images of both are decoded; no anchor, floor or scan is needed.
pub struct StereoDepth {
    dataset: Arc<dyn Dataset>,
    camera_name: String,
    second_name: String,
    second: Camera,
    second_stamps: Arc<[Stamp]>,
    /// Key frames without a second image.
    alone: Mutex<u64>,
}

impl StereoDepth {
    /// Depth in the images of a camera from those of a second one.
    ///
    /// # Errors
    /// [`DataError`] if the second camera has no calibration or frames, or is the first.
    pub fn new(dataset: Arc<dyn Dataset>, camera_name: &str, second_name: &str) -> DataResult<Self> {
        if camera_name == second_name {
            return Err(DataError::of_kind(
                ErrorKind::Usage,
                format!("{camera_name} is no second camera to itself"),
            ));
        }
        let second = dataset.camera(second_name)?;
        let second_stamps = dataset.frames(second_name)?;
        Ok(Self {
            dataset,
            camera_name: camera_name.to_string(),
            second_name: second_name.to_string(),
            second,
            second_stamps,
            alone: Mutex::new(0),
        })
    }

    /// The frame of the second camera at a stamp.
    fn beside(&self, stamp: Stamp) -> Option<usize> {
        let after = self.second_stamps.partition_point(|s| *s < stamp);
        let off = |i: &usize| self.second_stamps[*i].since(stamp).abs();
        let near = [after.checked_sub(1), Some(after).filter(|i| *i < self.second_stamps.len())];
        near.into_iter().flatten().min_by_key(off).filter(|i| off(i) <= SAME_TIME)
    }
}

impl DepthSource for StereoDepth {
    fn name(&self) -> &str {
        "stereo"
    }

    fn needs_world(&self, _: &Floor) -> bool {
        false
    }

    fn needs_images(&self) -> bool {
        true
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        let alone = *self.alone.lock().unwrap_or_else(PoisonError::into_inner);
        let doubt = (alone > 0).then(|| {
            Suspicion::new(
                "stereo-alone",
                self.second_name.as_str(),
                "key frames have no image of this camera",
            )
            .evidence(format!("{alone} key frames without one within {} ms", SAME_TIME.as_secs_f64() * 1e3))
            .times(alone)
        });
        doubt.into_iter().collect()
    }

    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        if pixels.len() > MOST_PIXELS {
            return Err(DataError::of_kind(
                ErrorKind::Unsupported,
                format!("the depth source stereo is of single points, and {} pixels are asked", pixels.len()),
            )
            .hint("`vice depth compare --depth zmap,stereo` shows it at labelled points"));
        }
        let Some(index) = self.beside(keyframe.stamp) else {
            *self.alone.lock().unwrap_or_else(PoisonError::into_inner) += 1;
            return Ok(vec![Err(DepthMiss::NoMatch); pixels.len()]);
        };
        let body_from_second = self.dataset.body_from_camera(&self.second_name, keyframe.stamp)?;
        let second_from_first: Rigid<frames::Camera, frames::Camera> =
            body_from_second.inverse() * keyframe.body_from_camera;
        let baseline_m = second_from_first.translation().norm();
        if baseline_m < LEAST_BASELINE_M {
            return Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!(
                    "the cameras {} and {} are {baseline_m:.6} m apart: no pair that sees depth",
                    self.camera_name, self.second_name
                ),
            )
            .hint("is the place of both in the body calibrated?"));
        }
        let pyramid = |name: &str, camera: &Camera, index: usize| -> DataResult<Arc<Pyramid>> {
            let image = self.dataset.image(name, index)?;
            if (image.width(), image.height()) != (camera.width(), camera.height()) {
                return Err(DataError::of_kind(
                    ErrorKind::Contradictory,
                    format!(
                        "the calibration of {name} is of {}x{} images, this one has {}x{}",
                        camera.width(),
                        camera.height(),
                        image.width(),
                        image.height()
                    ),
                ));
            }
            Pyramid::for_tracking(&image).map(Arc::new)
        };
        let pair = Pair {
            first: pyramid(&self.camera_name, keyframe.camera, keyframe.frame)?,
            second: pyramid(&self.second_name, &self.second, index)?,
            cameras: [keyframe.camera, &self.second],
            second_from_first,
        };
        Ok(pixels.par_iter().map(|px| depth(&pair, *px)).collect())
    }
}

/// The depth of one pixel.
fn depth(pair: &Pair<'_>, px: Pixel) -> Result<DepthSample, DepthMiss> {
    if !pair.cameras[0].contains(px) {
        return Err(DepthMiss::OutsideImage);
    }
    pair.cameras[0].unproject(px).map_err(|_| DepthMiss::OutsideModel)?;
    let sweep = Sweep::new(pair, px).ok_or(DepthMiss::NoMatch)?;
    let found = sweep.best().ok_or(DepthMiss::NoMatch)?;
    let mut track =
        PointTrack::start(&pair.first, px, TrackOptions::default()).map_err(|_| DepthMiss::NoMatch)?;
    let seen = track.step(&pair.second, Some(found.px));
    if !seen.outcome.is_found() || seen.px.distance_px(found.px) > OFF_LINE_PX {
        return Err(DepthMiss::NoMatch);
    }
    // A step along the ray that the images cannot tell from none, as a part of the depth.
    let unsure = MATCH_PX / (found.px_per_inverse_m * found.inverse_m);
    if unsure.is_nan() || unsure > USELESS {
        return Err(DepthMiss::NoMatch);
    }
    Ok(DepthSample { z_m: 1.0 / found.inverse_m, on_edge: unsure > UNSURE })
}

#[cfg(test)]
mod tests;
