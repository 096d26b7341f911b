//! The contract, as `include/vice_plugin.h` says it in C: the same names, the same layout (a test compiles the header and
//! compares). Its comment on conventions, memory, errors and threads is not repeated here.
//!
//! Everything that the other side fills is valid for any bits: there is no enum, no `bool`, no reference, and function
//! pointers are optional.

use std::ffi::c_void;

/// Version of the contract. A plugin of another version is not loaded.
pub const ABI_VERSION: u32 = 0;
/// Name of the one exported symbol, an [`Entry`].
pub const ENTRY_SYMBOL: &str = "vice_plugin";

/// The call did what it says.
pub const OK: i32 = 0;
/// There is none: no depth image for this frame, no cloud, no state.
pub const NONE: i32 = 1;
/// It failed; the message says why.
pub const ERROR: i32 = 2;
/// An exception or a panic was caught: a bug of the plugin.
pub const EXCEPTION: i32 = 3;

/// Flag of a [`PluginTable`]: its calls may overlap.
pub const FLAG_THREAD_SAFE: u64 = 1;

/// Not this format.
pub const PROBE_NO: i32 = 0;
/// A data set of this format.
pub const PROBE_YES: i32 = 1;
/// A folder of several data sets.
pub const PROBE_COLLECTION: i32 = 2;

/// No coefficients.
pub const MODEL_PINHOLE: i32 = 0;
/// k1 k2 p1 p2, or k1 k2 p1 p2 k3.
pub const MODEL_RADTAN: i32 = 1;
/// k1 k2 p1 p2 k3 k4 k5 k6.
pub const MODEL_RATIONAL: i32 = 2;
/// k1 k2 k3 k4.
pub const MODEL_EQUIDISTANT: i32 = 3;
/// Most coefficients that a model has.
pub const MAX_COEFFICIENTS: usize = 8;

/// Flag of a [`CameraEntry`]: depth images can be expected.
pub const CAMERA_HAS_DEPTH: u64 = 1;

/// A stream of poses.
pub const STREAM_POSES: i32 = 0;
/// A stream of relative motions.
pub const STREAM_RELATIVE: i32 = 1;

/// One byte a pixel.
pub const PIXELS_GRAY8: i32 = 0;
/// Three bytes a pixel: red, green, blue.
pub const PIXELS_RGB8: i32 = 1;

/// The points are in a PLY file.
pub const CLOUD_PLY: i32 = 0;
/// The points are in memory.
pub const CLOUD_POINTS: i32 = 1;

/// The floor is known in the world.
pub const FLOOR_WORLD: i32 = 0;
/// The floor is known in the body at the key frame.
pub const FLOOR_BODY: i32 = 1;

/// A line about something that failed.
pub const LOG_ERROR: i32 = 1;
/// A line about data that is used all the same.
pub const LOG_WARN: i32 = 2;
/// A line for those who asked for more.
pub const LOG_INFO: i32 = 3;

/// UTF-8, not ended by a zero.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Text {
    /// The bytes.
    pub data: *const u8,
    /// How many.
    pub length: usize,
}

/// Where a call writes its error.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Message {
    /// Memory of the caller.
    pub data: *mut u8,
    /// Its size.
    pub capacity: usize,
    /// Length of the whole text, even where it is cut.
    pub length: usize,
}

/// What the host gives.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Host {
    /// [`ABI_VERSION`] of the host.
    pub abi_version: u32,
    /// Size of this structure in the host.
    pub struct_size: u32,
    /// For [`Host::log`].
    pub context: *mut c_void,
    /// A line to the user, from any thread.
    pub log: Option<LogCall>,
}

/// `log(context, level, line)`.
pub type LogCall = unsafe extern "C" fn(*mut c_void, i32, Text);

/// A setting of the format.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct SettingInfo {
    /// Key of `--set key=value`.
    pub key: Text,
    /// What it does, with its default.
    pub description: Text,
}

/// A setting as given.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Key.
    pub key: Text,
    /// Value.
    pub value: Text,
}

/// What a path is.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// `PROBE_…`.
    pub answer: i32,
    /// 0.
    pub reserved: u32,
    /// Paths of a collection.
    pub paths: *const Text,
    /// How many.
    pub count: usize,
    /// To be released.
    pub owner: *mut c_void,
}

/// A camera of a data set.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CameraEntry {
    /// Its name.
    pub name: Text,
    /// `CAMERA_…`.
    pub flags: u64,
}

/// A pose stream of a data set.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct StreamEntry {
    /// Its name.
    pub name: Text,
    /// `STREAM_…`.
    pub kind: i32,
    /// 0.
    pub reserved: u32,
}

/// What a data set has.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DatasetInfo {
    /// A short name for tables.
    pub name: Text,
    /// Cameras; the first is the default.
    pub cameras: *const CameraEntry,
    /// How many.
    pub camera_count: usize,
    /// Pose streams.
    pub streams: *const StreamEntry,
    /// How many.
    pub stream_count: usize,
    /// To be released.
    pub owner: *mut c_void,
}

/// A rigid transform `a_from_b`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid {
    /// Translation, metres.
    pub translation_m: [f64; 3],
    /// Unit quaternion, w first.
    pub rotation_wxyz: [f64; 4],
}

/// A calibrated camera.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Focal length along columns.
    pub fx_px: f64,
    /// Focal length along rows.
    pub fy_px: f64,
    /// Principal point, column.
    pub cx_px: f64,
    /// Principal point, row.
    pub cy_px: f64,
    /// `MODEL_…`.
    pub model: i32,
    /// How many of the coefficients there are.
    pub coefficient_count: u32,
    /// Distortion, in the order of the model.
    pub coefficients: [f64; MAX_COEFFICIENTS],
}

/// Stamps of frames, strictly increasing.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Stamps {
    /// Nanoseconds.
    pub stamps_ns: *const i64,
    /// How many.
    pub count: usize,
    /// To be released.
    pub owner: *mut c_void,
}

/// A decoded image, rows from the top.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Image {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// `PIXELS_…`.
    pub format: i32,
    /// From the start of a row to the start of the next.
    pub row_stride_bytes: u32,
    /// The bytes.
    pub data: *const u8,
    /// How many.
    pub data_bytes: usize,
    /// To be released.
    pub owner: *mut c_void,
}

/// A depth image registered to a frame, rows from the top.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DepthImage {
    /// When it was taken.
    pub stamp_ns: i64,
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Metres along the optical axis; not finite or not positive: none.
    pub z_m: *const f32,
    /// How many bytes.
    pub data_bytes: usize,
    /// From the start of a row to the start of the next.
    pub row_stride_bytes: u32,
    /// 0.
    pub reserved: u32,
    /// To be released.
    pub owner: *mut c_void,
}

/// A pose of the body.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// When.
    pub stamp_ns: i64,
    /// Where.
    pub world_from_body: Rigid,
}

/// Poses, stamps strictly increasing.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Poses {
    /// The poses.
    pub poses: *const Pose,
    /// How many.
    pub count: usize,
    /// To be released.
    pub owner: *mut c_void,
}

/// The motion between two instants.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// The earlier instant.
    pub from_ns: i64,
    /// The later instant.
    pub to_ns: i64,
    /// From the body at the earlier to the body at the later.
    pub later_from_earlier: Rigid,
}

/// Motions, each from where the one before ended.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Motions {
    /// The motions.
    pub motions: *const Motion,
    /// How many.
    pub count: usize,
    /// To be released.
    pub owner: *mut c_void,
}

/// An inertial sample in the body frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// When.
    pub stamp_ns: i64,
    /// Angular rate.
    pub gyro_body_rad_s: [f64; 3],
    /// Specific force.
    pub accel_body_m_s2: [f64; 3],
}

/// Inertial samples, stamps strictly increasing.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ImuSamples {
    /// The samples.
    pub samples: *const ImuSample,
    /// How many.
    pub count: usize,
    /// To be released.
    pub owner: *mut c_void,
}

/// Where integrating inertial samples begins.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialState {
    /// When.
    pub stamp_ns: i64,
    /// Pose of the body.
    pub world_from_body: Rigid,
    /// Velocity of the body in the world.
    pub velocity_world_m_s: [f64; 3],
    /// Bias of the gyroscope.
    pub gyro_bias_body_rad_s: [f64; 3],
    /// Bias of the accelerometer.
    pub accel_bias_body_m_s2: [f64; 3],
}

/// A point of a scan.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Metres.
    pub x_m: f32,
    /// Metres.
    pub y_m: f32,
    /// Metres.
    pub z_m: f32,
}

/// The scan of the scene.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Cloud {
    /// `CLOUD_…`.
    pub kind: i32,
    /// 0.
    pub reserved: u32,
    /// The PLY file.
    pub ply_path: Text,
    /// The points.
    pub points: *const Point,
    /// How many.
    pub count: usize,
    /// Takes coordinates of the scan to the world.
    pub world_from_cloud: Rigid,
    /// To be released.
    pub owner: *mut c_void,
}

/// The plane `n·p + d = 0`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// `FLOOR_…`.
    pub frame: i32,
    /// 0.
    pub reserved: u32,
    /// `n`.
    pub normal: [f64; 3],
    /// `d`.
    pub d_m: f64,
}

/// A line that `vice info` shows.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Fact {
    /// Heading.
    pub section: Text,
    /// Line.
    pub text: Text,
}

/// Lines that `vice info` shows.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// The lines.
    pub facts: *const Fact,
    /// How many.
    pub count: usize,
    /// To be released.
    pub owner: *mut c_void,
}

/// The exported symbol.
pub type Entry = unsafe extern "C" fn(*const Host) -> *const PluginTable;
/// `probe(path, out, message)`.
pub type ProbeCall = unsafe extern "C" fn(Text, *mut Probe, *mut Message) -> i32;
/// `open(path, settings, setting_count, dataset, message)`.
pub type OpenCall = unsafe extern "C" fn(Text, *const Setting, usize, *mut *mut c_void, *mut Message) -> i32;
/// `close(dataset)` and `release(owner)`.
pub type FreeCall = unsafe extern "C" fn(*mut c_void);
/// `call(dataset, out, message)`.
pub type Call<T> = unsafe extern "C" fn(*mut c_void, *mut T, *mut Message) -> i32;
/// `call(dataset, index, out, message)`: of a camera or a stream.
pub type IndexCall<T> = unsafe extern "C" fn(*mut c_void, usize, *mut T, *mut Message) -> i32;
/// `call(dataset, camera_index, frame_index, out, message)`.
pub type FrameCall<T> = unsafe extern "C" fn(*mut c_void, usize, usize, *mut T, *mut Message) -> i32;
/// `call(dataset, stamp_ns, out, message)`.
pub type StampCall<T> = unsafe extern "C" fn(*mut c_void, i64, *mut T, *mut Message) -> i32;
/// `call(dataset, camera_index, stamp_ns, out, message)`.
pub type CameraStampCall<T> = unsafe extern "C" fn(*mut c_void, usize, i64, *mut T, *mut Message) -> i32;

/// What a plugin hands over. From [`PluginTable::relative_motions`] on the calls are optional.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct PluginTable {
    /// [`ABI_VERSION`] of the plugin.
    pub abi_version: u32,
    /// Size of this structure in the plugin.
    pub struct_size: u32,
    /// `FLAG_…`.
    pub flags: u64,
    /// Name of the format.
    pub name: Text,
    /// Version of the plugin.
    pub version: Text,
    /// One line for `vice formats`.
    pub description: Text,
    /// What data sets can have.
    pub offers: *const Text,
    /// How many.
    pub offer_count: usize,
    /// Settings.
    pub settings: *const SettingInfo,
    /// How many.
    pub setting_count: usize,
    /// Whether a path looks like this format.
    pub probe: Option<ProbeCall>,
    /// Opens a data set.
    pub open: Option<OpenCall>,
    /// Closes a data set.
    pub close: Option<FreeCall>,
    /// Frees what an `owner` stands for.
    pub release: Option<FreeCall>,
    /// What the data set has.
    pub describe: Option<Call<DatasetInfo>>,
    /// Calibration.
    pub camera: Option<IndexCall<Camera>>,
    /// Stamps of frames.
    pub frames: Option<IndexCall<Stamps>>,
    /// Pixels.
    pub image: Option<FrameCall<Image>>,
    /// Pose of the camera in the body at a stamp.
    pub body_from_camera: Option<CameraStampCall<Rigid>>,
    /// A stream of poses.
    pub trajectory: Option<IndexCall<Poses>>,
    /// A stream of relative motions.
    pub relative_motions: Option<IndexCall<Motions>>,
    /// Inertial samples.
    pub imu: Option<Call<ImuSamples>>,
    /// The reference state at a stamp.
    pub inertial_state: Option<StampCall<InertialState>>,
    /// The depth image of a frame.
    pub depth_image: Option<FrameCall<DepthImage>>,
    /// The scan.
    pub cloud: Option<Call<Cloud>>,
    /// The floor at a key frame.
    pub floor: Option<StampCall<Floor>>,
    /// More for `vice info`.
    pub facts: Option<Call<Facts>>,
}

impl PluginTable {
    /// A table of this size has all the calls that are not optional.
    pub const REQUIRED_SIZE: usize = std::mem::offset_of!(Self, relative_motions);
}
