//! UZH-FPV drone racing: `left_images.txt` (Snapdragon) or `images.txt` (DAVIS) beside `img`, `imu.txt`,
//! `groundtruth.txt` (fpv.ifi.uzh.ch).
//!
//! Lists are `id timestamp image_name`, seconds. The ground truth is the pose of the IMU, the body, in a world whose z
//! points up. The calibration is a Kalibr camchain in an archive of its own: it is looked for in the folder and beside it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use vice_core::dataset::{Floor, GROUND_TRUTH};
use vice_core::error::DataResult;
use vice_core::frames::BodyFromCamera;
use vice_files::imu_file;

use super::Layout;
use super::tum::listed;
use super::tum_vi::placed;
use crate::calibration;
use crate::files::{folders, name};
use crate::parts::{CameraPart, Description, Intrinsics, Place, Read, Samples};
use crate::poses::{self, Shared};
use crate::settings::Settings;

pub(crate) const LAYOUT: Layout = Layout { name: "UZH-FPV", is, describe };

/// Lists of the cameras, and what the camchain calls them.
const LISTS: [(&str, &str); 3] =
    [("left_images.txt", "cam0"), ("right_images.txt", "cam1"), ("images.txt", "cam0")];

fn is(folder: &Path) -> bool {
    folder.join("img").is_dir() && LISTS.iter().any(|(list, _)| folder.join(list).is_file())
}

/// The camchain: in the folder, in a folder of calibrations in it, or in one beside it of the same recordings.
fn camchain(folder: &Path) -> Option<PathBuf> {
    let own = name(&folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf()));
    // `indoor_forward_3_snapdragon_with_gt` has `indoor_forward_calib_snapdragon` beside it.
    let kind = |text: &str| {
        let place = if text.contains("outdoor") { "outdoor" } else { "indoor" };
        let tilt = if text.contains("45") { "45" } else { "forward" };
        (place, tilt, text.contains("davis"))
    };
    let fits = |path: &PathBuf| name(path).contains("calib") && kind(&name(path)) == kind(&own);
    let beside = folder.canonicalize().ok().and_then(|p| p.parent().map(folders)).unwrap_or_default();
    let inside = folders(folder).into_iter().filter(|p| name(p).contains("calib"));
    let all = std::iter::once(folder.to_path_buf()).chain(inside).chain(beside.into_iter().filter(fits));
    all.into_iter().find_map(|place| calibration::in_folder(&place))
}

fn describe(folder: &Path, _: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    let chain = camchain(folder);
    let lists: Vec<(&str, &str)> =
        LISTS.into_iter().filter(|(list, _)| folder.join(list).is_file()).collect();
    let names: Vec<String> = lists.iter().map(|(_, camera)| (*camera).to_string()).collect();
    for (list, camera) in lists {
        let (file, root, all) = (chain.clone(), folder.to_path_buf(), names.clone());
        let read: Arc<Shared<(Intrinsics, Option<BodyFromCamera>)>> = Shared::new(move || match &file {
            Some(file) => calibration::of_file(file, camera, &all),
            None => Err(calibration::missing(
                &root,
                "UZH-FPV has its calibrations in archives of their own: put the folder beside this one, or give --calibration",
            )),
        });
        let (place, file) = (Arc::clone(&read), chain.clone().unwrap_or_else(|| folder.to_path_buf()));
        found.cameras.push(CameraPart {
            name: camera.to_string(),
            frames: listed(folder, list, "img"),
            intrinsics: Box::new(move || Ok(read.get()?.0.clone())),
            place: Place::Fixed(Box::new(move || placed(place.get()?.1, &file)) as Read<BodyFromCamera>),
            depth: None,
        });
    }
    let truth = folder.join("groundtruth.txt");
    if truth.is_file() {
        found.streams.push(poses::stream(GROUND_TRUTH, &truth));
    }
    let imu = folder.join("imu.txt");
    if imu.is_file() {
        found.imu = Some(Box::new(move || {
            let file = imu_file::read(&imu)?;
            Ok(Samples { samples: file.samples.into(), suspicions: file.suspicions.into_iter().collect() })
        }));
    }
    if let Some(chain) = chain {
        found.fact(format!("calibration: {}", chain.display()));
    }
    found.fact("the body is the IMU, the ground truth its pose; how high the floor is, is not known");
    found.floor = Floor::Unknown;
    Ok(found)
}
