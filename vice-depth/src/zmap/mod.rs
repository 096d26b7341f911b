//! Depth from a scan of the scene, in three steps that can be seen apart: select what is in view, drop what is
//! hidden (occlude), interpolate the rest.
//!
//! A few pixels are answered by their neighbourhoods: a window around each is grown until the triangle around the
//! pixel cannot change any more, which gives the very number that the whole image would. Many pixels, such as a depth
//! image, are answered by triangulating the whole image once.

mod buffer;
mod elsewhere;
mod interpolate;
mod natural;
mod occlude;
mod queries;
mod select;
#[cfg(test)]
mod tests;
mod thin;
mod triangle;

use std::sync::Arc;

use rayon::prelude::*;
use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::Floor;
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::DataResult;
use vice_core::frames::{self, Rigid, World};
use vice_core::suspicion::Suspicion;

use crate::cloud::Cloud;
use elsewhere::Nearest;
use interpolate::{Local, Surface};
use occlude::Occlusion;
use queries::Queries;
use select::{Seen, View, Window};
use triangle::Limits;

/// More pixels than this are answered by triangulating the whole image.
const MOST_WINDOWS: usize = 64;

/// Half the side of the first window around a pixel.
const FIRST_HALF_PX: f64 = 3.0;

/// How far outside the image points are taken in, over the focal length, so that their hull covers it.
const MARGIN: f64 = 0.03;

/// A window over this part of the image is not worth a triangulation of its own.
const LARGEST_PART: f64 = 0.25;

/// Noise of depth between triangles, as a share: clouds fused from stereo pairs are off by centimetres at two metres.
const ROUGHNESS: f64 = 0.03;

/// How a Z-map is made of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZMapOptions {
    /// Whether points behind a surface are dropped, and pixels on an occlusion edge refused. Without it the paper's
    /// Z-map is reproduced: points behind a surface leak through. With it, points just outside the image help too,
    /// so that the hull of the points covers the image, and where there are more than four points to a pixel (or to
    /// two milliradians, if that is more) one of each quarter is taken.
    pub occlusion: bool,
    /// Widest triangle that is trusted: its longest edge over the focal length, by default 0.1, which is 46 pixels
    /// at a focal length of 460.
    pub max_triangle: f64,
    /// How depth is found between the points.
    pub interpolation: Interpolation,
}

/// How depth is found between the points of a cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// On the plane through the corners of the triangle around the pixel.
    #[default]
    Linear,
    /// By the natural neighbours of the pixel (Sibson): no creases along the triangles' edges. Where a neighbour lies on
    /// another surface than the triangle, linearly.
    Natural,
}

impl Default for ZMapOptions {
    fn default() -> Self {
        Self { occlusion: true, max_triangle: 0.1, interpolation: Interpolation::Linear }
    }
}

/// Depth from a scan of the scene.
#[derive(Clone, Debug)]
pub struct ZMapDepth {
    cloud: Arc<Cloud>,
    world_from_cloud: Rigid<World, frames::Cloud>,
    options: ZMapOptions,
    nearest: Nearest,
}

impl ZMapDepth {
    /// A Z-map of a cloud that lies in the world.
    pub fn new(
        cloud: Arc<Cloud>,
        world_from_cloud: Rigid<World, frames::Cloud>,
        options: ZMapOptions,
    ) -> Self {
        Self { cloud, world_from_cloud, options, nearest: Nearest::default() }
    }

    /// The points of a key frame between which depth is interpolated, in no order that matters: their pixels
    /// and their depths in metres. Empty without an anchor.
    pub fn visible(&self, keyframe: &Keyframe<'_>) -> Vec<(Pixel, f64)> {
        let Some(camera_from_cloud) = self.camera_from_cloud(keyframe) else { return Vec::new() };
        let view = View::new(&self.cloud, keyframe.camera, &camera_from_cloud);
        let points = self.points(&view, &self.region(keyframe.camera));
        points.into_iter().map(|s| (Pixel::new(s.u, s.v), s.z_m)).collect()
    }

    fn camera_from_cloud(&self, keyframe: &Keyframe<'_>) -> Option<Rigid<frames::Camera, frames::Cloud>> {
        keyframe.world_from_camera.map(|pose| pose.inverse() * self.world_from_cloud)
    }

    /// The part of the image plane whose points are triangulated.
    fn region(&self, camera: &Camera) -> Window {
        let [fx, ..] = camera.fx_fy_cx_cy();
        Window::image(camera, if self.options.occlusion { MARGIN * fx } else { 0.0 })
    }

    fn points(&self, view: &View<'_>, window: &Window) -> Vec<Seen> {
        if self.options.occlusion {
            Occlusion::new(view, self.options.max_triangle).visible(window)
        } else {
            view.all_seen(window)
        }
    }

    fn limits<'a>(&self, view: &'a View<'a>) -> Limits<'a> {
        let [fx, ..] = view.camera().fx_fy_cx_cy();
        let refuses_edges = self.options.occlusion;
        let natural = self.options.interpolation == Interpolation::Natural;
        Limits { width_px: self.options.max_triangle * fx, view, refuses_edges, natural }
    }

    /// The answer of a pixel's neighbourhood, or `None` where it takes the whole image.
    fn local(
        &self,
        view: &View<'_>,
        region: &Window,
        pixel: Pixel,
    ) -> DataResult<Option<Result<DepthSample, DepthMiss>>> {
        let cell_px = occlude::cell_px(view.camera());
        let mut half_px = FIRST_HALF_PX;
        loop {
            let window = Window::around(pixel, half_px, cell_px).within(region);
            if window.area_px2() > LARGEST_PART * region.area_px2() {
                return Ok(None);
            }
            let surface = Surface::new(self.points(view, &window), self.limits(view))?;
            if let Local::Certain(answer) = surface.local(pixel, &window, region) {
                return Ok(Some(answer));
            }
            half_px *= 2.0;
        }
    }
}

impl DepthSource for ZMapDepth {
    fn name(&self) -> &str {
        "zmap"
    }

    fn needs_world(&self, _: &Floor) -> bool {
        true
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        self.cloud.suspicions().iter().cloned().chain(self.nearest.doubt(&self.cloud)).collect()
    }

    fn roughness(&self) -> f64 {
        ROUGHNESS
    }

    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        let Some(camera_from_cloud) = self.camera_from_cloud(keyframe) else {
            return Ok(vec![Err(DepthMiss::NoAnchor); pixels.len()]);
        };
        self.nearest.add(&self.cloud, &camera_from_cloud.inverse().translation());
        let camera = keyframe.camera;
        let view = View::new(&self.cloud, camera, &camera_from_cloud);
        let region = self.region(camera);
        let mut out = vec![Err(DepthMiss::OutsideImage); pixels.len()];
        let mut wanted: Vec<usize> = (0..pixels.len()).filter(|i| camera.contains(pixels[*i])).collect();
        if wanted.len() <= MOST_WINDOWS {
            let answers: Vec<_> = wanted
                .par_iter()
                .map(|i| self.local(&view, &region, pixels[*i]))
                .collect::<DataResult<_>>()?;
            let mut open = Vec::new();
            for (i, answer) in wanted.into_iter().zip(answers) {
                match answer {
                    Some(answer) => out[i] = answer,
                    None => open.push(i),
                }
            }
            wanted = open;
        }
        if !wanted.is_empty() {
            // The triangulation is one thread's work.
            let (surface, queries) = rayon::join(
                || Surface::new(self.points(&view, &region), self.limits(&view)),
                || Queries::new(pixels, &wanted),
            );
            surface?.fill(&queries, &mut out);
        }
        Ok(out)
    }
}
