//! The calibration of Basalt: JSON with a list of cameras, and their places in the frame of the IMU.

use serde_json::{Map, Value};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::BodyFromCamera;
use vice_core::time::Span;

use super::entry::{Entry, in_camera_kind, list, one, side};

/// Keys that say nothing about a camera's geometry.
const HARMLESS: [&str; 12] = [
    "calib_accel_bias",
    "calib_gyro_bias",
    "imu_update_rate",
    "accel_noise_std",
    "gyro_noise_std",
    "accel_bias_std",
    "gyro_bias_std",
    "mocap_time_offset_ns",
    "mocap_to_imu_offset_ns",
    "vignette",
    "T_mocap_world",
    "T_imu_marker",
];
const READ: [&str; 4] = ["T_imu_cam", "intrinsics", "resolution", "cam_time_offset_ns"];

/// The calibration in a file of Basalt; `None` where it is another file.
pub(super) fn found(root: &Map<String, Value>) -> Option<&Map<String, Value>> {
    let inner = root.get("value0").and_then(Value::as_object).unwrap_or(root);
    let first = inner.get("intrinsics")?.as_array()?.first()?;
    first.get("camera_type").is_some().then_some(inner)
}

/// Keys that are not known.
pub(super) fn unused(calibration: &Map<String, Value>) -> Vec<String> {
    let known = |key: &&String| READ.contains(&key.as_str()) || HARMLESS.contains(&key.as_str());
    calibration.keys().filter(|key| !known(key)).cloned().collect()
}

/// The cameras in their order.
pub(super) fn cameras(calibration: &Map<String, Value>) -> DataResult<Vec<Entry>> {
    let array = |key: &str| calibration.get(key).and_then(Value::as_array).map(Vec::as_slice);
    let intrinsics = array("intrinsics").unwrap_or_default();
    let shift = match calibration.get("cam_time_offset_ns") {
        // Stamp of the IMU less that of the image, as Kalibr's shift is.
        Some(value) => Some(Span::from_nanos(whole("cam_time_offset_ns", value)?)),
        None => None,
    };
    for key in ["T_imu_cam", "resolution"] {
        if let Some(given) = array(key).filter(|given| given.len() != intrinsics.len()) {
            return Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!("intrinsics has {} cameras and {key} {}", intrinsics.len(), given.len()),
            ));
        }
    }
    let camera = |number: usize| -> DataResult<Entry> {
        let mut entry = lens(&intrinsics[number])?;
        if let Some(pose) = array("T_imu_cam") {
            entry.camera.body_from_camera = Some(place(&pose[number])?);
        }
        if let Some(sizes) = array("resolution") {
            let [width, height] = list("resolution", &sizes[number])?[..] else {
                return Err(DataError::new("resolution is not columns and rows"));
            };
            entry.camera.resolution = Some([side("resolution", width)?, side("resolution", height)?]);
        }
        entry.time_shift = shift;
        Ok(entry)
    };
    (0..intrinsics.len())
        .map(|number| camera(number).map_err(|e| in_camera_kind(&format!("cam{number}"), &e)))
        .collect()
}

fn whole(key: &str, value: &Value) -> DataResult<i64> {
    value.as_i64().ok_or_else(|| DataError::new(format!("{key} is no whole number of nanoseconds")))
}

fn lens(entry: &Value) -> DataResult<Entry> {
    let kind = entry.get("camera_type").and_then(Value::as_str).unwrap_or_default();
    let values = entry.get("intrinsics").and_then(Value::as_object);
    let values = values.ok_or_else(|| DataError::new("the camera has no intrinsics"))?;
    let (model, names): (&str, &[&str]) = match kind {
        "pinhole" => ("pinhole", &[]),
        "kb4" => ("equidistant", &["k1", "k2", "k3", "k4"]),
        "ds" => ("ds", &["xi", "alpha"]),
        "eucm" => ("eucm", &["alpha", "beta"]),
        // The unified model is the extended one of a sphere.
        "ucm" => ("eucm", &["alpha"]),
        "fov" => ("fov", &["w"]),
        "pinhole-radtan8" => ("rational", &["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"]),
        other => {
            return Err(DataError::new(format!(
                "unknown camera_type `{other}`; known: pinhole, pinhole-radtan8, kb4, ds, eucm, ucm, fov"
            )));
        }
    };
    let number = |name: &str| {
        one(
            name,
            values.get(name).ok_or_else(|| DataError::new(format!("camera_type {kind} has no {name}")))?,
        )
    };
    let mut distortion = names.iter().map(|name| number(name)).collect::<DataResult<Vec<f64>>>()?;
    if kind == "ucm" {
        distortion.push(1.0);
    }
    let mut entry = Entry::default();
    entry.camera.model = Some(model.to_string());
    entry.camera.intrinsics = Some([number("fx")?, number("fy")?, number("cx")?, number("cy")?]);
    entry.camera.distortion = Some(distortion);
    let known =
        |key: &&String| names.contains(&key.as_str()) || ["fx", "fy", "cx", "cy"].contains(&key.as_str());
    entry.unused = values.keys().filter(|key| !known(key)).cloned().collect();
    Ok(entry)
}

/// `T_imu_cam` takes coordinates in the camera to the IMU.
fn place(pose: &Value) -> DataResult<BodyFromCamera> {
    let number = |name: &str| {
        one(name, pose.get(name).ok_or_else(|| DataError::new(format!("T_imu_cam has no {name}")))?)
    };
    let translation = [number("px")?, number("py")?, number("pz")?];
    let rotation = [number("qw")?, number("qx")?, number("qy")?, number("qz")?];
    BodyFromCamera::try_from_parts(translation, rotation)
        .map_err(|e| DataError::new(format!("T_imu_cam: {e}")))
}
