//! Depth sources of VICE: how far along the optical axis the scene is at a pixel of a key frame.
//!
//! | source | needs | module |
//! | --- | --- | --- |
//! | [`FloorDepth`] | a plane | [`floor`] |
//! | [`ZMapDepth`] | a scan of the scene, [`Cloud`] | [`zmap`] |
//!
//! Each is a [`vice_core::depth::DepthSource`]. The ray caster (parry) and the triangulation (spade) stay inside.
#![forbid(unsafe_code)]

pub mod cloud;
pub mod floor;
mod ply;
#[cfg(test)]
mod scene;
pub mod zmap;

pub use cloud::{Cloud, CloudOptions, load_cloud};
pub use floor::FloorDepth;
pub use zmap::{ZMapDepth, ZMapOptions};
