//! 7-Scenes: `frame-000000.color.png`, `.depth.png`, `.pose.txt` (microsoft.com, RGB-D Dataset 7-Scenes).
//!
//! Poses are 4x4 `world_from_camera` by KinectFusion, whose world has no up of its own. Depth is in millimetres, 65535
//! where there is none; 0 is none either. The authors name 585 px and (320, 240) for the depth camera and calibrate
//! nothing: colour and depth are not registered to each other exactly. Frames are counted at 30 Hz.

use std::path::{Path, PathBuf};

use vice_core::dataset::{Floor, GROUND_TRUTH};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::WorldFromBody;
use vice_core::time::Stamp;

use super::Layout;
use crate::calibration;
use crate::files::{entries, name};
use crate::parts::{CameraPart, DepthPart, Description, Frames, Intrinsics, Place, Poses, Read, StreamPart};
use crate::poses::{collected, left_out};
use crate::settings::Settings;
use crate::stamps::{self, at_index};

pub(crate) const LAYOUT: Layout = Layout { name: "7-Scenes", is, describe };

/// Counts a metre of the depth images.
const DEPTH_COUNTS: f64 = 1000.0;
/// The count that is no depth.
const INVALID: u16 = 65_535;

/// The number of a file of a frame, where its name ends so.
fn number(path: &Path, ending: &str) -> Option<u64> {
    name(path).strip_prefix("frame-")?.strip_suffix(ending)?.parse().ok()
}

fn is(folder: &Path) -> bool {
    let names = || std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok).map(|e| e.path());
    names().any(|p| number(&p, ".color.png").is_some()) && names().any(|p| number(&p, ".pose.txt").is_some())
}

fn describe(folder: &Path, settings: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    let fps = settings.fps_or_assumed();
    let has_depth = entries(folder)?.iter().any(|p| number(p, ".depth.png").is_some());
    let own = folder.to_path_buf();
    found.cameras.push(CameraPart {
        name: "color".to_string(),
        frames: ending(folder, ".color.png", fps),
        intrinsics: Box::new(move || match calibration::in_folder(&own) {
            Some(file) => Ok(calibration::of_file(&file, "color", &["color".to_string()])?.0),
            None => Ok(Intrinsics::pinhole([585.0, 585.0, 320.0, 240.0], "the authors' page")),
        }),
        place: Place::body(),
        depth: has_depth.then(|| {
            let (metres_per_count, from) = settings.metres_per_count(DEPTH_COUNTS, "7-Scenes");
            let frames = ending(folder, ".depth.png", fps);
            DepthPart { frames, metres_per_count, invalid: Some(INVALID), from }
        }),
    });
    let path = folder.to_path_buf();
    found
        .streams
        .push(StreamPart { name: GROUND_TRUTH.to_string(), read: Box::new(move || poses(&path, fps)) });
    if calibration::in_folder(folder).is_none() {
        found.doubt(
            "not-calibrated",
            "the camera of 7-Scenes was not calibrated: 585 px and (320, 240), which its authors name for the depth camera, are taken for colour too",
            "--calibration replaces them; colour is nearer to 525 px",
        );
    }
    found.fact(
        "poses are those of the camera, by KinectFusion: it is the body, and which way is up is not known",
    );
    found.floor = Floor::Unknown;
    Ok(found)
}

fn with_ending(folder: &Path, ending: &str) -> DataResult<Vec<(u64, PathBuf)>> {
    Ok(entries(folder)?.into_iter().filter_map(|p| number(&p, ending).map(|n| (n, p))).collect())
}

fn ending(folder: &Path, ending: &'static str, fps: f64) -> Read<Frames> {
    let folder = folder.to_path_buf();
    Box::new(move || {
        let mut frames = Vec::new();
        for (number, path) in with_ending(&folder, ending)? {
            frames.push((at_index(number, fps, Stamp::default()).map_err(|e| e.at(&path))?, path));
        }
        stamps::in_order(&folder, frames, vec![stamps::made(&folder, fps)])
    })
}

fn poses(folder: &Path, fps: f64) -> DataResult<Poses> {
    let (mut poses, mut none, mut first) = (Vec::new(), 0, String::new());
    for (number, path) in with_ending(folder, ".pose.txt")? {
        match pose(&path)? {
            Some(pose) => {
                poses.push((at_index(number, fps, Stamp::default()).map_err(|e| e.at(&path))?, pose))
            }
            None => {
                if none == 0 {
                    first = name(&path);
                }
                none += 1;
            }
        }
    }
    collected(folder, poses, left_out(folder, none, &first).into_iter().collect())
}

/// A pose; `None` where tracking was lost and the file says so by numbers that are none.
fn pose(path: &Path) -> DataResult<Option<WorldFromBody>> {
    let text =
        std::fs::read_to_string(path).map_err(|e| DataError::new("cannot be read").at(path).because(e))?;
    let mut numbers = Vec::new();
    for (line, row) in (1..).zip(text.lines()) {
        for word in row.split_whitespace() {
            let number = word.trim_end_matches(',').parse::<f64>().map_err(|e| {
                DataError::new(format!("`{word}` is no number")).at(path).line(line).because(e)
            })?;
            numbers.push(number);
        }
    }
    let count = numbers.len();
    let matrix = <[f64; 16]>::try_from(numbers)
        .map_err(|_| DataError::new(format!("{count} numbers, where a pose is a matrix of 4x4")).at(path))?;
    if matrix.iter().any(|v| !v.is_finite()) {
        return Ok(None);
    }
    WorldFromBody::try_from_row_major(&matrix).map(Some).map_err(|e| DataError::of(e).at(path))
}
