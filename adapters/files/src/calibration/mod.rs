//! Calibrations that override what a data set says.
//!
//! TOML, everything optional as long as something is there:
//! ```toml
//! time_offset_s = 0.02             # added to the stamps of an estimate
//!
//! [cam0]
//! model = "radtan"                 # pinhole, radtan, rational, equidistant
//! resolution = [752, 480]
//! intrinsics = [458.654, 457.296, 367.215, 248.375]   # fx, fy, cx, cy in pixels
//! distortion = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
//! body_from_camera = [0, -1, 0, 0,  1, 0, 0, 0,  0, 0, 1, 0,  0, 0, 0, 1]   # row by row, metres
//! ```
//! or the camchain that Kalibr writes, whose `T_cam_imu` is `camera_from_body`.

mod kalibr;
mod toml_file;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use vice_core::camera::{Camera, CameraError, Model};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::BodyFromCamera;
use vice_core::time::Span;

use crate::atomic::{self, Overwrite};
use crate::rigid_file::is_toml;
use crate::yaml;

/// A calibration, by camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CalibrationFile {
    path: PathBuf,
    cameras: BTreeMap<String, CameraOverride>,
    /// Added to the stamps of an estimate, where the file says so.
    pub time_offset: Option<Span>,
}

/// What a calibration says of one camera; what is `None` stays as the data set has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraOverride {
    /// Name of the lens model, as [`Model::from_name`] takes it.
    pub model: Option<String>,
    /// Columns and rows.
    pub resolution: Option<[u32; 2]>,
    /// fx, fy, cx, cy in pixels.
    pub intrinsics: Option<[f64; 4]>,
    /// Coefficients of the lens model.
    pub distortion: Option<Vec<f64>>,
    /// Extrinsics.
    pub body_from_camera: Option<BodyFromCamera>,
}

impl CalibrationFile {
    /// An empty calibration, to be filled and written.
    pub fn new() -> Self {
        Self::default()
    }

    /// Reads a TOML file, by its extension, or else a Kalibr camchain.
    ///
    /// # Errors
    /// [`DataError`] with path and line if the file cannot be read, says nothing, or holds a negative focal length, an
    /// unknown model, a wrong number of coefficients, or a matrix that is no rigid transform.
    pub fn read(path: impl AsRef<Path>) -> DataResult<Self> {
        let path = path.as_ref();
        let text = yaml::read_text(path)?;
        let parsed = if is_toml(path) { toml_file::parse(&text) } else { kalibr::parse(&text) };
        let mut file = parsed.map_err(|e| e.at(path))?;
        file.path = path.to_path_buf();
        for (name, camera) in &file.cameras {
            camera.check().map_err(|e| in_camera(name, &e).at(path))?;
        }
        Ok(file)
    }

    /// Adds a camera, or takes the place of one of that name.
    pub fn insert(&mut self, name: impl Into<String>, camera: CameraOverride) {
        self.cameras.insert(name.into(), camera);
    }

    /// What the file says, by camera.
    pub const fn cameras(&self) -> &BTreeMap<String, CameraOverride> {
        &self.cameras
    }

    /// Intrinsics of a camera: those of `base`, the data set's, with what the file says in their place.
    ///
    /// `None` where the file says nothing about this camera's intrinsics.
    ///
    /// # Errors
    /// [`DataError`] with the path if what the file leaves out is not in `base` either, or the parts do not fit.
    pub fn camera(&self, name: &str, base: Option<&Camera>) -> DataResult<Option<Camera>> {
        match self.cameras.get(name) {
            Some(o) if o.has_intrinsics() => o
                .combine(base)
                .map(Some)
                .map_err(|e| DataError::new(format!("[{name}]: {}", e.problem())).at(&self.path)),
            _ => Ok(None),
        }
    }

    /// Extrinsics of a camera, where the file has them.
    pub fn body_from_camera(&self, name: &str) -> Option<BodyFromCamera> {
        self.cameras.get(name)?.body_from_camera
    }

    /// Writes TOML, all or nothing.
    ///
    /// # Errors
    /// [`DataError`] if the file cannot be written or may not be replaced.
    pub fn write(&self, path: impl AsRef<Path>, overwrite: Overwrite) -> DataResult<()> {
        let text = toml_file::to_text(self);
        atomic::write(path, overwrite, |w| w.write_all(text.as_bytes()))
    }
}

impl CameraOverride {
    /// Everything about a camera.
    pub fn of(camera: &Camera, body_from_camera: Option<BodyFromCamera>) -> Self {
        Self {
            model: Some(camera.model().name().to_string()),
            resolution: Some([camera.width(), camera.height()]),
            intrinsics: Some(camera.fx_fy_cx_cy()),
            distortion: Some(camera.model().coefficients()),
            body_from_camera,
        }
    }

    fn has_intrinsics(&self) -> bool {
        self.model.is_some()
            || self.resolution.is_some()
            || self.intrinsics.is_some()
            || self.distortion.is_some()
    }

    /// Finds what is wrong whatever the data set says, so that it is known when the file is read.
    fn check(&self) -> Result<(), CameraError> {
        let [width, height] = self.resolution.unwrap_or([1, 1]);
        let intrinsics = self.intrinsics.unwrap_or([1.0, 1.0, 0.0, 0.0]);
        Camera::new(width, height, intrinsics, Model::Pinhole)?;
        if let Some(name) = &self.model {
            match Model::from_name(name, self.distortion.as_deref().unwrap_or_default()) {
                // The coefficients may be the data set's.
                Err(CameraError::CoefficientCount { .. }) if self.distortion.is_none() => {}
                other => drop(other?),
            }
        }
        Ok(())
    }

    fn combine(&self, base: Option<&Camera>) -> DataResult<Camera> {
        let missing = |what: &str| DataError::new(format!("{what} is missing, and the data set has none"));
        let [width, height] =
            self.resolution.or(base.map(|b| [b.width(), b.height()])).ok_or_else(|| missing("resolution"))?;
        if let Some(base) = base.filter(|b| (b.width(), b.height()) != (width, height)) {
            return Err(DataError::new(format!(
                "the calibration is of {width}x{height} images, the data set's have {}x{}",
                base.width(),
                base.height()
            )));
        }
        let intrinsics =
            self.intrinsics.or(base.map(Camera::fx_fy_cx_cy)).ok_or_else(|| missing("intrinsics"))?;
        let model = match (&self.model, &self.distortion, base.map(Camera::model)) {
            (None, None, Some(model)) => Ok(*model),
            (Some(name), Some(distortion), _) => Model::from_name(name, distortion),
            (None, Some(distortion), Some(model)) => Model::from_name(model.name(), distortion),
            // The same model by another of its names keeps its coefficients.
            (Some(name), None, Some(model)) => match Model::from_name(name, &model.coefficients()) {
                Ok(same) if same.name() == model.name() => Ok(same),
                _ => Model::from_name(name, &[]),
            },
            (Some(name), None, None) => Model::from_name(name, &[]),
            (None, _, None) => return Err(missing("model")),
        };
        let camera = model.and_then(|model| Camera::new(width, height, intrinsics, model));
        camera.map_err(|e| DataError::new(e.to_string()))
    }
}

fn in_camera(name: &str, problem: &impl std::fmt::Display) -> DataError {
    DataError::new(format!("[{name}]: {problem}"))
}

#[cfg(test)]
mod tests;
