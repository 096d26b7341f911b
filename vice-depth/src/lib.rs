//! Depth sources of VICE: how far along the optical axis the scene is at a pixel of a key frame.
//!
//! | source | needs | module |
//! | --- | --- | --- |
//! | [`FloorDepth`] | a plane | [`floor`] |
//! | [`ZCamDepth`] | depth images registered to the colour images | [`zcam`] |
//! | [`ZMapDepth`] | a scan of the scene, [`Cloud`], from a PLY, PCD or (with the feature `las`) LAS or LAZ file | [`zmap`] |
//! | [`MeshDepth`] | a mesh of the scene, [`Mesh`] | [`mesh`] |
//!
//! Each is a [`vice_core::depth::DepthSource`]; [`depth_image`] asks any of them for a whole image. [`floor_fit`] finds
//! the floor where nobody has measured it. The ray caster (parry) and the triangulation (spade) stay inside.
#![forbid(unsafe_code)]

pub mod cloud;
pub mod floor;
pub mod floor_fit;
pub mod image;
#[cfg(feature = "las")]
mod las;
pub mod mesh;
mod pcd;
mod ply;
mod scan_file;
mod scatter;
#[cfg(test)]
mod scene;
mod units;
pub mod zcam;
pub mod zmap;

pub use cloud::{Cloud, CloudOptions, ScanPoints, load_cloud, read_scan_points};
pub use floor::FloorDepth;
pub use floor_fit::{FloorFit, FloorFitOptions, fit_floor_to_cloud, fit_floor_to_depth_image};
pub use image::{DepthMap, depth_image};
pub use mesh::{Mesh, MeshDepth};
pub use zcam::{ZCamDepth, ZCamOptions};
pub use zmap::{Interpolation, ZMapDepth, ZMapOptions};
