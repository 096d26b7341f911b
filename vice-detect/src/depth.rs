//! Depth source `tag`: at a key frame, from the plane of the tag that the pixel lies on, which is that of all tags that
//! share it.

use std::sync::Arc;

use nalgebra::{Vector2, Vector3};
use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::{Dataset, Floor};
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::{DataError, DataResult};

use crate::detect::find_tags;
use crate::plane::{Alone, SharedPlane, shared};
use crate::pose::tag_pose;
use crate::tag::{Tag, TagOptions};

/// A pixel this near to a tag's corner is that corner, pixels.
const AT_CORNER_PX: f64 = 2.0;

/// A depth less sure than this part of it is flagged.
const UNSURE: f64 = 0.01;

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
        let tags = find_tags(&image, self.options, Some(keyframe.camera));
        let tags = placed(keyframe.camera, tags, self.size_m);
        Ok(pixels.iter().map(|px| depth(keyframe.camera, *px, &tags)).collect())
    }
}

/// A tag, and the plane that it lies on.
struct Placed {
    tag: Tag,
    plane: SharedPlane,
    /// Its tilt may be the wrong way round, and no other tag tells.
    ambiguous: bool,
}

/// The planes of tags: one for those that share it, their own for the others.
fn placed(camera: &Camera, tags: Vec<Tag>, size_m: f64) -> Vec<Placed> {
    let focal_px = camera.fx_fy_cx_cy()[0];
    let (mut single, mut placed) = (Vec::new(), Vec::new());
    for tag in tags {
        let Some(pose) = tag_pose(camera, &tag.corners, size_m) else { continue };
        let seen = tag.corners.map(|c| camera.unproject(c).map_or(Vector2::repeat(f64::NAN), |ray| ray.xy()));
        let normal = pose.camera_from_tag.rotation * Vector3::z();
        let start = normal / normal.dot(&pose.camera_from_tag.translation.vector);
        let Some(alone) = Alone::new(seen, size_m, start, focal_px) else { continue };
        placed.push(Placed { tag, plane: alone.plane, ambiguous: pose.ambiguous });
        single.push(alone);
    }
    if let Some((plane, together)) = shared(&single, size_m, focal_px) {
        for at in together {
            placed[at].plane = plane;
            placed[at].ambiguous = false;
        }
    }
    placed
}

/// Where the ray of a pixel meets the plane of the tag that it lies on, or of the corner that it is.
fn depth(camera: &Camera, px: Pixel, tags: &[Placed]) -> Result<DepthSample, DepthMiss> {
    let ray = camera.unproject(px).map_err(|_| DepthMiss::OutsideModel)?;
    let to_corner = |tag: &Tag| tag.corners.iter().map(|c| c.distance_px(px)).fold(f64::MAX, f64::min);
    let nearest = tags.iter().min_by(|a, b| to_corner(&a.tag).total_cmp(&to_corner(&b.tag)));
    let on = match nearest {
        Some(near) if to_corner(&near.tag) < AT_CORNER_PX => Some(near),
        _ => tags.iter().find(|placed| inside(&placed.tag.corners, px)),
    };
    let on = on.ok_or(DepthMiss::NoTarget)?;
    let (z_m, deviation_m) = on.plane.depth_m(&ray).ok_or(DepthMiss::NoTarget)?;
    Ok(DepthSample { z_m, on_edge: on.ambiguous || deviation_m > UNSURE * z_m })
}

/// Whether a pixel lies in a convex quadrangle whose corners go clockwise.
fn inside(corners: &[Pixel; 4], px: Pixel) -> bool {
    (0..4).all(|i| {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        (b.u - a.u) * (px.v - a.v) - (b.v - a.v) * (px.u - a.u) >= 0.0
    })
}
