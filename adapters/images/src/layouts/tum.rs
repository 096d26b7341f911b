//! TUM RGB-D: `rgb.txt`, `depth.txt`, `groundtruth.txt` (vision.in.tum.de/data/datasets/rgbd-dataset/file_formats).
//!
//! Lists are `timestamp filename`, seconds. The ground truth gives the pose of the colour camera's optical frame in a
//! world whose z points up (a motion capture). Depth is registered to the colour image, 16 bits, 5000 counts a metre.
//! The intrinsics do not lie in the folder: those that the authors publish are taken by the folder's name.

use std::path::Path;

use vice_core::camera::Model;
use vice_core::dataset::{Floor, GROUND_TRUTH};
use vice_core::error::{DataError, DataResult};

use super::Layout;
use crate::calibration;
use crate::files::{has_picture, pictures};
use crate::list::List;
use crate::parts::{CameraPart, DepthPart, Description, Frames, Intrinsics, Place, Read};
use crate::poses;
use crate::settings::Settings;
use crate::stamps;

pub(crate) const LAYOUT: Layout = Layout { name: "TUM RGB-D", is, describe };

/// Counts a metre of the depth images.
pub(crate) const DEPTH_COUNTS: f64 = 5000.0;

/// What the authors publish, by the number of the camera: fx, fy, cx, cy, then k1, k2, p1, p2, k3.
const PUBLISHED: [(&str, [f64; 4], [f64; 5]); 3] = [
    ("1", [517.3, 516.5, 318.6, 255.3], [0.2624, -0.9531, -0.0054, 0.0026, 1.1633]),
    ("2", [520.9, 521.0, 325.1, 249.7], [0.2312, -0.7849, -0.0033, -0.0001, 0.9172]),
    ("3", [535.4, 539.2, 320.1, 247.6], [0.0; 5]),
];

fn is(folder: &Path) -> bool {
    folder.join("rgb.txt").is_file()
        && (has_picture(&folder.join("rgb")) || folder.join("depth.txt").is_file())
}

fn describe(folder: &Path, settings: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    let depth = folder.join("depth.txt").is_file();
    found.cameras.push(CameraPart {
        name: "rgb".to_string(),
        frames: listed(folder, "rgb.txt", "rgb"),
        intrinsics: intrinsics(folder, &found.name),
        place: Place::body(),
        depth: depth.then(|| {
            let (metres_per_count, from) = settings.metres_per_count(DEPTH_COUNTS, "TUM RGB-D");
            DepthPart { frames: listed(folder, "depth.txt", "depth"), metres_per_count, invalid: None, from }
        }),
    });
    found.fact("z is up; how high the floor is, is not known");
    found.floor = Floor::Unknown;
    let truth = folder.join("groundtruth.txt");
    if truth.is_file() {
        found.streams.push(poses::stream(GROUND_TRUTH, &truth));
        found.fact("groundtruth.txt gives the poses of the colour camera: it is the body");
    }
    Ok(found)
}

/// A list of pictures below a folder.
pub(crate) fn listed(folder: &Path, list: &str, pictures_in: &str) -> Read<Frames> {
    let (root, list, inside) = (folder.to_path_buf(), folder.join(list), folder.join(pictures_in));
    Box::new(move || {
        let list = List::read(&list)?;
        let there = if inside.is_dir() { pictures(&inside)? } else { Vec::new() };
        stamps::by_list(&list, &[&root, &inside], &there)
    })
}

fn intrinsics(folder: &Path, name: &str) -> Read<Intrinsics> {
    let (folder, lower) = (folder.to_path_buf(), name.to_ascii_lowercase());
    Box::new(move || {
        if let Some(file) = calibration::in_folder(&folder) {
            return Ok(calibration::of_file(&file, "rgb", &["rgb".to_string()])?.0);
        }
        let is = |number: &str| {
            [format!("freiburg{number}"), format!("fr{number}")]
                .iter()
                .any(|word| lower.contains(word.as_str()))
        };
        let Some((number, fx_fy_cx_cy, distortion)) = PUBLISHED.into_iter().find(|(n, _, _)| is(n)) else {
            return Err(calibration::missing(
                &folder,
                "its name does not say which camera of TUM it is, such as freiburg1: give --calibration, or put a calibration into the folder",
            ));
        };
        let from = format!("the authors' page, for freiburg{number}");
        let model =
            if distortion == [0.0; 5] { Ok(Model::Pinhole) } else { Model::from_name("radtan", &distortion) };
        let model = model.map_err(DataError::of)?;
        Ok(Intrinsics { size: Some([640, 480]), model, ..Intrinsics::pinhole(fx_fy_cx_cy, from) })
    })
}
