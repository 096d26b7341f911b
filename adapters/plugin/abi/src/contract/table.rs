//! The calls, and the table of them that a plugin hands over.

use std::ffi::c_void;

use super::values::{
    Camera, Cloud, DatasetInfo, DepthImage, Facts, Findings, Floor, Host, Image, ImageFile, ImuSamples,
    InertialState, Message, Motions, Poses, Probe, Rigid, Setting, SettingInfo, Stamps, Suspicions, Text,
};

/// Name of the one exported symbol, an [`Entry`].
pub const ENTRY_SYMBOL: &str = "vice_plugin";

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
    /// [`ABI_VERSION`](super::ABI_VERSION) of the plugin.
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
    /// The stored file of an image.
    pub image_file: Option<FrameCall<ImageFile>>,
    /// What looks wrong.
    pub suspicions: Option<Call<Suspicions>>,
    /// What the format's own checks find.
    pub checks: Option<Call<Findings>>,
}

impl PluginTable {
    /// A table of this size has all the calls that are not optional.
    pub const REQUIRED_SIZE: usize = std::mem::offset_of!(Self, relative_motions);
}
