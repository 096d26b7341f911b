//! Depth from a scan of the scene: select what is in view, drop what is hidden, interpolate the rest.

mod interpolate;
mod occlude;
mod select;

use std::sync::Arc;

use vice_core::camera::Pixel;
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::DataResult;
use vice_core::frames::{self, Rigid, World};

use crate::cloud::Cloud;
use interpolate::{Limits, Surface};

/// How a Z-map is made of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZMapOptions {
    /// Whether points behind a surface are dropped. Without it the paper's Z-map is reproduced: they leak through.
    pub occlusion: bool,
    /// Widest triangle that is trusted: its longest edge over the focal length.
    pub max_triangle: f64,
}

impl Default for ZMapOptions {
    fn default() -> Self {
        Self { occlusion: true, max_triangle: 0.1 }
    }
}

/// Depth from a scan of the scene.
#[derive(Clone, Debug)]
pub struct ZMapDepth {
    cloud: Arc<Cloud>,
    world_from_cloud: Rigid<World, frames::Cloud>,
    options: ZMapOptions,
}

impl ZMapDepth {
    /// A Z-map of a cloud that lies in the world.
    pub const fn new(
        cloud: Arc<Cloud>,
        world_from_cloud: Rigid<World, frames::Cloud>,
        options: ZMapOptions,
    ) -> Self {
        Self { cloud, world_from_cloud, options }
    }
}

impl DepthSource for ZMapDepth {
    fn name(&self) -> &str {
        "zmap"
    }

    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        let Some(world_from_camera) = keyframe.world_from_camera else {
            return Ok(vec![Err(DepthMiss::NoAnchor); pixels.len()]);
        };
        let camera_from_cloud = world_from_camera.inverse() * self.world_from_cloud;
        let mut seen = select::in_view(&self.cloud, &camera_from_cloud, keyframe.camera);
        let [fx, ..] = keyframe.camera.fx_fy_cx_cy();
        let mut limits = Limits { width_px: self.options.max_triangle * fx, depth_ratio: f64::INFINITY };
        if self.options.occlusion {
            limits.depth_ratio = 0.1;
            seen = occlude::visible(seen, limits.depth_ratio);
        }
        let surface = Surface::new(seen, limits)?;
        Ok(pixels.iter().map(|p| surface.depth(*p)).collect())
    }
}
