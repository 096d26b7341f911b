//! EuRoC MAV data sets (the ASL layout) for VICE.
//!
//! ```text
//! SEQUENCE/mav0/                        the sequence's folder or mav0 itself is what is opened
//!   cam0/data.csv  sensor.yaml  data/   frames: `ns,file name`; cam1 … alike; columns by their names where a heading has them
//!   imu0/data.csv  sensor.yaml          ns, gyro rad/s, accel m/s²; turned into the body frame by its T_BS
//!   state_groundtruth_estimate0/data.csv   17 columns; else vicon0 or mocap0 with 8
//!   pointcloud0/data.ply  sensor.yaml   the scan; T_WR (world from scan) where it is not the world's
//!   depth0/data.csv  sensor.yaml  data/ depth images registered to a camera: not of the original data sets
//! ```
//!
//! The body is the IMU. A sequence opens without ground truth, IMU, cloud or depth. Lists are read once, when they are
//! first asked for; images are decoded one at a time. Settings: none.
//!
//! `depth0/sensor.yaml` has `sensor_type: depth`, `registered_to: cam0` and `metres_per_count: 0.0002`; its images are
//! 16 bit PNGs, 0 where there is no depth, and belong to the frame within half a frame period.
#![forbid(unsafe_code)]

mod camera;
mod dataset;
mod depth;
mod inertial;
mod listing;
mod sensor;

use std::path::{Path, PathBuf};

use vice_core::dataset::{Dataset, DatasetFactory, FormatInfo, OpenOptions, Probe};
use vice_core::error::{DataError, DataResult};

/// The format's name.
pub const NAME: &str = "euroc";

/// Opens EuRoC sequences.
#[derive(Clone, Copy, Debug, Default)]
pub struct Euroc;

impl DatasetFactory for Euroc {
    fn info(&self) -> FormatInfo {
        FormatInfo {
            name: NAME.into(),
            description: "EuRoC MAV and other sequences in the ASL layout (mav0)".into(),
            version: env!("CARGO_PKG_VERSION").into(),
            offers: ["images", "ground truth", "imu", "point cloud", "depth images"].map(Into::into).into(),
            settings: Vec::new(),
        }
    }

    fn probe(&self, path: &Path) -> Probe {
        if mav_folder(path).is_some() {
            return Probe::Yes;
        }
        // A folder of sequences, such as the one that the archives were unpacked into.
        let Ok(entries) = std::fs::read_dir(path) else { return Probe::No };
        let mut inside: Vec<PathBuf> =
            entries.filter_map(Result::ok).map(|e| e.path()).filter(|p| mav_folder(p).is_some()).collect();
        inside.sort();
        if inside.is_empty() { Probe::No } else { Probe::Collection(inside) }
    }

    fn open(&self, path: &Path, _options: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
        let folder = mav_folder(path).ok_or_else(|| {
            DataError::new("holds no EuRoC sequence")
                .at(path)
                .hint("a folder mav0 with cam0, imu0 or state_groundtruth_estimate0 is expected")
        })?;
        Ok(Box::new(dataset::Sequence::open(path, folder)?))
    }
}

/// The `mav0` folder of a path: below it, or the path itself where it holds sensors as `mav0` does.
fn mav_folder(path: &Path) -> Option<PathBuf> {
    let below = path.join("mav0");
    if below.is_dir() {
        // TUM-VI's export has no sensor.yaml but a camchain of all cameras beside: the format `images` reads it.
        let bare = below.join("cam0").is_dir() && !below.join("cam0/sensor.yaml").is_file();
        let chained =
            [path.join("dso/camchain.yaml"), path.join("camchain.yaml"), below.join("camchain.yaml")];
        return (!(bare && chained.iter().any(|file| file.is_file()))).then_some(below);
    }
    let has_sensor = ["cam0", "cam1", "imu0", dataset::GROUND_TRUTH_FOLDER]
        .iter()
        .any(|sensor| path.join(sensor).join("data.csv").is_file());
    has_sensor.then(|| path.to_path_buf())
}

#[cfg(test)]
mod dialect_tests;
#[cfg(test)]
mod tests;
