//! What crosses the border.

use std::ffi::c_void;

use super::constants::MAX_COEFFICIENTS;

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
    /// Where in the text it begins to say what to do about it.
    pub hint_start: usize,
    /// How many bytes say so; 0 where nothing does.
    pub hint_length: usize,
}

/// What the host gives.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Host {
    /// [`ABI_VERSION`](super::ABI_VERSION) of the host.
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

/// The stored file of an image: PNG or JPEG.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ImageFile {
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

/// Something in the data that may make the numbers wrong.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Suspicion {
    /// A stable name, for programs.
    pub code: Text,
    /// What it is about; empty for the whole data set.
    pub about: Text,
    /// What looks wrong.
    pub message: Text,
    /// The numbers that make it look so, or empty.
    pub evidence: Text,
    /// What to do about it, or empty.
    pub advice: Text,
    /// How often the same was seen.
    pub count: u64,
}

/// What looks wrong.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Suspicions {
    /// Each once.
    pub suspicions: *const Suspicion,
    /// How many.
    pub count: usize,
    /// To be released.
    pub owner: *mut c_void,
}

/// A number behind a finding.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// What it is.
    pub name: Text,
    /// The number, finite.
    pub value: f64,
    /// Its unit; empty for shares and counts.
    pub unit: Text,
}

/// What a check of the format found.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Finding {
    /// Name of the check.
    pub check: Text,
    /// What was looked at; empty for the whole data set.
    pub about: Text,
    /// What was found.
    pub says: Text,
    /// What mends it, or empty.
    pub mend: Text,
    /// The numbers behind it.
    pub numbers: *const Number,
    /// How many.
    pub number_count: usize,
    /// `STATE_…`.
    pub state: i32,
    /// 0.
    pub reserved: u32,
}

/// What the format's checks found.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Findings {
    /// In their order.
    pub findings: *const Finding,
    /// How many.
    pub count: usize,
    /// To be released.
    pub owner: *mut c_void,
}
