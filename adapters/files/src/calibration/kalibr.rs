//! The camchain that Kalibr writes.

use std::collections::BTreeMap;

use serde::Deserialize;
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Body, Camera, Rigid};

use super::{CalibrationFile, CameraOverride, in_camera};
use crate::rigid_file::Matrix4;
use crate::yaml;

#[derive(Deserialize)]
struct Entry {
    camera_model: Option<String>,
    intrinsics: Option<Vec<f64>>,
    distortion_model: Option<String>,
    distortion_coeffs: Option<Vec<f64>>,
    resolution: Option<[u32; 2]>,
    #[serde(rename = "T_cam_imu")]
    t_cam_imu: Option<Matrix4>,
    timeshift_cam_imu: Option<f64>,
}

pub(super) fn parse(text: &str) -> DataResult<CalibrationFile> {
    let entries: BTreeMap<String, Entry> = yaml::parse(text)
        .map_err(|e| e.hint("a calibration is TOML (named .toml) or a Kalibr camchain with cam0, cam1, …"))?;
    let mut file = CalibrationFile::new();
    for (name, entry) in entries {
        let camera = entry.into_override(&name).map_err(|e| in_camera(&name, &e.problem()))?;
        if camera == CameraOverride::default() {
            return Err(in_camera(&name, &"says nothing about a camera"));
        }
        file.insert(name, camera);
    }
    if file.cameras.is_empty() {
        return Err(DataError::new("the camchain holds no camera"));
    }
    Ok(file)
}

impl Entry {
    fn into_override(self, name: &str) -> DataResult<CameraOverride> {
        if let Some(shift) = self.timeshift_cam_imu.filter(|shift| *shift != 0.0) {
            tracing::warn!(
                "{name}: timeshift_cam_imu = {shift} s is ignored: the stamps of frames and poses stay as they are"
            );
        }
        // Kalibr's `omni`, `eucm` and `ds` have further intrinsics that the pinhole models do not.
        if let Some(model) = self.camera_model.as_deref().filter(|model| *model != "pinhole") {
            return Err(DataError::new(format!("unknown camera_model `{model}`; known: pinhole")));
        }
        let intrinsics = match self.intrinsics {
            Some(values) => Some(<[f64; 4]>::try_from(values).map_err(|values| {
                DataError::new(format!("intrinsics are fx, fy, cx, cy: 4 numbers, not {}", values.len()))
            })?),
            None => None,
        };
        // Kalibr writes four zeros where there is no distortion.
        let model = self.distortion_model;
        let distortion = match model.as_deref() {
            Some("none") => Some(Vec::new()),
            _ => self.distortion_coeffs,
        };
        let body_from_camera = match self.t_cam_imu {
            Some(matrix) => {
                let camera_from_body: Rigid<Camera, Body> = matrix.to_rigid("T_cam_imu")?;
                Some(camera_from_body.inverse())
            }
            None => None,
        };
        Ok(CameraOverride { model, resolution: self.resolution, intrinsics, distortion, body_from_camera })
    }
}
