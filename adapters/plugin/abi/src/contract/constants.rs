//! The numbers of the contract.

/// Version of the contract.
pub const ABI_VERSION: u32 = 2;
/// The oldest version that is still loaded.
pub const ABI_OLDEST: u32 = 0;

/// The call did what it says.
pub const OK: i32 = 0;
/// There is none: no depth image for this frame, no cloud, no state.
pub const NONE: i32 = 1;
/// It failed; the message says why: bytes or numbers that cannot be what they should be.
pub const ERROR: i32 = 2;
/// An exception or a panic was caught: a bug of the plugin.
pub const EXCEPTION: i32 = 3;
/// It failed: what is asked for is not there.
pub const ERROR_MISSING: i32 = 4;
/// It failed: well-formed data that the plugin does not read.
pub const ERROR_UNSUPPORTED: i32 = 5;
/// It failed: two statements exclude each other.
pub const ERROR_CONTRADICTORY: i32 = 6;
/// It failed: a setting makes no sense, whatever the data.
pub const ERROR_USAGE: i32 = 7;

/// Flag of a [`PluginTable`](super::PluginTable): its calls may overlap.
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
/// xi alpha; since version 2.
pub const MODEL_DS: i32 = 4;
/// alpha beta; since version 2.
pub const MODEL_EUCM: i32 = 5;
/// xi k1 k2 p1 p2; since version 2.
pub const MODEL_OMNI: i32 = 6;
/// w, radians; since version 2.
pub const MODEL_FOV: i32 = 7;
/// Most coefficients that a model has.
pub const MAX_COEFFICIENTS: usize = 8;

/// Flag of a [`CameraEntry`](super::CameraEntry): depth images can be expected.
pub const CAMERA_HAS_DEPTH: u64 = 1;

/// A stream of poses.
pub const STREAM_POSES: i32 = 0;
/// A stream of relative motions.
pub const STREAM_RELATIVE: i32 = 1;
/// A stream of poses that were chained from relative motions.
pub const STREAM_CHAINED: i32 = 2;

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

/// There was nothing to look at, or it does not suffice.
pub const STATE_UNKNOWN: i32 = 0;
/// Looked at, and as it should be.
pub const STATE_OK: i32 = 1;
/// A person should look.
pub const STATE_LOOK: i32 = 2;
/// Is wrong, or the data contradicts itself.
pub const STATE_WRONG: i32 = 3;

/// A line about something that failed.
pub const LOG_ERROR: i32 = 1;
/// A line about data that is used all the same.
pub const LOG_WARN: i32 = 2;
/// A line for those who asked for more.
pub const LOG_INFO: i32 = 3;
