//! What the `sensor.yaml` of the sensors say.

use std::path::Path;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use vice_core::camera::{Camera, Model};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{Body, BodyFromCamera, Cloud, Rigid, Sensor, World};
use vice_core::suspicion::Suspicions;
use vice_files::calibration::{CalibrationFile, CameraOverride};
use vice_files::rigid_file::Matrix4;
use vice_files::yaml;

/// Name of the file in a sensor's folder.
pub(crate) const SENSOR_FILE: &str = "sensor.yaml";

/// Intrinsics and extrinsics of a camera.
#[derive(Clone, Debug)]
pub(crate) struct Calibration {
    pub(crate) camera: Camera,
    pub(crate) body_from_camera: BodyFromCamera,
    /// Keys of the file that are not used.
    pub(crate) suspicions: Suspicions,
}

/// Reads the calibration in a camera's folder.
pub(crate) fn calibration(folder: &Path) -> DataResult<Calibration> {
    let path = folder.join(SENSOR_FILE);
    let file = CalibrationFile::read(&path)?;
    let [(name, found)] = file.cameras().iter().collect::<Vec<_>>()[..] else {
        return Err(DataError::new("describes more than one camera").at(&path));
    };
    if let Some(offset) = file.time_offset_of(name) {
        return Err(DataError::of_kind(
            ErrorKind::Unsupported,
            "timeshift_cam_imu is not applied to the stamps of a data set",
        )
        .at(&path)
        .hint(format!("take it out and give --time-offset {} instead", offset.to_seconds_text())));
    }
    let (camera, body_from_camera) = calibration_of(found).map_err(|e| e.at(&path))?;
    Ok(Calibration { camera, body_from_camera, suspicions: file.suspicions().clone() })
}

fn calibration_of(found: &CameraOverride) -> DataResult<(Camera, BodyFromCamera)> {
    let missing = |key: &str| DataError::new(format!("`{key}` is missing"));
    let [width, height] = found.resolution.ok_or_else(|| missing("resolution"))?;
    let intrinsics = found.intrinsics.ok_or_else(|| missing("intrinsics"))?;
    let lens = found.model.as_deref().unwrap_or("none");
    let model = Model::from_name(lens, found.distortion.as_deref().unwrap_or_default());
    let camera = model.and_then(|model| Camera::new(width, height, intrinsics, model));
    let camera = camera.map_err(DataError::of)?;
    Ok((camera, found.body_from_camera.ok_or_else(|| missing("T_BS"))?))
}

#[derive(Deserialize)]
struct PlacedFile {
    #[serde(rename = "T_BS")]
    t_bs: Option<Matrix4>,
    #[serde(rename = "T_WR")]
    t_wr: Option<Matrix4>,
}

/// Place of a sensor in the body; the identity where its folder does not say.
pub(crate) fn body_from_sensor(folder: &Path) -> DataResult<Rigid<Body, Sensor>> {
    match optional::<PlacedFile>(folder)?.and_then(|file| file.t_bs) {
        Some(matrix) => matrix.to_rigid("T_BS").map_err(|e| e.at(folder.join(SENSOR_FILE))),
        None => Ok(Rigid::identity()),
    }
}

/// Place of a scan in the world; the identity where its folder does not say.
pub(crate) fn world_from_cloud(folder: &Path) -> DataResult<Rigid<World, Cloud>> {
    match optional::<PlacedFile>(folder)?.and_then(|file| file.t_wr) {
        Some(matrix) => matrix.to_rigid("T_WR").map_err(|e| e.at(folder.join(SENSOR_FILE))),
        None => Ok(Rigid::identity()),
    }
}

/// What `depth0/sensor.yaml` says.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct DepthFile {
    sensor_type: String,
    /// The camera whose pixels the depths belong to.
    pub(crate) registered_to: String,
    /// Worth of a count.
    pub(crate) metres_per_count: f64,
}

/// Reads the description of depth images.
pub(crate) fn depth(folder: &Path) -> DataResult<DepthFile> {
    let path = folder.join(SENSOR_FILE);
    let file: DepthFile = yaml::read(&path)?;
    if file.sensor_type != "depth" {
        return Err(DataError::new(format!("sensor_type is `{}`, not `depth`", file.sensor_type)).at(path));
    }
    if !(file.metres_per_count.is_finite() && file.metres_per_count > 0.0) {
        return Err(
            DataError::new(format!("metres_per_count = {} is not positive", file.metres_per_count)).at(path)
        );
    }
    Ok(file)
}

#[derive(Deserialize)]
struct RateFile {
    rate_hz: Option<f64>,
}

/// The rate that a sensor's folder names, Hz; `None` where it names none, or the file cannot be read: who needs the file
/// says so.
pub(crate) fn rate_hz(folder: &Path) -> Option<f64> {
    optional::<RateFile>(folder).ok()??.rate_hz
}

fn optional<T: DeserializeOwned>(folder: &Path) -> DataResult<Option<T>> {
    let path = folder.join(SENSOR_FILE);
    if path.is_file() { yaml::read(path).map(Some) } else { Ok(None) }
}
