//! What an adapter promises: the [`Dataset`] and [`DatasetFactory`] traits, and the plain values that cross them.
//!
//! An adapter converts to the core's conventions once, where a row is read: stamps in nanoseconds, metres, radians,
//! `world_from_body` and `body_from_camera`, a world whose z points up. Nothing is decoded that is not asked for:
//! frames are stamps, pixels come one image at a time.

mod calibrated;
mod depth_unit;
mod image;
mod plane;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Point3;

pub use calibrated::Calibrated;
pub use depth_unit::depth_unit_doubt;
pub use image::{DepthImage, Image, PixelFormat};
pub use plane::{Floor, Plane};

use crate::camera::Camera;
use crate::error::DataResult;
use crate::finding::Finding;
use crate::frames::{BodyFromCamera, Cloud, Rigid, World};
use crate::imu::{ImuSample, InertialState};
use crate::suspicion::Suspicion;
use crate::time::Stamp;
use crate::trajectory::{PoseCovariance, Trajectory};

/// The name of the stream that is the ground truth, where a data set has one.
pub const GROUND_TRUTH: &str = "ground-truth";

/// A recorded run of one robot.
///
/// All methods may be called from several threads. Names come from the data set itself: [`Dataset::cameras`] and
/// [`Dataset::streams`] list them, and asking for another one is an error that lists them too.
pub trait Dataset: Send + Sync {
    /// A short name for tables and documents, such as `V1_01_easy`.
    fn name(&self) -> &str;

    /// The format's name, as its factory has it.
    fn format(&self) -> &str;

    /// Names of the cameras; the first is the default.
    fn cameras(&self) -> Vec<String>;

    /// Intrinsics of a camera.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if there is no such camera or its calibration cannot be used.
    fn camera(&self, camera: &str) -> DataResult<Camera>;

    /// Stamps of a camera's frames, strictly increasing. The position in this list is the frame's index.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if there is no such camera or its list of frames cannot be used.
    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>>;

    /// Decodes one image.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if the index is out of range or the image cannot be decoded.
    fn image(&self, camera: &str, index: usize) -> DataResult<Image>;

    /// The stored file of one image, where it is a PNG or JPEG of its own: a browser shows it without decoding here.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if the index is out of range or the file cannot be read.
    fn image_file(&self, _camera: &str, _index: usize) -> DataResult<Option<Vec<u8>>> {
        Ok(None)
    }

    /// Pose of the camera in the body at a stamp: a function of time, since heads pan and tilt.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if there is no such camera or its place is unknown at that stamp.
    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera>;

    /// Names of the pose streams, [`GROUND_TRUTH`] among them where there is one.
    fn streams(&self) -> Vec<String>;

    /// A pose stream.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if there is no such stream or its rows cannot be used.
    fn trajectory(&self, stream: &str) -> DataResult<Trajectory>;

    /// What the messages of a pose stream say of its own errors, where they do: in the order of time, and only where it differs
    /// from what was said before.
    ///
    /// # Errors
    /// As [`Dataset::trajectory`].
    fn pose_covariances(&self, _stream: &str) -> DataResult<Vec<PoseCovariance>> {
        Ok(Vec::new())
    }

    /// Whether a pose stream was chained from relative motions: it starts anywhere, and knows no floor.
    fn is_relative(&self, _stream: &str) -> bool {
        false
    }

    /// Inertial samples in the body frame, strictly ordered; empty where the robot has none.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if there are samples that cannot be used.
    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        Ok(Arc::new([]))
    }

    /// The reference state (pose, velocity, biases) at a stamp, where the data set records or can derive one.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if there should be one but it cannot be used.
    fn inertial_state(&self, _stamp: Stamp) -> DataResult<Option<InertialState>> {
        Ok(None)
    }

    /// The depth image registered to a frame of a camera, where there is one.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if there is one but it cannot be decoded.
    fn depth_image(&self, _camera: &str, _index: usize) -> DataResult<Option<DepthImage>> {
        Ok(None)
    }

    /// Whether [`Dataset::depth_image`] can be expected to give anything for a camera, without decoding.
    fn has_depth(&self, _camera: &str) -> bool {
        false
    }

    /// The scan of the scene, where there is one.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if its description cannot be used. The points themselves are read by the depth source.
    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        Ok(None)
    }

    /// The faces of the scene, where there are any; by default those of the scan's file.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if their description cannot be used.
    fn mesh(&self) -> DataResult<Option<CloudRef>> {
        self.cloud()
    }

    /// The floor as it is known at a key frame. By default z = 0 of the world; [`Floor::Unknown`] where nothing tells.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if the floor depends on data that is missing at that stamp.
    fn floor(&self, _keyframe: Stamp) -> DataResult<Floor> {
        Ok(Floor::World(Plane::z_zero()))
    }

    /// What looked wrong when the data set was opened and read so far, each said once. Asked after the data was read.
    fn suspicions(&self) -> Vec<Suspicion> {
        Vec::new()
    }

    /// What the format's own checks find, beside those of [`check`](crate::check) that know no format: their names are the
    /// format's. Asked by `vice check`; nothing large is read for it.
    fn checks(&self) -> Vec<Finding> {
        Vec::new()
    }

    /// More that `vice info` should show, such as topics with their types and counts.
    fn facts(&self) -> Vec<Fact> {
        Vec::new()
    }
}

/// Makes data sets of one format.
pub trait DatasetFactory: Send + Sync {
    /// What the format is.
    fn info(&self) -> FormatInfo;

    /// Whether a path looks like this format. Cheap: looks at names and first bytes, never at a whole file.
    fn probe(&self, path: &Path) -> Probe;

    /// Whether it reads layouts that many programs write: it yields to any other format that claims the same path, such
    /// as a plugin for one's own robot.
    fn is_general(&self) -> bool {
        false
    }

    /// Opens a data set.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) that says what is missing or wrong, and where.
    fn open(&self, path: &Path, options: &OpenOptions) -> DataResult<Box<dyn Dataset>>;
}

/// What a format is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormatInfo {
    /// The name that `--format` takes.
    pub name: String,
    /// One line for `vice formats`.
    pub description: String,
    /// Version of the adapter.
    pub version: String,
    /// What data sets of this format can offer, such as `images`, `imu`, `depth`.
    pub offers: Vec<String>,
    /// Settings that [`OpenOptions::settings`] may hold.
    pub settings: Vec<SettingInfo>,
}

/// A setting of a format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SettingInfo {
    /// The key of `--set key=value`.
    pub key: String,
    /// What it does, with its default.
    pub description: String,
}

/// What a factory thinks of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Probe {
    /// Not this format.
    No,
    /// A data set of this format.
    Yes,
    /// A folder of several data sets, each of which can be opened by its path.
    Collection(Vec<PathBuf>),
}

/// How to open a data set.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct OpenOptions {
    /// Settings of the format, by key.
    pub settings: BTreeMap<String, String>,
}

/// A line that `vice info` prints beside the common ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fact {
    /// Heading under which it stands, such as `topics`.
    pub section: String,
    /// The line.
    pub text: String,
}

/// Where the points of a scan are.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum CloudSource {
    /// A file of points: PLY, or what else the depth sources read.
    File(PathBuf),
    /// Points in memory, metres.
    Points(Arc<[Point3<f32>]>),
}

/// A scan of the scene and its place in the world.
#[derive(Clone, Debug)]
pub struct CloudRef {
    /// Where the points are.
    pub source: CloudSource,
    /// Takes coordinates of the scan to the world.
    pub world_from_cloud: Rigid<World, Cloud>,
}
