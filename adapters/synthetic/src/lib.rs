//! A flight of which everything is known: a furnished room, rendered, with exact poses, depth and labels.
//!
//! A seed decides a [`Scene`] (floor, walls, boxes) and a [`Flight`] (an analytic curve around the boxes). From both
//! [`Synthetic`] makes a [`vice_core::dataset::Dataset`] in memory: images, depth, inertial samples, a scan, ground
//! truth, labels, and estimates that are wrong in one known way each. [`render_targets`] draws calibration targets with known corners.
#![forbid(unsafe_code)]

mod cloud;
mod dataset;
mod estimates;
mod flight;
mod hash;
mod labels;
mod material;
mod options;
mod pattern;
mod render;
mod scene;
mod sensors;
mod target;
mod texture;
mod write;

pub use dataset::{CAMERA, Synthetic};
pub use estimates::ESTIMATES;
pub use flight::{Flight, State};
pub use options::{Flaws, SyntheticOptions};
pub use scene::{Hit, ROOM_HEIGHT_M, ROOM_SIDE_M, Scene, Surface, SurfaceKind};
pub use target::{Shot, Target, render_targets};
pub use write::{METRES_PER_COUNT, write_euroc};
