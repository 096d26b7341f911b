//! Depth source `tag`: at a key frame, from the pose of the tag that the pixel lies on.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::{Dataset, Floor};
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::{DataError, DataResult};

use crate::detect::find_tags;
use crate::pose::{TagPose, tag_pose};
use crate::tag::{Tag, TagOptions};

/// A pixel this near to a tag's corner is that corner, pixels.
const AT_CORNER_PX: f64 = 2.0;

/// Depth of pixels on tags of a known size. The key frame's image is decoded and searched; no anchor, floor or scan is
/// needed.
pub struct TagDepth {
    dataset: Arc<dyn Dataset>,
    camera_name: String,
    options: TagOptions,
    size_m: f64,
}

impl TagDepth {
    /// Tags whose dark border is `size_m` wide on its outside, in the images of a camera.
    ///
    /// # Errors
    /// [`DataError`] if the size is not a positive number.
    pub fn new(
        dataset: Arc<dyn Dataset>,
        camera_name: &str,
        options: TagOptions,
        size_m: f64,
    ) -> DataResult<Self> {
        if !(size_m.is_finite() && size_m > 0.0) {
            return Err(DataError::new(format!("the size of tags is {size_m} m, not a positive number")));
        }
        Ok(Self { dataset, camera_name: camera_name.to_string(), options, size_m })
    }
}

impl DepthSource for TagDepth {
    fn name(&self) -> &str {
        "tag"
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
        let image = self.dataset.image(&self.camera_name, keyframe.frame)?;
        let tags: Vec<(Tag, TagPose)> = find_tags(&image, self.options, Some(keyframe.camera))
            .into_iter()
            .filter_map(|tag| Some((tag, tag_pose(keyframe.camera, &tag.corners, self.size_m)?)))
            .collect();
        Ok(pixels.iter().map(|px| depth(keyframe.camera, *px, &tags)).collect())
    }
}

/// A corner's own depth, or where the ray meets the tag that the pixel lies on.
fn depth(camera: &Camera, px: Pixel, tags: &[(Tag, TagPose)]) -> Result<DepthSample, DepthMiss> {
    let ray = camera.unproject(px).map_err(|_| DepthMiss::OutsideModel)?;
    let to_corner = |tag: &Tag| tag.corners.iter().map(|c| c.distance_px(px)).fold(f64::MAX, f64::min);
    let nearest = tags.iter().min_by(|a, b| to_corner(&a.0).total_cmp(&to_corner(&b.0)));
    let on = match nearest {
        Some(near) if to_corner(&near.0) < AT_CORNER_PX => Some(near),
        _ => tags.iter().find(|(tag, _)| inside(&tag.corners, px)),
    };
    let (_, pose) = on.ok_or(DepthMiss::NoTarget)?;
    let normal = pose.camera_from_tag.rotation * Vector3::z();
    let centre = Point3::from(pose.camera_from_tag.translation.vector);
    let z_m = normal.dot(&centre.coords) / normal.dot(&ray);
    if !(z_m.is_finite() && z_m > 0.0) {
        return Err(DepthMiss::NoTarget);
    }
    Ok(DepthSample { z_m, on_edge: pose.ambiguous })
}

/// Whether a pixel lies in a convex quadrangle whose corners go clockwise.
fn inside(corners: &[Pixel; 4], px: Pixel) -> bool {
    (0..4).all(|i| {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        (b.u - a.u) * (px.v - a.v) - (b.v - a.v) * (px.u - a.u) >= 0.0
    })
}
