//! Formats that are written in Python: an object with the names of the trait's methods is a data set.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyTuple;
use vice_run::core::camera::Camera as CoreCamera;
use vice_run::core::dataset::{CloudRef, CloudSource, Dataset, DepthImage, Floor, Image, PixelFormat, Plane};
use vice_run::core::error::{DataError, DataResult, ErrorKind};
use vice_run::core::frames::{BodyFromCamera, Rigid};
use vice_run::core::imu::ImuSample;
use vice_run::core::nalgebra::Point3;
use vice_run::core::time::Stamp;
use vice_run::core::trajectory::Trajectory as CoreTrajectory;
use vice_run::error::RunError;

use crate::arrays::{Rows, column, matrix, stamps};
use crate::camera::Camera;
use crate::errors::{Answer, Failure, OfPython, data_error, usage};
use crate::poses::Trajectory;

/// Methods without which an object is no data set.
const NEEDED: [&str; 3] = ["frames", "camera", "body_from_camera"];

/// An object of Python as a data set. Each call takes the interpreter's lock.
pub(crate) struct Robot {
    object: Py<PyAny>,
    name: String,
    format: String,
    cameras: Vec<String>,
}

impl Robot {
    /// # Errors
    /// A usage error if a method is missing.
    pub(crate) fn new(object: &Bound<'_, PyAny>) -> Answer<Self> {
        let class = object.get_type().name().map_or_else(|_| "robot".to_string(), |n| n.to_string());
        if let Some(lacks) = NEEDED.iter().find(|name| !has(object, name)) {
            return Err(usage(
                "run",
                format!("an object of {class} is no recording: it has no method `{lacks}`"),
            ));
        }
        let text = |attribute: &str| -> Answer<Option<String>> {
            match object.getattr_opt(attribute).python()? {
                None => Ok(None),
                Some(value) if value.is_callable() => value.call0().and_then(|v| v.extract()).python(),
                Some(value) => value.extract().python(),
            }
        };
        let cameras = match object.getattr_opt("cameras").python()? {
            None => vec!["camera".to_string()],
            Some(value) if value.is_callable() => value.call0().and_then(|v| v.extract()).python()?,
            Some(value) => value.extract().python()?,
        };
        Ok(Self {
            object: object.clone().unbind(),
            name: text("name")?.unwrap_or_else(|| class.clone()),
            format: text("format_name")?.unwrap_or_else(|| class.to_ascii_lowercase()),
            cameras,
        })
    }

    /// Says which format it was opened as.
    pub(crate) fn is_of(&mut self, format: &str) {
        self.format = format.to_string();
    }

    /// Calls a method and makes a value of the core of what it gives.
    fn ask<T>(
        &self,
        method: &str,
        arguments: impl FnOnce(Python<'_>) -> PyResult<Bound<'_, PyTuple>>,
        read: impl FnOnce(&Bound<'_, PyAny>) -> Answer<T>,
    ) -> DataResult<T> {
        Python::attach(|py| {
            let called = arguments(py).and_then(|a| self.object.bind(py).call_method1(method, a));
            called.python().and_then(|value| read(&value)).map_err(|failure| of_data(method, failure))
        })
    }

    /// The same for a method that may be missing, or give None.
    fn ask_if_there<T>(
        &self,
        method: &str,
        arguments: impl FnOnce(Python<'_>) -> PyResult<Bound<'_, PyTuple>>,
        read: impl FnOnce(&Bound<'_, PyAny>) -> Answer<T>,
    ) -> DataResult<Option<T>> {
        if !Python::attach(|py| has(self.object.bind(py), method)) {
            return Ok(None);
        }
        self.ask(method, arguments, |value| if value.is_none() { Ok(None) } else { read(value).map(Some) })
    }

    fn check_camera(&self, camera: &str) -> DataResult<()> {
        if self.cameras.iter().any(|name| name == camera) {
            return Ok(());
        }
        Err(DataError::of_kind(ErrorKind::Missing, format!("there is no camera {camera}"))
            .hint(format!("there are {}", self.cameras.join(", "))))
    }

    fn check_index(&self, camera: &str, index: usize) -> DataResult<Stamp> {
        let frames = self.frames(camera)?;
        frames.get(index).copied().ok_or_else(|| {
            DataError::of_kind(
                ErrorKind::Missing,
                format!("camera {camera} has {} frames and none of index {index}", frames.len()),
            )
        })
    }
}

fn has(object: &Bound<'_, PyAny>, method: &str) -> bool {
    object.getattr_opt(method).is_ok_and(|m| m.is_some_and(|m| m.is_callable()))
}

/// What a method did wrong, as an error of data that names the method.
fn of_data(method: &str, failure: Failure) -> DataError {
    match failure {
        Failure::Python(error) => {
            let inner = data_error(error);
            let kind = inner.kind();
            DataError::of_kind(kind, format!("{method}: {}", inner.problem())).because(inner)
        }
        Failure::Run(error) => DataError::new(format!("{method}: {error}")).because(error),
        Failure::Panicked(text) => DataError::new(format!("{method}: {text}")),
    }
}

fn none(py: Python<'_>) -> PyResult<Bound<'_, PyTuple>> {
    Ok(PyTuple::empty(py))
}

fn wrong(field: &'static str, problem: &str) -> Failure {
    Failure::Run(RunError::new(ErrorKind::Corrupt, format!("{field}: {problem}")))
}

impl Dataset for Robot {
    fn name(&self) -> &str {
        &self.name
    }

    fn format(&self) -> &str {
        &self.format
    }

    fn cameras(&self) -> Vec<String> {
        self.cameras.clone()
    }

    fn camera(&self, camera: &str) -> DataResult<CoreCamera> {
        self.check_camera(camera)?;
        self.ask(
            "camera",
            |py| (camera,).into_pyobject(py),
            |value| {
                let camera =
                    value.cast::<Camera>().map_err(|_| wrong("camera", "a vicepose.Camera is expected"))?;
                Ok(camera.get().core)
            },
        )
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        self.check_camera(camera)?;
        self.ask(
            "frames",
            |py| (camera,).into_pyobject(py),
            |value| {
                let ns = stamps(value, "frames")?;
                let ns = ns.as_slice().python()?;
                if let Some(place) = ns.windows(2).position(|w| w[0] >= w[1]) {
                    return Err(wrong(
                        "frames",
                        &format!("frame {} is not later than the one before", place + 1),
                    ));
                }
                Ok(ns.iter().map(|ns| Stamp::from_nanos(*ns)).collect())
            },
        )
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        self.check_index(camera, index)?;
        let found = self.ask_if_there("image", |py| (camera, index).into_pyobject(py), image_of)?;
        found.ok_or_else(|| DataError::of_kind(ErrorKind::Missing, format!("{} has no images", self.name)))
    }

    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera> {
        self.check_camera(camera)?;
        self.ask(
            "body_from_camera",
            |py| (camera, stamp.as_nanos()).into_pyobject(py),
            |value| {
                Rigid::try_from_row_major(&matrix(value, "body_from_camera")?)
                    .map_err(|e| wrong("body_from_camera", &e.to_string()))
            },
        )
    }

    fn streams(&self) -> Vec<String> {
        // The trait has no error here: a list that cannot be had is empty, and asking for a stream says why.
        let read = |value: &Bound<'_, PyAny>| value.extract::<Vec<String>>().python();
        self.ask_if_there("streams", none, read).ok().flatten().unwrap_or_default()
    }

    fn trajectory(&self, stream: &str) -> DataResult<CoreTrajectory> {
        let known =
            self.ask_if_there("streams", none, |v| v.extract::<Vec<String>>().python())?.unwrap_or_default();
        if !known.iter().any(|name| name == stream) {
            return Err(DataError::of_kind(ErrorKind::Missing, format!("there is no stream {stream}"))
                .hint(format!("there are {}", known.join(", "))));
        }
        self.ask(
            "trajectory",
            |py| (stream,).into_pyobject(py),
            |value| {
                let found = value
                    .cast::<Trajectory>()
                    .map_err(|_| wrong("trajectory", "a vicepose.Trajectory is expected"))?;
                Ok(found.get().core.as_ref().clone())
            },
        )
    }

    fn is_relative(&self, stream: &str) -> bool {
        let read = |value: &Bound<'_, PyAny>| value.is_truthy().python();
        self.ask_if_there("is_relative", |py| (stream,).into_pyobject(py), read)
            .ok()
            .flatten()
            .unwrap_or(false)
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        let samples = self.ask_if_there("imu", none, |value| {
            let (ns, gyro, accel): (Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>) =
                value.extract().python()?;
            let (ns, gyro, accel) =
                (stamps(&ns, "imu")?, Rows::of::<3>(&gyro, "imu")?, Rows::of::<3>(&accel, "imu")?);
            let (ns, gyro, accel) = (ns.as_slice().python()?, gyro.rows::<3>()?, accel.rows::<3>()?);
            if gyro.len() != ns.len() || accel.len() != ns.len() {
                return Err(wrong("imu", "stamps, rates and forces differ in length"));
            }
            let samples = ns.iter().zip(gyro).zip(accel).map(|((ns, gyro), accel)| ImuSample {
                stamp: Stamp::from_nanos(*ns),
                gyro_rad_s: (*gyro).into(),
                accel_m_s2: (*accel).into(),
            });
            Ok(samples.collect::<Arc<[ImuSample]>>())
        })?;
        Ok(samples.unwrap_or_else(|| Arc::new([])))
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        let stamp = self.check_index(camera, index)?;
        self.ask_if_there(
            "depth_image",
            |py| (camera, index).into_pyobject(py),
            |value| {
                let shape: Vec<usize> = value.getattr("shape").and_then(|s| s.extract()).python()?;
                let &[rows, columns] = shape.as_slice() else {
                    return Err(wrong("depth_image", "an array of shape (rows, columns) is expected"));
                };
                let flat = value.call_method1("reshape", (-1,)).python()?;
                let z_m = column::<f32>(&flat, "float32", "depth_image")?.as_slice().python()?.to_vec();
                let (width, height) = size(columns, rows)?;
                Ok(DepthImage::new(stamp, width, height, z_m)?)
            },
        )
    }

    fn has_depth(&self, camera: &str) -> bool {
        let read = |value: &Bound<'_, PyAny>| value.is_truthy().python();
        let said = self.ask_if_there("has_depth", |py| (camera,).into_pyobject(py), read).ok().flatten();
        said.unwrap_or_else(|| Python::attach(|py| has(self.object.bind(py), "depth_image")))
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        self.ask_if_there("cloud", none, |value| {
            let (points, place): (Bound<'_, PyAny>, Bound<'_, PyAny>) = value.extract().python()?;
            let world_from_cloud = Rigid::try_from_row_major(&matrix(&place, "cloud")?)
                .map_err(|e| wrong("cloud", &e.to_string()))?;
            let source = match points.extract::<std::path::PathBuf>() {
                Ok(path) => CloudSource::File(path),
                Err(_) => {
                    let rows = Rows::of::<3>(&points, "cloud")?;
                    let points = rows.rows::<3>()?.iter().map(|p| Point3::from(p.map(|v| v as f32)));
                    CloudSource::Points(points.collect())
                }
            };
            Ok(CloudRef { source, world_from_cloud })
        })
    }

    fn floor(&self, keyframe: Stamp) -> DataResult<Floor> {
        let found = self.ask_if_there(
            "floor",
            |py| (keyframe.as_nanos(),).into_pyobject(py),
            |value| {
                let [nx, ny, nz, d]: [f64; 4] = value.extract().python()?;
                Ok(Floor::World(Plane::new([nx, ny, nz], d).map_err(|e| wrong("floor", &e.to_string()))?))
            },
        )?;
        Ok(found.unwrap_or_else(|| Floor::World(Plane::z_zero())))
    }
}

fn size(columns: usize, rows: usize) -> Answer<(u32, u32)> {
    let both = u32::try_from(columns).ok().zip(u32::try_from(rows).ok());
    both.ok_or_else(|| wrong("image", "is larger than any image"))
}

fn image_of(value: &Bound<'_, PyAny>) -> Answer<Image> {
    let shape: Vec<usize> = value.getattr("shape").and_then(|s| s.extract()).python()?;
    let dtype = value
        .getattr("dtype")
        .and_then(|d| d.getattr("name"))
        .and_then(|n| n.extract::<String>())
        .python()?;
    let (rows, columns, format) = match shape.as_slice() {
        &[rows, columns] | &[rows, columns, 1] => (rows, columns, PixelFormat::Gray8),
        &[rows, columns, 3] => (rows, columns, PixelFormat::Rgb8),
        other => {
            return Err(wrong(
                "image",
                &format!(
                    "an array of shape (rows, columns) or (rows, columns, 3) is expected, not {other:?}"
                ),
            ));
        }
    };
    if dtype != "uint8" {
        return Err(wrong("image", &format!("uint8 is expected, not {dtype}")));
    }
    let flat = value.call_method1("reshape", (-1,)).python()?;
    let data = column::<u8>(&flat, "uint8", "image")?.as_slice().python()?.to_vec();
    let (width, height) = size(columns, rows)?;
    Ok(Image::new(width, height, format, data)?)
}
