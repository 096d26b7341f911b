//! Calibrations as other tools write them: a camera a file, or several by their names.

use serde_json::{Map, Value};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{Body, BodyFromCamera, Camera, Rigid, rotation_angle_rad};
use vice_core::suspicion::Suspicion;
use vice_core::time::Span;

use super::entry::{Entry, in_camera_kind, list, one, side};
use super::keys::{self, Key};
use super::lens::{self, Numbers};
use super::{CalibrationFile, CameraOverride, basalt, in_camera, orb_slam, tree};
use crate::rigid_file::Matrix4;

/// How far two statements of the same transform may be apart: metres and radians.
const SAME_TRANSFORM: f64 = 1e-3;

pub(super) fn parse(text: &str) -> DataResult<CalibrationFile> {
    let root = tree::read(text)?;
    let mut file = CalibrationFile::new();
    if let Some(calibration) = basalt::found(&root) {
        for (number, entry) in basalt::cameras(calibration)?.into_iter().enumerate() {
            add(&mut file, &format!("cam{number}"), entry);
        }
        file.unused.extend(basalt::unused(calibration));
        return Ok(file);
    }
    if let Some(pair) = orb_slam::pair(&root) {
        let [first, mut second] = [entry_of(&pair.cameras[0])?, entry_of(&pair.cameras[1])?];
        if let Some((key, place)) = &pair.first_from_second {
            let first_from_second: Rigid<Camera, Camera> = transform(key, place)?;
            second.camera.body_from_camera =
                first.camera.body_from_camera.map(|first| first * first_from_second);
        }
        add(&mut file, "cam0", first);
        add(&mut file, "cam1", second);
        return Ok(file);
    }
    if keys::describes_camera(&root) {
        let entry = entry_of(&root)?;
        if entry.camera == CameraOverride::default() && entry.time_shift.is_none() {
            return Err(DataError::new("says nothing about a camera").hint(super::DIALECTS));
        }
        let name = entry.name.clone().filter(|n| !n.is_empty()).unwrap_or_else(|| "camera".to_string());
        file.nameless = true;
        add(&mut file, &name, entry);
        return Ok(file);
    }
    let mut others = Vec::new();
    let mut previous: Option<(String, BodyFromCamera)> = None;
    for (name, value) in in_natural_order(&root) {
        let Value::Object(map) = value else {
            match keys::of(name) {
                Key::Weighty if !tree::says_nothing(value) => return Err(weighty(name)),
                Key::Harmless => {}
                _ => others.push(name.clone()),
            }
            continue;
        };
        let mut entry = entry_of(map).map_err(|e| in_camera_kind(name, &e))?;
        if entry.camera == CameraOverride::default()
            && entry.time_shift.is_none()
            && entry.camera_from_previous.is_none()
        {
            return Err(in_camera(name, &"says nothing about a camera"));
        }
        chain(name, &mut entry, previous.as_ref()).map_err(|e| in_camera_kind(name, &e))?;
        if let Some(body_from_camera) = entry.camera.body_from_camera {
            previous = Some((name.clone(), body_from_camera));
        }
        add(&mut file, name, entry);
    }
    if file.cameras.is_empty() {
        return Err(DataError::new("the calibration holds no camera").hint(super::DIALECTS));
    }
    file.unused.extend(others);
    Ok(file)
}

/// `cam2` before `cam10`.
fn in_natural_order(root: &Map<String, Value>) -> Vec<(&String, &Value)> {
    let mut entries: Vec<(&String, &Value)> = root.iter().collect();
    let number = |name: &str| {
        let digits = name.trim_start_matches(|c: char| !c.is_ascii_digit());
        digits.parse::<u64>().unwrap_or(u64::MAX)
    };
    entries.sort_by(|a, b| (number(a.0), a.0).cmp(&(number(b.0), b.0)));
    entries
}

fn add(file: &mut CalibrationFile, name: &str, entry: Entry) {
    if let Some(shift) = entry.time_shift.filter(|s| *s != Span::ZERO) {
        // Stamp of the IMU = stamp of the image + shift; poses are on the clock of the IMU, frames on the camera's.
        let offset = Span::ZERO - shift;
        file.time_offsets.insert(name.to_string(), offset);
        file.said.push(
            Suspicion::new(
                "time-shift-applied",
                name,
                "the camera's shift against the IMU is added to the stamps of the estimates",
            )
            .evidence(format!(
                "{} s, as --time-offset {} would",
                offset.to_seconds_text(),
                offset.to_seconds_text()
            ))
            .advice("--time-offset 0 leaves them as they are"),
        );
    }
    if let Some(topic) = entry.topic {
        file.topics.insert(name.to_string(), topic);
    }
    file.unused.extend(entry.unused);
    file.cameras.insert(name.to_string(), entry.camera);
}

/// The place of a camera that is given by the one before it.
fn chain(name: &str, entry: &mut Entry, previous: Option<&(String, BodyFromCamera)>) -> DataResult<()> {
    let Some(camera_from_previous) = entry.camera_from_previous else { return Ok(()) };
    let Some((before, body_from_previous)) = previous else {
        // Where no camera has a place in the body, that of the data set stays, and this says nothing new about it.
        entry.unused.push(format!("T_cn_cnm1 of {name} (no camera of the file has a T_cam_imu)"));
        return Ok(());
    };
    let chained: BodyFromCamera = *body_from_previous * camera_from_previous.inverse();
    match entry.camera.body_from_camera {
        None => entry.camera.body_from_camera = Some(chained),
        Some(own) => {
            same_place(&own, &chained, &format!("T_cn_cnm1 after {before}"), "the extrinsics of the camera")?
        }
    }
    Ok(())
}

fn same_place(a: &BodyFromCamera, b: &BodyFromCamera, first: &str, second: &str) -> DataResult<()> {
    let off = a.inverse() * *b;
    let (metres, radians) = (off.translation().norm(), rotation_angle_rad(&off.rotation()));
    // Chains of calibrations are rounded: centimetres are no rounding.
    if metres <= 10.0 * SAME_TRANSFORM && radians <= 10.0 * SAME_TRANSFORM {
        return Ok(());
    }
    Err(contradiction(format!(
        "{first} and {second} contradict each other by {metres:.3} m and {:.2} degrees",
        radians.to_degrees()
    )))
}

fn contradiction(problem: impl Into<String>) -> DataError {
    DataError::of_kind(ErrorKind::Contradictory, problem)
}

fn weighty(key: &str) -> DataError {
    DataError::of_kind(
        ErrorKind::Unsupported,
        format!("the key `{key}` is about geometry, time or size, and is not one that is read"),
    )
    .hint("take it out if it does not matter; extrinsics are read as T_cam_imu, T_imu_cam, T_BS or T_cn_cnm1")
}

fn transform<A, B>(key: &str, value: &Value) -> DataResult<Rigid<A, B>> {
    if let Value::Object(map) = value
        && !map.contains_key("data")
    {
        return Err(DataError::new(format!("{key} is not 4x4")));
    }
    let matrix: Matrix4 = match value {
        Value::Array(rows) if rows.iter().all(Value::is_array) => {
            Matrix4::Rows(rows.iter().map(|row| list(key, row)).collect::<DataResult<_>>()?)
        }
        _ => Matrix4::Flat(list(key, value)?),
    };
    matrix.to_rigid(key)
}

fn intrinsics_of_matrix(key: &str, value: &Value) -> DataResult<[f64; 4]> {
    let numbers = list(key, value)?;
    match numbers[..] {
        [fx, skew, cx, zero, fy, cy, ..] if numbers.len() == 9 || numbers.len() == 12 => {
            if skew != 0.0 || zero != 0.0 {
                return Err(DataError::of_kind(
                    ErrorKind::Unsupported,
                    format!("{key} has a skew of {skew}, which no model here has"),
                ));
            }
            Ok([fx, fy, cx, cy])
        }
        _ => Err(DataError::new(format!("{key} has {} numbers, not 3x3", numbers.len()))),
    }
}

fn entry_of(map: &Map<String, Value>) -> DataResult<Entry> {
    let (projection, kept_by) = lens::projection(map)?;
    let mut entry = Entry::default();
    let mut single: [Option<f64>; 4] = [None; 4];
    let mut coefficients: [Option<f64>; 8] = [None; 8];
    let mut mirror = Vec::new();
    let mut listed: Option<(String, Vec<f64>)> = None;
    let (mut width, mut height) = (None, None);
    let mut fisheye = false;
    // Two statements of the same thing must agree.
    let mut place: Option<(String, BodyFromCamera)> = None;
    for (key, value) in map {
        match keys::of(key) {
            Key::CameraModel => {}
            Key::DistortionModel => entry.camera.model = value.as_str().map(str::to_lowercase),
            Key::Intrinsics => match list(key, value)? {
                values if values.len() == 9 => {
                    set(&mut entry.camera.intrinsics, key, intrinsics_of_matrix(key, value)?)?
                }
                values => listed = Some((key.clone(), values)),
            },
            Key::CameraMatrix => set(&mut entry.camera.intrinsics, key, intrinsics_of_matrix(key, value)?)?,
            Key::Intrinsic(i) => single[i] = Some(one(key, value)?),
            Key::Coefficient(i) => coefficients[i] = Some(one(key, value)?),
            Key::Projection | Key::DistortionByName | Key::Mirror => {
                let Value::Object(parts) = value else {
                    return Err(DataError::new(format!("{key} names no parameters")));
                };
                for (part, value) in parts {
                    let value = one(part, value)?;
                    match projection.part(keys::of(key), part).ok_or_else(|| weighty(part))? {
                        Key::Intrinsic(i) => single[i] = Some(value),
                        Key::Coefficient(i) => coefficients[i] = Some(value),
                        _ => mirror.push((part.to_lowercase(), value)),
                    }
                }
            }
            Key::Distortion => entry.camera.distortion = Some(list(key, value)?),
            Key::Resolution => match list(key, value)?[..] {
                [w, h] => (width, height) = (Some(side(key, w)?), Some(side(key, h)?)),
                _ => return Err(DataError::new(format!("{key} is not columns and rows"))),
            },
            Key::Width => width = Some(side(key, one(key, value)?)?),
            Key::Height => height = Some(side(key, one(key, value)?)?),
            Key::BodyFromCamera | Key::CameraFromBody => {
                let found: BodyFromCamera = match keys::of(key) {
                    Key::BodyFromCamera => transform(key, value)?,
                    _ => transform::<Camera, Body>(key, value)?.inverse(),
                };
                if let Some((other, known)) = &place {
                    same_place(known, &found, other, key)?;
                }
                place.get_or_insert((key.clone(), found));
            }
            Key::CameraFromPrevious => entry.camera_from_previous = Some(transform(key, value)?),
            Key::TimeShift => {
                let shift = Span::from_secs_f64(one(key, value)?)
                    .map_err(|e| DataError::new(format!("{key}: {e}")))?;
                entry.time_shift = Some(shift);
            }
            Key::Topic => entry.topic = value.as_str().map(str::to_string),
            Key::Name => entry.name = value.as_str().map(str::to_string),
            Key::Fisheye => fisheye = tree::number(value).is_some_and(|v| v != 0.0),
            Key::Binning => {
                if one(key, value)? > 1.0 {
                    return Err(weighty(key));
                }
            }
            Key::Harmless => {}
            Key::Weighty if roi_is_whole(value) || tree::says_nothing(value) => {}
            // Of rectified images, which those of a camera are not.
            Key::Weighty if matches!(key.to_lowercase().as_str(), "rectification_matrix" | "r") => {
                entry.unused.push(key.clone());
            }
            Key::Weighty => return Err(weighty(key)),
            Key::Unknown => entry.unused.push(key.clone()),
        }
    }
    if let [Some(fx), Some(fy), Some(cx), Some(cy)] = single {
        set(&mut entry.camera.intrinsics, "fx, fy, cx, cy", [fx, fy, cx, cy])?;
    } else if single.iter().any(Option::is_some) {
        return Err(DataError::new("of fx, fy, cx and cy not all are given"));
    }
    if let Some((key, values)) = listed {
        let (own, [fx, fy, cx, cy]) = projection.split(&key, &values)?;
        mirror.extend(own);
        set(&mut entry.camera.intrinsics, &key, [fx, fy, cx, cy])?;
    }
    entry.camera.resolution = match (width, height) {
        (Some(width), Some(height)) => Some([width, height]),
        (None, None) => None,
        _ => return Err(DataError::new("of width and height only one is given")),
    };
    entry.camera.body_from_camera = place.map(|(_, found)| found);
    let numbers = Numbers { coefficients, mirror: &mirror };
    lens::settle(&mut entry.camera, projection, &kept_by, fisheye, &numbers)?;
    Ok(entry)
}

fn set(known: &mut Option<[f64; 4]>, key: &str, found: [f64; 4]) -> DataResult<()> {
    match known {
        Some(other) if *other != found => {
            Err(contradiction(format!("{key} contradicts other intrinsics: {found:?} and {other:?}")))
        }
        _ => {
            *known = Some(found);
            Ok(())
        }
    }
}

/// A region that starts at the corner and has no size of its own is the whole image.
fn roi_is_whole(value: &Value) -> bool {
    let Value::Object(map) = value else { return false };
    !map.is_empty() && !map.contains_key("data") && map.values().all(tree::says_nothing)
}
