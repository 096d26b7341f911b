//! What the `sensor.yaml` of the sensors say.

use std::path::Path;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use vice_core::camera::{Camera, Model};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Body, BodyFromCamera, Cloud, Rigid, Sensor, World};
use vice_files::rigid_file::Matrix4;
use vice_files::yaml;

/// Name of the file in a sensor's folder.
pub(crate) const SENSOR_FILE: &str = "sensor.yaml";

#[derive(Deserialize)]
struct CameraFile {
    #[serde(rename = "T_BS")]
    t_bs: Option<Matrix4>,
    resolution: Option<[u32; 2]>,
    camera_model: Option<String>,
    intrinsics: Option<[f64; 4]>,
    distortion_model: Option<String>,
    #[serde(alias = "distortion_coeffs")]
    distortion_coefficients: Option<Vec<f64>>,
}

/// Intrinsics and extrinsics of a camera.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Calibration {
    pub(crate) camera: Camera,
    pub(crate) body_from_camera: BodyFromCamera,
}

/// Reads the calibration in a camera's folder.
pub(crate) fn calibration(folder: &Path) -> DataResult<Calibration> {
    let path = folder.join(SENSOR_FILE);
    let file: CameraFile = yaml::read(&path)?;
    calibration_of(file).map_err(|e| e.at(&path))
}

fn calibration_of(file: CameraFile) -> DataResult<Calibration> {
    let missing = |key: &str| DataError::new(format!("`{key}` is missing"));
    let [width, height] = file.resolution.ok_or_else(|| missing("resolution"))?;
    let intrinsics = file.intrinsics.ok_or_else(|| missing("intrinsics"))?;
    if let Some(model) = file.camera_model.filter(|model| model != "pinhole") {
        return Err(DataError::new(format!("unknown camera_model `{model}`; known: pinhole")));
    }
    let distortion = file.distortion_model.as_deref().unwrap_or("none");
    let coefficients = file.distortion_coefficients.unwrap_or_default();
    let model = Model::from_name(distortion, &coefficients);
    let camera = model.and_then(|model| Camera::new(width, height, intrinsics, model));
    let camera = camera.map_err(|e| DataError::new(e.to_string()))?;
    let body_from_camera = file.t_bs.ok_or_else(|| missing("T_BS"))?.to_rigid("T_BS")?;
    Ok(Calibration { camera, body_from_camera })
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

fn optional<T: DeserializeOwned>(folder: &Path) -> DataResult<Option<T>> {
    let path = folder.join(SENSOR_FILE);
    if path.is_file() { yaml::read(path).map(Some) } else { Ok(None) }
}
