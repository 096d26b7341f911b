//! What an entry of a calibration says of its camera, and the numbers in it.

use serde_json::Value;
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Camera, Rigid};
use vice_core::time::Span;

use super::{CameraOverride, tree};

/// A camera as far as its entry says.
#[derive(Default)]
pub(super) struct Entry {
    pub(super) camera: CameraOverride,
    pub(super) camera_from_previous: Option<Rigid<Camera, Camera>>,
    pub(super) time_shift: Option<Span>,
    pub(super) topic: Option<String>,
    pub(super) name: Option<String>,
    pub(super) unused: Vec<String>,
}

pub(super) fn in_camera_kind(name: &str, error: &DataError) -> DataError {
    DataError::of_kind(error.kind(), format!("[{name}]: {}", error.problem()))
}

pub(super) fn list(key: &str, value: &Value) -> DataResult<Vec<f64>> {
    tree::numbers(value)
        .ok_or_else(|| DataError::new(format!("is not the YAML expected: {key} is no list of numbers")))
}

pub(super) fn one(key: &str, value: &Value) -> DataResult<f64> {
    tree::number(value)
        .filter(|v| v.is_finite())
        .ok_or_else(|| DataError::new(format!("is not the YAML expected: {key} is no number")))
}

/// Sides of an image.
pub(super) fn side(key: &str, value: f64) -> DataResult<u32> {
    if value.fract() == 0.0 && (0.0..f64::from(u32::MAX)).contains(&value) {
        Ok(value as u32)
    } else {
        Err(DataError::new(format!("{key} = {value} is no number of pixels")))
    }
}
