//! TUM-VI as its EuRoC export: `mav0` without `sensor.yaml`, the calibration in `dso/camchain.yaml` (Kalibr)
//! (cvg.cit.tum.de/data/datasets/visual-inertial-dataset).
//!
//! The body is the IMU, which the camchain places the cameras in (`T_cam_imu`). `mocap0` gives poses of the IMU in a
//! world whose z points up, only where the motion capture saw it; `imu0` is in rad/s and m/s².

use std::path::{Path, PathBuf};

use vice_core::dataset::{Floor, GROUND_TRUTH};
use vice_core::error::DataResult;
use vice_core::frames::BodyFromCamera;
use vice_files::{imu_file, trajectory};

use super::Layout;
use super::tum::listed;
use crate::calibration;
use crate::files::{folders, name};
use crate::parts::{CameraPart, Description, Place, Poses, Read, Samples, StreamPart};
use crate::poses::Shared;
use crate::settings::Settings;

pub(crate) const LAYOUT: Layout = Layout { name: "TUM-VI", is, describe };

fn is(folder: &Path) -> bool {
    let camera = folder.join("mav0/cam0");
    camera.join("data.csv").is_file() && !camera.join("sensor.yaml").is_file() && camchain(folder).is_some()
}

fn camchain(folder: &Path) -> Option<PathBuf> {
    ["dso/camchain.yaml", "camchain.yaml", "mav0/camchain.yaml"]
        .iter()
        .map(|p| folder.join(p))
        .find(|p| p.is_file())
}

fn describe(folder: &Path, _: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    let mav = folder.join("mav0");
    let chain = camchain(folder).unwrap_or_else(|| folder.join("dso/camchain.yaml"));
    let cameras: Vec<PathBuf> = folders(&mav)
        .into_iter()
        .filter(|p| name(p).starts_with("cam") && p.join("data.csv").is_file())
        .collect();
    let names: Vec<String> = cameras.iter().map(|p| name(p)).collect();
    for (path, camera) in cameras.iter().zip(&names) {
        let (file, own, all) = (chain.clone(), camera.clone(), names.clone());
        let read = Shared::new(move || calibration::of_file(&file, &own, &all));
        let (place, file) = (std::sync::Arc::clone(&read), chain.clone());
        found.cameras.push(CameraPart {
            name: camera.clone(),
            frames: listed(path, "data.csv", "data"),
            intrinsics: Box::new(move || Ok(read.get()?.0.clone())),
            place: Place::Fixed(Box::new(move || placed(place.get()?.1, &file)) as Read<BodyFromCamera>),
            depth: None,
        });
    }
    let poses = ["mocap0", "state_groundtruth_estimate0", "vicon0"].map(|p| mav.join(p).join("data.csv"));
    if let Some(path) = poses.into_iter().find(|p| p.is_file()) {
        let read = Box::new(move || {
            let file = trajectory::read_euroc(&path)?;
            Ok(Poses { trajectory: file.trajectory, suspicions: file.suspicions.into_iter().collect() })
        });
        found.streams.push(StreamPart { name: GROUND_TRUTH.to_string(), read });
    }
    let imu = mav.join("imu0/data.csv");
    if imu.is_file() {
        found.imu = Some(Box::new(move || {
            let file = imu_file::read(&imu)?;
            Ok(Samples { samples: file.samples.into(), suspicions: file.suspicions.into_iter().collect() })
        }));
    }
    found.fact("the body is the IMU, the ground truth its pose; how high the floor is, is not known");
    found.floor = Floor::Unknown;
    Ok(found)
}

/// Extrinsics, or why there are none.
pub(crate) fn placed(place: Option<BodyFromCamera>, file: &Path) -> DataResult<BodyFromCamera> {
    place.ok_or_else(|| {
        vice_core::error::DataError::of_kind(
            vice_core::error::ErrorKind::Missing,
            "does not say where the camera sits in the body",
        )
        .at(file)
        .hint("T_cam_imu is expected; or give --calibration with it")
    })
}
