//! The calibration as TOML.

use std::fmt::Write;

use serde::Deserialize;
use vice_core::error::{DataError, DataResult};
use vice_core::time::Span;

use super::{CalibrationFile, CameraOverride, in_camera};
use crate::rigid_file::{Matrix4, from_toml};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    model: Option<String>,
    resolution: Option<[u32; 2]>,
    intrinsics: Option<[f64; 4]>,
    distortion: Option<Vec<f64>>,
    body_from_camera: Option<Matrix4>,
}

pub(super) fn parse(text: &str) -> DataResult<CalibrationFile> {
    let table: toml::Table = from_toml(text)?;
    let mut file = CalibrationFile::new();
    for (key, value) in table {
        if key == "time_offset_s" {
            let seconds = match value {
                toml::Value::Float(seconds) => seconds,
                toml::Value::Integer(seconds) => seconds as f64,
                other => {
                    return Err(DataError::new(format!("time_offset_s = {other} is no number of seconds")));
                }
            };
            let offset =
                Span::from_secs_f64(seconds).map_err(|e| DataError::new(format!("time_offset_s: {e}")))?;
            file.time_offset = Some(offset);
            continue;
        }
        if !value.is_table() {
            return Err(DataError::new(format!("`{key}` is not known"))
                .hint("known: time_offset_s, and a table such as [cam0] for each camera"));
        }
        let entry: Entry = value
            .try_into()
            .map_err(|e: toml::de::Error| in_camera(&key, &e.message().replace('\n', " ")))?;
        let body_from_camera = match entry.body_from_camera {
            Some(matrix) => {
                Some(matrix.to_rigid("body_from_camera").map_err(|e| in_camera(&key, &e.problem()))?)
            }
            None => None,
        };
        let camera = CameraOverride {
            model: entry.model,
            resolution: entry.resolution,
            intrinsics: entry.intrinsics,
            distortion: entry.distortion,
            body_from_camera,
        };
        if camera == CameraOverride::default() {
            return Err(in_camera(&key, &"the table is empty"));
        }
        file.insert(key, camera);
    }
    if file.cameras.is_empty() && file.time_offset.is_none() {
        return Err(DataError::new("the calibration says nothing")
            .hint("give a table such as [cam0] with intrinsics, or time_offset_s"));
    }
    Ok(file)
}

pub(super) fn to_text(file: &CalibrationFile) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_text(&mut text, file);
    text
}

fn write_text(text: &mut String, file: &CalibrationFile) -> std::fmt::Result {
    let numbers = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|v| format!("{v:?}")).collect();
        format!("[{}]", texts.join(", "))
    };
    if let Some(offset) = file.time_offset {
        writeln!(text, "time_offset_s = {}", offset.to_seconds_text())?;
    }
    for (name, camera) in &file.cameras {
        writeln!(text, "{}[{}]", if text.is_empty() { "" } else { "\n" }, key(name))?;
        if let Some(model) = &camera.model {
            writeln!(text, "model = {}", toml::Value::from(model.as_str()))?;
        }
        if let Some([width, height]) = camera.resolution {
            writeln!(text, "resolution = [{width}, {height}]")?;
        }
        if let Some(intrinsics) = &camera.intrinsics {
            writeln!(text, "intrinsics = {}", numbers(intrinsics))?;
        }
        if let Some(distortion) = &camera.distortion {
            writeln!(text, "distortion = {}", numbers(distortion))?;
        }
        if let Some(body_from_camera) = &camera.body_from_camera {
            writeln!(text, "body_from_camera = {}", numbers(&body_from_camera.to_row_major()))?;
        }
    }
    Ok(())
}

/// A table's name, quoted where TOML asks for it.
fn key(name: &str) -> String {
    let bare = !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { name.to_string() } else { toml::Value::from(name).to_string() }
}
