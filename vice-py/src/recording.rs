//! Recordings.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use vice_run::core::dataset::Dataset;
use vice_run::core::error::ErrorKind;
use vice_run::core::time::Stamp;
use vice_run::error::{RunError, RunResult};
use vice_run::in_memory::PREFIX;
use vice_run::open::Opened;
use vice_run::request::{DatasetSpec, PluginsSpec};
use vice_run::{formats, info};

use crate::arrays::{array_of, array_of_rows};
use crate::camera::Camera;
use crate::errors::{Answer, OfPython};
use crate::poses::Trajectory;
use crate::robot::Robot;
use crate::work::{long, short};

/// A recorded run of one robot, as :func:`vicepose.open` gives it. Nothing is decoded that is not asked for.
#[pyclass(frozen, name = "Run", module = "vicepose")]
pub(crate) struct Recording {
    pub(crate) spec: DatasetSpec,
    pub(crate) dataset: Arc<dyn Dataset>,
}

impl Recording {
    /// As it is used where nothing overrides it.
    pub(crate) fn opened_default(&self) -> RunResult<Opened> {
        self.spec.apply_to(Arc::clone(&self.dataset))
    }

    fn camera_name(&self, camera: Option<String>) -> RunResult<String> {
        let asked = camera.or_else(|| self.spec.camera.clone());
        DatasetSpec { camera: asked, ..self.spec.clone() }.camera_name(self.dataset.as_ref())
    }
}

/// Opens a recording on disk, with any format that reads it.
#[pyfunction]
#[pyo3(signature = (path, format = None, settings = BTreeMap::new(), plugins = Vec::new(), allow_writable_plugin = false))]
pub(crate) fn open_path(
    py: Python<'_>,
    path: PathBuf,
    format: Option<String>,
    settings: BTreeMap<String, String>,
    plugins: Vec<PathBuf>,
    allow_writable_plugin: bool,
) -> Answer<Recording> {
    let plugins = PluginsSpec { files: plugins, allow_writable: allow_writable_plugin, isolate: None };
    let spec = DatasetSpec { path, format, set: settings, plugins, ..DatasetSpec::default() };
    let asked = spec.clone();
    let dataset = long(py, None, move |_| asked.open_raw(&formats::registry(&asked.plugins)?))?;
    Ok(Recording { spec, dataset })
}

/// A recording that an object of Python is.
#[pyfunction]
pub(crate) fn open_object(robot: &Bound<'_, PyAny>) -> Answer<Recording> {
    let dataset: Arc<dyn Dataset> = Arc::new(Robot::new(robot)?);
    let path = PathBuf::from(format!("{PREFIX}{}", dataset.name()));
    Ok(Recording { spec: DatasetSpec { path, ..DatasetSpec::default() }, dataset })
}

#[pymethods]
impl Recording {
    /// A short name, such as ``V1_01_easy``.
    #[getter]
    fn name(&self) -> String {
        self.dataset.name().to_string()
    }

    /// Name of the format that reads it.
    #[getter]
    fn format(&self) -> String {
        self.dataset.format().to_string()
    }

    /// Where it is.
    #[getter]
    fn path(&self) -> PathBuf {
        self.spec.path.clone()
    }

    /// Names of the cameras; the first is the default.
    #[getter]
    fn cameras(&self) -> Vec<String> {
        self.dataset.cameras()
    }

    /// Names of the pose streams, ``ground-truth`` among them where there is one.
    #[getter]
    fn streams(&self) -> Vec<String> {
        self.dataset.streams()
    }

    /// Stamps of the default camera's frames, int64 nanoseconds of shape (N,).
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> Answer<Bound<'py, PyArray1<i64>>> {
        self.frames_of(py, None)
    }

    /// Stamps of a camera's frames, int64 nanoseconds of shape (N,). The place in this array is the frame's index.
    #[pyo3(signature = (camera = None))]
    fn frames_of<'py>(&self, py: Python<'py>, camera: Option<String>) -> Answer<Bound<'py, PyArray1<i64>>> {
        let frames = short(py, || Ok(self.dataset.frames(&self.camera_name(camera)?)?))?;
        Ok(array_of(py, frames.iter().map(|s| s.as_nanos())))
    }

    /// Intrinsics of a camera.
    #[pyo3(signature = (name = None))]
    fn camera(&self, py: Python<'_>, name: Option<String>) -> Answer<Camera> {
        let core = short(py, || Ok(self.dataset.camera(&self.camera_name(name)?)?))?;
        Ok(Camera { core })
    }

    /// Pose of a camera in the body at a stamp (the first frame's where none is given), array of shape (4, 4), metres.
    #[pyo3(signature = (ns = None, camera = None))]
    fn body_from_camera<'py>(
        &self,
        py: Python<'py>,
        ns: Option<i64>,
        camera: Option<String>,
    ) -> Answer<Bound<'py, PyArray2<f64>>> {
        let pose = short(py, || {
            let camera = self.camera_name(camera)?;
            let stamp = match ns {
                Some(ns) => Stamp::from_nanos(ns),
                None => {
                    let first = self.dataset.frames(&camera)?.first().copied();
                    first.ok_or_else(|| RunError::missing(format!("camera {camera} has no frames")))?
                }
            };
            Ok(self.dataset.body_from_camera(&camera, stamp)?)
        })?;
        array_of_rows(py, pose.to_row_major().as_chunks::<4>().0.to_vec().into_iter())
    }

    /// A pose stream.
    fn stream(&self, py: Python<'_>, name: String) -> Answer<Trajectory> {
        let dataset = Arc::clone(&self.dataset);
        long(py, None, move |_| Ok(dataset.trajectory(&name)?)).map(Trajectory::of)
    }

    /// One image, uint8 of shape (rows, columns) or (rows, columns, 3) in the order red, green, blue.
    #[pyo3(signature = (index, camera = None))]
    fn image<'py>(&self, py: Python<'py>, index: usize, camera: Option<String>) -> Answer<Bound<'py, PyAny>> {
        let (dataset, camera) = (Arc::clone(&self.dataset), self.camera_name(camera)?);
        let image = long(py, None, move |_| Ok(dataset.image(&camera, index)?))?;
        let (rows, columns) = (image.height() as usize, image.width() as usize);
        let bytes = image.format().bytes();
        let flat = PyArray1::from_vec(py, image.into_data());
        match bytes {
            1 => Ok(flat.reshape([rows, columns]).python()?.into_any()),
            _ => Ok(flat.reshape([rows, columns, bytes]).python()?.into_any()),
        }
    }

    /// Depth along the optical axis that is registered to a frame, float32 metres of shape (rows, columns), NaN where
    /// there is none; None where the frame has no depth image.
    #[pyo3(signature = (index, camera = None))]
    fn depth_image<'py>(
        &self,
        py: Python<'py>,
        index: usize,
        camera: Option<String>,
    ) -> Answer<Option<Bound<'py, PyArray2<f32>>>> {
        let (dataset, camera) = (Arc::clone(&self.dataset), self.camera_name(camera)?);
        let Some(image) = long(py, None, move |_| Ok(dataset.depth_image(&camera, index)?))? else {
            return Ok(None);
        };
        let shape = [image.height() as usize, image.width() as usize];
        PyArray1::from_slice(py, image.z_m()).reshape(shape).python().map(Some)
    }

    /// Inertial samples in the body: (ns of shape (N,), angular rates in rad/s and specific forces in m/s², each of
    /// shape (N, 3)). Empty where the robot has none.
    #[allow(clippy::type_complexity, reason = "three arrays")]
    fn imu<'py>(
        &self,
        py: Python<'py>,
    ) -> Answer<(Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let dataset = Arc::clone(&self.dataset);
        let samples = long(py, None, move |_| Ok(dataset.imu()?))?;
        Ok((
            array_of(py, samples.iter().map(|s| s.stamp.as_nanos())),
            array_of_rows(py, samples.iter().map(|s| s.gyro_rad_s.into()))?,
            array_of_rows(py, samples.iter().map(|s| s.accel_m_s2.into()))?,
        ))
    }

    /// What it holds, in words: what ``vice info`` prints.
    #[pyo3(signature = (camera = None))]
    fn info(&self, py: Python<'_>, camera: Option<String>) -> Answer<String> {
        let (dataset, spec) = (Arc::clone(&self.dataset), self.spec.clone());
        long(py, None, move |_| {
            if camera.is_some() {
                DatasetSpec { camera: camera.clone(), ..spec }.camera_name(dataset.as_ref())?;
            }
            info::describe(dataset.as_ref(), camera.as_deref())
        })
    }

    /// What looked wrong in what was read so far, a line each.
    fn suspicions(&self) -> Vec<String> {
        self.dataset.suspicions().iter().map(vice_run::core::suspicion::Suspicion::line).collect()
    }

    fn __repr__(&self) -> String {
        format!(
            "<vicepose.Run {} ({}): cameras {:?}, streams {:?}>",
            self.dataset.name(),
            self.dataset.format(),
            self.cameras(),
            self.streams()
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (py, spec) = (slf.py(), &slf.get().spec);
        if vice_run::in_memory::is_in_memory(&spec.path.to_string_lossy()) {
            let robot = RunError::new(
                ErrorKind::Unsupported,
                "a run that is an object of Python is not pickled: pickle the object, and open it there",
            );
            return Err(crate::errors::Failure::Run(robot).into());
        }
        let arguments = (
            spec.path.clone(),
            spec.format.clone(),
            spec.set.clone(),
            spec.plugins.files.clone(),
            spec.plugins.allow_writable,
        );
        let open = py.import("vicepose._vicepose")?.getattr("open_path")?;
        Ok((open, arguments.into_pyobject(py)?.into_any()))
    }
}
