//! The format `blackbird`: flights of the MIT Blackbird data set, as its downloader leaves them.
//!
//! A flight is a folder `<trajectory>/<yawForward|yawConstant>/maxSpeedXpY` with `groundTruthPoses.csv`; a folder of
//! several of them is a collection. Cameras are rendered, so a flight may come in several *environments*: one folder each,
//! chosen by the setting `environment`. Names and what is read for them:
//!
//! | name | folder | from |
//! | --- | --- | --- |
//! | `left_gray`, `right_gray`, `down_gray`, `left_rgb`, `down_rgb` | `Camera_Left_Gray`, ... | `images/*` where unpacked, else `lossless.mov` through FFmpeg |
//! | depth of the left and the down camera | `Camera_Left_Depth`, ... | `images/*.png`, else `lossless.tar`, which is indexed and not unpacked |
//! | stream `ground-truth` | the flight's | `groundTruthPoses.csv` |
//! | inertial samples | the flight's | `csv/blackbird_slash_imu.csv` |
//!
//! Frames are matched to `nSecTimestamps.txt` by order. Without FFmpeg all that needs no pixels works; so does a flight
//! whose films were not downloaded. Where the file conventions end and the core's begin is the module `ned`:
#![doc = include_str!("ned.txt")]
//!
//! The floor is `z_scene = 0` with `z_scene = z_mocap - flightNormalizationOffset.z + offset.z`, the offset being that of
//! the environment in `trajectoryOffsets.yaml` at the root of the data set. Since z points down, an offset of -0.35 means
//! that the lowest point of the flight is 0.35 m above the floor.
#![forbid(unsafe_code)]

mod camera;
mod dataset;
mod depth;
mod factory;
mod layout;
mod ned;
mod offsets;
mod tables;

pub use factory::Blackbird;
