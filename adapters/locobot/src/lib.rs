//! ROS recordings as VICE data sets: LoCoBot's by default, and any robot's with a camera, tf and odometry.
//!
//! ```text
//! container/   ROS 1 bag, MCAP, sqlite3: one reader; bytes of messages, nothing of what they mean
//! wire         ROS 1 serialisation and CDR through one reader
//! message      the messages, each described once
//! doubts       what looks wrong, said once
//! lenient      which poses are none, and which are mended
//! to_and_fro   two sources in one series
//! tf, urdf     which frame hangs on which
//! namespaces   the tf of several robots
//! series       what is kept of a topic
//! index        the pass over a recording: small messages decoded, images found
//! choose       topics and frames: as set, by LoCoBot's names, else by type
//! complete     joints that tf lacks
//! clocks       stamps of other machines
//! streams, imu, calibration, pixels      to the core's conventions
//! camera       images and the calibration that belongs to them
//! dataset      the data set
//! ```
//!
//! Memory: what stays is the tf tree, the poses, and 32 bytes an image; images are read when they are asked for, and
//! the few blocks around them are kept, so that a step forward decompresses a block once.
#![forbid(unsafe_code)]

mod calibration;
mod camera;
mod choose;
mod clocks;
mod complete;
mod container;
mod dataset;
mod doubts;
mod image_size;
mod imu;
mod index;
mod lenient;
mod message;
mod names;
mod namespaces;
mod open;
mod pixels;
mod series;
mod settings;
mod streams;
mod sweeps;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;
mod tf;
mod to_and_fro;
mod transform;
mod urdf;
mod wire;

use std::path::{Path, PathBuf};

use vice_core::dataset::{Dataset, DatasetFactory, FormatInfo, OpenOptions, Probe};
use vice_core::error::DataResult;

/// The name of the format.
pub const FORMAT: &str = "locobot";

/// Endings of recordings.
const ENDINGS: [&str; 3] = ["bag", "mcap", "db3"];

/// The format `locobot`: ROS 1 bags, MCAP files and rosbag2 data bases, alone, in parts, or in their folder.
#[derive(Clone, Copy, Debug, Default)]
pub struct Locobot;

impl DatasetFactory for Locobot {
    fn info(&self) -> FormatInfo {
        FormatInfo {
            name: FORMAT.to_string(),
            description: "ROS 1 bag, ROS 2 MCAP or sqlite3 recording of a LoCoBot or another robot"
                .to_string(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            offers: ["images", "depth", "imu", "floor", "streams"].map(str::to_string).to_vec(),
            settings: settings::infos(),
        }
    }

    fn probe(&self, path: &Path) -> Probe {
        // A description that cannot be used is for `open` to complain about.
        let Ok(found) = container::find(path) else { return Probe::Yes };
        match found.as_slice() {
            // A recording that was never written to is for `open` to explain.
            [] if path.is_file() && ENDINGS.iter().any(|e| path.extension().is_some_and(|x| x == *e)) => {
                Probe::Yes
            }
            [] => Probe::No,
            [_] => Probe::Yes,
            several => Probe::Collection(several.iter().filter_map(|f| place_of(path, &f.files)).collect()),
        }
    }

    fn open(&self, path: &Path, options: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
        Ok(Box::new(open::open(path, options)?))
    }
}

/// The path by which a recording in a folder can be opened: its file, or the folder that has all of its parts.
fn place_of(collection: &Path, files: &[PathBuf]) -> Option<PathBuf> {
    let first = files.first()?;
    match first.parent() {
        Some(folder) if folder != collection => Some(folder.to_path_buf()),
        _ => Some(first.clone()),
    }
}
