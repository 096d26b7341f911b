//! Calibrations that lie in a folder, for layouts that do not have their own.

use std::path::{Path, PathBuf};

use vice_core::camera::Model;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::BodyFromCamera;
use vice_core::suspicion::Suspicion;
use vice_files::calibration::CalibrationFile;

use crate::files::{entries, name};
use crate::parts::Intrinsics;

/// Endings of files that may be calibrations.
const ENDINGS: [&str; 5] = ["yaml", "yml", "json", "xml", "toml"];
/// What the names of calibrations have in them.
const WORDS: [&str; 6] = ["calib", "camchain", "camera", "intrinsic", "sensor", "cam0"];

/// The files of a folder that may be calibrations by their names, in natural order.
pub(crate) fn candidates(folder: &Path) -> Vec<PathBuf> {
    let fits = |path: &PathBuf| {
        let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        let name = name(path).to_ascii_lowercase();
        ENDINGS.contains(&ending.as_str()) && WORDS.iter().any(|w| name.contains(w)) && path.is_file()
    };
    entries(folder).unwrap_or_default().into_iter().filter(fits).collect()
}

/// The calibration in a folder: the only one that can be read as one, a camchain before others.
pub(crate) fn in_folder(folder: &Path) -> Option<PathBuf> {
    let read = |path: &PathBuf| CalibrationFile::read(path).is_ok_and(|f| !f.cameras().is_empty());
    let mut found: Vec<PathBuf> = candidates(folder).into_iter().filter(read).collect();
    found.sort_by_key(|path| !name(path).to_ascii_lowercase().contains("camchain"));
    found.into_iter().next()
}

/// What a file says of a camera. Its place in the body is `None` where it does not say.
pub(crate) fn of_file(
    path: &Path,
    camera: &str,
    cameras: &[String],
) -> DataResult<(Intrinsics, Option<BodyFromCamera>)> {
    let file = CalibrationFile::read(path)?.for_camera(camera, cameras)?;
    let entry = file.cameras().get(camera).cloned().unwrap_or_default();
    let fx_fy_cx_cy = entry.intrinsics.ok_or_else(|| {
        DataError::of_kind(ErrorKind::Missing, format!("says no intrinsics of {camera}")).at(path)
    })?;
    let lens = entry.model.as_deref().unwrap_or("none");
    let model = Model::from_name(lens, entry.distortion.as_deref().unwrap_or_default());
    let model = model.map_err(|e| DataError::of(e).at(path))?;
    let mut suspicions: Vec<Suspicion> = file.suspicions().iter().cloned().collect();
    // It is applied to estimates where the file is given as --calibration; a layout moves no stamps by itself.
    suspicions.retain(|s| s.code != "time-shift-applied");
    if let Some(offset) = file.time_offset_of(camera) {
        let text = offset.to_seconds_text();
        suspicions.push(
            Suspicion::new(
                "time-shift",
                path.display().to_string(),
                format!("its timeshift_cam_imu of {camera} is not applied"),
            )
            .advice(format!("--time-offset {text} adds it to the stamps of estimates")),
        );
    }
    let from = path.display().to_string();
    let intrinsics = Intrinsics { size: entry.resolution, fx_fy_cx_cy, model, from, suspicions };
    Ok((intrinsics, entry.body_from_camera))
}

/// Why there are no intrinsics.
pub(crate) fn missing(folder: &Path, hint: &str) -> DataError {
    DataError::of_kind(ErrorKind::Missing, "no calibration of the camera is known").at(folder).hint(hint)
}
