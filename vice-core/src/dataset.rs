//! What an adapter promises: the [`Dataset`] and [`DatasetFactory`] traits, and the plain values that cross them.
//!
//! An adapter converts to the core's conventions once, where a row is read: stamps in nanoseconds, metres, radians,
//! `world_from_body` and `body_from_camera`, a world whose z points up. Nothing is decoded that is not asked for:
//! frames are stamps, pixels come one image at a time.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Point3, Unit, Vector3};

use crate::camera::Camera;
use crate::error::{DataError, DataResult};
use crate::frames::{Body, BodyFromCamera, Cloud, Rigid, World};
use crate::imu::{ImuSample, InertialState};
use crate::time::Stamp;
use crate::trajectory::Trajectory;

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
    /// [`DataError`] if there is no such camera or its calibration cannot be used.
    fn camera(&self, camera: &str) -> DataResult<Camera>;

    /// Stamps of a camera's frames, strictly increasing. The position in this list is the frame's index.
    ///
    /// # Errors
    /// [`DataError`] if there is no such camera or its list of frames cannot be used.
    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>>;

    /// Decodes one image.
    ///
    /// # Errors
    /// [`DataError`] if the index is out of range or the image cannot be decoded.
    fn image(&self, camera: &str, index: usize) -> DataResult<Image>;

    /// The stored file of one image, where it is a PNG or JPEG of its own: a browser shows it without decoding here.
    ///
    /// # Errors
    /// [`DataError`] if the index is out of range or the file cannot be read.
    fn image_file(&self, _camera: &str, _index: usize) -> DataResult<Option<Vec<u8>>> {
        Ok(None)
    }

    /// Pose of the camera in the body at a stamp: a function of time, since heads pan and tilt.
    ///
    /// # Errors
    /// [`DataError`] if there is no such camera or its place is unknown at that stamp.
    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera>;

    /// Names of the pose streams, [`GROUND_TRUTH`] among them where there is one.
    fn streams(&self) -> Vec<String>;

    /// A pose stream.
    ///
    /// # Errors
    /// [`DataError`] if there is no such stream or its rows cannot be used.
    fn trajectory(&self, stream: &str) -> DataResult<Trajectory>;

    /// Whether a pose stream was chained from relative motions: it starts anywhere, and knows no floor.
    fn is_relative(&self, _stream: &str) -> bool {
        false
    }

    /// Inertial samples in the body frame, strictly ordered; empty where the robot has none.
    ///
    /// # Errors
    /// [`DataError`] if there are samples that cannot be used.
    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        Ok(Arc::new([]))
    }

    /// The reference state (pose, velocity, biases) at a stamp, where the data set records or can derive one.
    ///
    /// # Errors
    /// [`DataError`] if there should be one but it cannot be used.
    fn inertial_state(&self, _stamp: Stamp) -> DataResult<Option<InertialState>> {
        Ok(None)
    }

    /// The depth image registered to a frame of a camera, where there is one.
    ///
    /// # Errors
    /// [`DataError`] if there is one but it cannot be decoded.
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
    /// [`DataError`] if its description cannot be used. The points themselves are read by the depth source.
    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        Ok(None)
    }

    /// The floor as it is known at a key frame. By default z = 0 of the world.
    ///
    /// # Errors
    /// [`DataError`] if the floor depends on data that is missing at that stamp.
    fn floor(&self, _keyframe: Stamp) -> DataResult<Floor> {
        Ok(Floor::World(Plane::z_zero()))
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

    /// Opens a data set.
    ///
    /// # Errors
    /// [`DataError`] that says what is missing or wrong, and where.
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

/// How the bytes of an [`Image`] are laid out; rows are tight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PixelFormat {
    /// One byte a pixel.
    Gray8,
    /// Three bytes a pixel: red, green, blue.
    Rgb8,
}

impl PixelFormat {
    /// Bytes a pixel takes.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Gray8 => 1,
            Self::Rgb8 => 3,
        }
    }
}

/// A decoded image, rows tight and from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    width: u32,
    height: u32,
    format: PixelFormat,
    data: Vec<u8>,
}

impl Image {
    /// An image from its bytes.
    ///
    /// # Errors
    /// [`DataError`] if the number of bytes is not `width * height * format.bytes()`.
    pub fn new(width: u32, height: u32, format: PixelFormat, data: Vec<u8>) -> DataResult<Self> {
        let expected = width as usize * height as usize * format.bytes();
        if data.len() == expected {
            Ok(Self { width, height, format, data })
        } else {
            let got = data.len();
            Err(DataError::new(format!(
                "a {width}x{height} {format:?} image has {expected} bytes, got {got}"
            )))
        }
    }

    /// Columns.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Layout of the bytes.
    pub const fn format(&self) -> PixelFormat {
        self.format
    }

    /// The bytes.
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// The bytes, given away.
    pub fn into_data(self) -> Vec<u8> {
        self.data
    }
}

/// A depth image registered to a colour image: metres along the optical axis, NaN where there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthImage {
    /// When it was taken.
    pub stamp: Stamp,
    width: u32,
    height: u32,
    z_m: Vec<f32>,
}

impl DepthImage {
    /// A depth image; values that are not finite or not positive become NaN, which means no depth.
    ///
    /// # Errors
    /// [`DataError`] if the number of values is not `width * height`.
    pub fn new(stamp: Stamp, width: u32, height: u32, mut z_m: Vec<f32>) -> DataResult<Self> {
        let (expected, got) = (width as usize * height as usize, z_m.len());
        if got != expected {
            return Err(DataError::new(format!(
                "a {width}x{height} depth image has {expected} values, got {got}"
            )));
        }
        // Stored in any case, so that several are done at once.
        for z in &mut z_m {
            *z = if z.is_finite() && *z > 0.0 { *z } else { f32::NAN };
        }
        Ok(Self { stamp, width, height, z_m })
    }

    /// Columns.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Metres along the optical axis, row by row, NaN where there is none.
    pub fn z_m(&self) -> &[f32] {
        &self.z_m
    }

    /// Depth of a pixel; `None` outside the image or where there is none.
    pub fn get(&self, column: u32, row: u32) -> Option<f32> {
        if column >= self.width || row >= self.height {
            return None;
        }
        let z = self.z_m[row as usize * self.width as usize + column as usize];
        (!z.is_nan()).then_some(z)
    }
}

/// Where the points of a scan are.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum CloudSource {
    /// A PLY file.
    Ply(PathBuf),
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

/// The plane `n·p + d = 0` in frame `F`, `n` of unit length, `d` in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane<F> {
    normal: Unit<Vector3<f64>>,
    d_m: f64,
    frame: std::marker::PhantomData<fn() -> F>,
}

impl<F> Plane<F> {
    /// The plane `n·p + d = 0`; both are divided by the length of `n`.
    ///
    /// # Errors
    /// [`DataError`] if a number is not finite or the normal is shorter than 1e-9.
    pub fn new(normal: [f64; 3], d_m: f64) -> DataResult<Self> {
        let n = Vector3::from(normal);
        let length = n.norm();
        if !(length.is_finite() && d_m.is_finite()) {
            return Err(DataError::new("the plane has a number that is not finite"));
        }
        if length < 1e-9 {
            return Err(DataError::new("the normal of the plane is zero")
                .hint("give it as nx,ny,nz,d with n·p + d = 0"));
        }
        Ok(Self {
            normal: Unit::new_unchecked(n / length),
            d_m: d_m / length,
            frame: std::marker::PhantomData,
        })
    }

    /// The plane of a normal that is of unit length already, kept to the bit; `d_m` is finite.
    pub const fn from_unit(normal: Unit<Vector3<f64>>, d_m: f64) -> Self {
        Self { normal, d_m, frame: std::marker::PhantomData }
    }

    /// z = 0.
    pub fn z_zero() -> Self {
        Self { normal: Vector3::z_axis(), d_m: 0.0, frame: std::marker::PhantomData }
    }

    /// The unit normal.
    pub const fn normal(&self) -> Unit<Vector3<f64>> {
        self.normal
    }

    /// `d` of `n·p + d = 0`, metres.
    pub const fn d_m(&self) -> f64 {
        self.d_m
    }

    /// The same plane in another frame.
    pub fn transformed<G>(&self, g_from_f: &Rigid<G, F>) -> Plane<G> {
        let normal = Unit::new_normalize(g_from_f.rotate(&self.normal));
        let d_m = self.d_m - normal.dot(&g_from_f.translation());
        Plane { normal, d_m, frame: std::marker::PhantomData }
    }
}

/// The floor, in the frame in which it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Floor {
    /// In the world: the camera's place is taken from the anchor.
    World(Plane<World>),
    /// In the body at the key frame (a ground robot stands on it): no anchor is used.
    Body(Plane<Body>),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::WorldFromBody;

    #[test]
    fn a_plane_moves_with_its_frame() {
        let floor = Plane::<World>::new([0.0, 0.0, 2.0], -1.0).unwrap();
        assert_eq!((floor.normal().z, floor.d_m()), (1.0, -0.5));
        let world_from_body =
            WorldFromBody::try_from_parts([1.0, 2.0, 3.0], [0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0, 0.0])
                .unwrap();
        let in_body = floor.transformed(&world_from_body.inverse());
        let on_floor = world_from_body.inverse().transform_point(&Point3::new(7.0, -4.0, 0.5));
        assert!((in_body.normal().dot(&on_floor.coords) + in_body.d_m()).abs() < 1e-12);
        assert!(Plane::<World>::new([0.0; 3], 1.0).is_err());
        assert!(Plane::<World>::new([f64::NAN, 0.0, 1.0], 1.0).is_err());
    }

    #[test]
    fn images_know_their_size() {
        assert!(Image::new(2, 2, PixelFormat::Rgb8, vec![0; 12]).is_ok());
        assert!(Image::new(2, 2, PixelFormat::Gray8, vec![0; 5]).is_err());
        let depth = DepthImage::new(Stamp::default(), 2, 1, vec![0.0, 1.5]).unwrap();
        assert_eq!((depth.get(0, 0), depth.get(1, 0), depth.get(2, 0)), (None, Some(1.5), None));
    }
}
