//! The calls between the program and the process of a plugin, by number.

/// What the plugin is: asked first.
pub(super) const HELLO: u8 = 0;
/// What it thinks of a path.
pub(super) const PROBE: u8 = 1;
/// Opens a data set, of which all further calls are.
pub(super) const OPEN: u8 = 2;
pub(super) const CAMERA: u8 = 3;
pub(super) const FRAMES: u8 = 4;
pub(super) const IMAGE: u8 = 5;
pub(super) const IMAGE_FILE: u8 = 6;
pub(super) const BODY_FROM_CAMERA: u8 = 7;
pub(super) const TRAJECTORY: u8 = 8;
pub(super) const IMU: u8 = 9;
pub(super) const INERTIAL_STATE: u8 = 10;
pub(super) const DEPTH_IMAGE: u8 = 11;
pub(super) const CLOUD: u8 = 12;
pub(super) const FLOOR: u8 = 13;
pub(super) const SUSPICIONS: u8 = 14;
pub(super) const CHECKS: u8 = 15;
pub(super) const FACTS: u8 = 16;
