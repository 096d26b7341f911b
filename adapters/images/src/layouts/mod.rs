//! The layouts that are known, a file each: how a folder is told, and what it holds.

mod colmap;
mod described;
mod icl_nuim;
mod kitti;
mod kitti_odometry;
mod kitti_raw;
mod nerfstudio;
mod oxts;
mod seven_scenes;
mod tum;
mod tum_vi;
mod uzh_fpv;

use std::path::Path;

use vice_core::error::DataResult;

use crate::parts::Description;
use crate::settings::Settings;

/// A layout.
pub(crate) struct Layout {
    /// Its name, for people.
    pub(crate) name: &'static str,
    /// Whether a folder has it. Cheap: names only.
    pub(crate) is: fn(&Path) -> bool,
    /// What is in a folder that has it.
    pub(crate) describe: fn(&Path, &Settings) -> DataResult<Description>,
}

/// All layouts, the more certain ones first: a folder is of the first that knows it.
pub(crate) const ALL: [Layout; 10] = [
    described::LAYOUT,
    tum_vi::LAYOUT,
    kitti_raw::LAYOUT,
    kitti_odometry::LAYOUT,
    icl_nuim::LAYOUT,
    tum::LAYOUT,
    seven_scenes::LAYOUT,
    uzh_fpv::LAYOUT,
    nerfstudio::LAYOUT,
    colmap::LAYOUT,
];
