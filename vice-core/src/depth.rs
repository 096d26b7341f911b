//! Depth sources: how far along the optical axis the scene is at a pixel of a key frame.

use crate::camera::{Camera, Pixel};
use crate::dataset::{Dataset, Floor};
use crate::error::DataResult;
use crate::frames::{BodyFromCamera, WorldFromBody, WorldFromCamera};
use crate::suspicion::Suspicion;
use crate::time::Stamp;

/// A key frame as a depth source sees it.
#[derive(Clone, Copy, Debug)]
pub struct Keyframe<'a> {
    /// When.
    pub stamp: Stamp,
    /// Index of the frame among the camera's frames.
    pub frame: usize,
    /// Intrinsics.
    pub camera: &'a Camera,
    /// Extrinsics at that stamp.
    pub body_from_camera: BodyFromCamera,
    /// The camera's place in the world by the anchor; `None` where the anchor has no pose at that stamp.
    pub world_from_camera: Option<WorldFromCamera>,
    /// The floor as it is known at that stamp.
    pub floor: Floor,
}

impl<'a> Keyframe<'a> {
    /// A frame of a data set's camera, with the body's pose in the world by the anchor, where it has one.
    ///
    /// # Errors
    /// [`crate::error::DataError`] if the camera's place in the body or the floor is unknown at that stamp.
    pub fn at(
        dataset: &dyn Dataset,
        (name, camera): (&str, &'a Camera),
        (frame, stamp): (usize, Stamp),
        world_from_body: Option<WorldFromBody>,
    ) -> DataResult<Self> {
        let body_from_camera = dataset.body_from_camera(name, stamp)?;
        Ok(Self {
            stamp,
            frame,
            camera,
            body_from_camera,
            world_from_camera: world_from_body.map(|pose| pose * body_from_camera),
            floor: dataset.floor(stamp)?,
        })
    }
}

/// A depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthSample {
    /// Metres along the optical axis.
    pub z_m: f64,
    /// The neighbourhood straddles a depth edge: scored, and flagged.
    pub on_edge: bool,
}

impl DepthSample {
    /// A depth away from edges.
    pub const fn new(z_m: f64) -> Self {
        Self { z_m, on_edge: false }
    }
}

/// Why a pixel has no depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum DepthMiss {
    /// The anchor has no pose at the key frame, and the source needs one.
    #[error("the anchor has no pose at the key frame")]
    NoAnchor,
    /// The ray runs at or above the horizon and never meets the floor in front of the camera.
    #[error("the ray does not meet the floor in front of the camera")]
    AboveHorizon,
    /// The pixel has no ray: the distortion model does not reach it.
    #[error("the distortion model does not reach the pixel")]
    OutsideModel,
    /// The pixel lies outside the depth image or the colour image.
    #[error("the pixel is outside the image")]
    OutsideImage,
    /// No point of the cloud is in view.
    #[error("no point of the cloud is in view")]
    EmptyView,
    /// The pixel lies outside the hull of the projected cloud.
    #[error("the pixel is outside the hull of the projected cloud")]
    OutsideHull,
    /// The triangle around the pixel is too wide to trust.
    #[error("the triangle of cloud points around the pixel is too wide to trust")]
    TriangleTooWide,
    /// The triangle around the pixel spans an occlusion edge.
    #[error("the triangle of cloud points around the pixel spans an occlusion edge")]
    OcclusionEdge,
    /// The depth image has no valid value around the pixel.
    #[error("the depth image has no valid value at the pixel")]
    NoDepth,
    /// The depth is outside the range asked for.
    #[error("the depth is outside the range asked for")]
    OutOfRange,
    /// The ray meets no surface of the mesh.
    #[error("the ray meets no surface of the mesh")]
    NoSurface,
    /// The pixel lies on no calibration target whose pose is known.
    #[error("the pixel lies on no calibration target whose pose is known")]
    NoTarget,
    /// No place of the second camera's image is surely the same.
    #[error("no place of the second camera's image is surely the same")]
    NoMatch,
    /// The later labels are too few or seen from too near to say how far away the point is.
    #[error("the later labels are too few or seen from too near by to say how far away the point is")]
    LittleParallax,
    /// By the motion of the stream the rays of the labels do not meet in front of the camera.
    #[error("by the stream's motion the rays of the labels do not meet in front of the camera")]
    RaysApart,
}

/// Something that knows the depth of pixels at key frames.
pub trait DepthSource: Send + Sync {
    /// Name in tables and documents: `floor`, `zmap`, `zcam`, `mesh`, `tag`, `stereo`, `triangulated`.
    fn name(&self) -> &str;

    /// Depths of pixels of one key frame, in their order. Asked once for all pixels of a key frame, since what can be
    /// shared between them (a projected cloud, a decoded image) is most of the work.
    ///
    /// # Errors
    /// [`crate::error::DataError`] if the data behind the source cannot be read. A pixel without depth is no error but
    /// a [`DepthMiss`].
    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>>;

    /// Whether the source asks where the camera is in the world, with the floor as it is known: then the anchor must be
    /// in the world of that floor or cloud.
    fn needs_world(&self, floor: &Floor) -> bool;

    /// Whether the source takes a shape for granted, as a floor does, and so is no witness against one that measures.
    fn is_assumed(&self) -> bool {
        false
    }

    /// Whether the depth of a point is what its own later labels and the stream under test say, so that nobody but an
    /// evaluation can ask it, and each stream has depths of its own.
    fn needs_track(&self) -> bool {
        false
    }

    /// Whether the source decodes images or depth images of the data set.
    fn needs_images(&self) -> bool {
        false
    }

    /// Share of a depth by which the answers at neighbouring pixels differ by noise alone, one standard deviation: that
    /// of a scanned cloud. Zero where the surface is smooth, or where depth does not depend on the camera's place.
    fn roughness(&self) -> f64 {
        0.0
    }

    /// What looked wrong in the data that it was asked about so far, each said once. Asked after the last key frame.
    fn suspicions(&self) -> Vec<Suspicion> {
        Vec::new()
    }
}
