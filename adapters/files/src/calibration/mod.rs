//! Calibrations that override what a data set says.
//!
//! TOML, everything optional as long as something is there:
//! ```toml
//! time_offset_s = 0.02             # added to the stamps of an estimate
//!
//! [cam0]
//! model = "radtan"                 # pinhole, radtan, rational, equidistant, ds, eucm, omni, fov
//! resolution = [752, 480]
//! intrinsics = [458.654, 457.296, 367.215, 248.375]   # fx, fy, cx, cy in pixels
//! distortion = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
//! body_from_camera = [0, -1, 0, 0,  1, 0, 0, 0,  0, 0, 1, 0,  0, 0, 0, 1]   # row by row, metres
//! ```
//! or what other tools write, told by its keys: the camchain of Kalibr (`T_cam_imu`, `T_cn_cnm1`) and of OpenVINS
//! (`T_imu_cam`), EuRoC's `sensor.yaml` (`T_BS`), `camera_info` of ROS, OpenCV's YAML and XML, ORB-SLAM, VINS (camodocal),
//! Basalt's JSON, and the cameras of COLMAP, text or binary, whose (0, 0) is the corner of the image. A key
//! about geometry, time or size is used or refused by its name; others that are not known are in
//! [`CalibrationFile::suspicions`]. `timeshift_cam_imu` is the clock offset of its camera.

mod basalt;
mod colmap;
mod dialects;
mod entry;
mod keys;
mod lens;
mod orb_slam;
mod toml_file;
mod tree;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use vice_core::camera::{Camera, CameraError, Model};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::BodyFromCamera;
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::Span;

use crate::atomic::{self, Overwrite};
use crate::rigid_file::is_toml;
use crate::yaml;

pub use colmap::ColmapModel;

/// What is read, for messages.
const DIALECTS: &str = "a calibration is TOML (named .toml), a camchain of Kalibr or OpenVINS, a sensor.yaml, a camera_info \
                        of ROS, OpenCV's YAML or XML, settings of ORB-SLAM or VINS, Basalt's JSON, or COLMAP's \
                        cameras.txt or cameras.bin";

/// A calibration, by camera.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CalibrationFile {
    path: PathBuf,
    cameras: BTreeMap<String, CameraOverride>,
    /// The file describes one camera and does not say under which name the data set has it.
    nameless: bool,
    /// Topics of the cameras, where the file names them.
    topics: BTreeMap<String, String>,
    /// Added to the stamps of an estimate, by camera.
    time_offsets: BTreeMap<String, Span>,
    /// Keys that are not known, and about nothing that matters here.
    unused: Vec<String>,
    said: Vec<Suspicion>,
    suspicions: Suspicions,
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

    /// Reads a TOML file, by its extension, or else a file of another tool.
    ///
    /// # Errors
    /// [`DataError`] with path and line if the file cannot be read, says nothing, or holds a negative focal length, an
    /// unknown model, a wrong number of coefficients, a matrix that is no rigid transform, statements that contradict
    /// each other, or a key about geometry, time or size that is not known.
    pub fn read(path: impl AsRef<Path>) -> DataResult<Self> {
        let path = path.as_ref();
        let parsed = if is_binary(path) {
            colmap::from_bytes(&yaml::read_bytes(path)?)
        } else {
            let text = yaml::read_text(path)?;
            match &text {
                text if is_toml(path) => toml_file::parse(text),
                text if colmap::is_text(text) => colmap::from_text(text),
                text => dialects::parse(text),
            }
        };
        let mut file = parsed.map_err(|e| e.at(path))?;
        file.path = path.to_path_buf();
        file.put_into_words();
        for (name, camera) in &file.cameras {
            camera.check().map_err(|e| in_camera(name, &e).at(path))?;
        }
        Ok(file)
    }

    /// What is not used of the file, and what was done that the user should know.
    pub const fn suspicions(&self) -> &Suspicions {
        &self.suspicions
    }

    fn put_into_words(&mut self) {
        let about = self.path.display().to_string();
        if !self.unused.is_empty() {
            self.unused.sort();
            self.unused.dedup();
            self.suspicions.add(
                Suspicion::new("calibration-keys", &about, "keys that are not known are not used")
                    .evidence(self.unused.join(", ")),
            );
        }
        for mut suspicion in std::mem::take(&mut self.said) {
            suspicion.about = format!("{about} [{}]", suspicion.about);
            self.suspicions.add(suspicion);
        }
    }

    /// The file for a camera of a data set: the entry that is about it, under its name.
    ///
    /// It is the one of that name, else the one whose topic names the camera, else the only one where the data set has
    /// but one camera, or where the file does not name its camera.
    ///
    /// # Errors
    /// [`DataError`] if the file is about other cameras, or several of its entries could be meant.
    pub fn for_camera(&self, camera: &str, cameras: &[String]) -> DataResult<Self> {
        if self.cameras.is_empty() || self.cameras.contains_key(camera) {
            return Ok(self.clone());
        }
        let entry = match self.entry_of(camera) {
            Some(entry) => Some(entry),
            None if self.cameras.len() == 1 && (cameras.len() <= 1 || self.nameless) => {
                self.cameras.keys().next()
            }
            None => None,
        };
        let Some(entry) = entry.cloned() else {
            let known: Vec<&str> = self.cameras.keys().map(String::as_str).collect();
            return Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!(
                    "the file is of {}, the camera is {camera}; give its entry that name",
                    known.join(", ")
                ),
            )
            .at(&self.path));
        };
        let mut file = self.clone();
        if let Some(found) = file.cameras.remove(&entry) {
            file.cameras.insert(camera.to_string(), found);
        }
        if let Some(offset) = file.time_offsets.remove(&entry) {
            file.time_offsets.insert(camera.to_string(), offset);
        }
        Ok(file)
    }

    /// Whether the file has one camera and does not name it.
    pub const fn is_nameless(&self) -> bool {
        self.nameless
    }

    /// The one entry whose topic has the camera's name as a part: `/cam0/image_raw` is `cam0`.
    fn entry_of(&self, camera: &str) -> Option<&String> {
        let names = |topic: &str| topic == camera || topic.split('/').any(|part| part == camera);
        let mut found = self.topics.iter().filter(|(_, topic)| names(topic)).map(|(name, _)| name);
        found.next().filter(|_| found.next().is_none())
    }

    /// What is added to the stamps of an estimate where this camera's frames are looked at: what the file says for all
    /// cameras, else for this one (also by its topic, or where it is the only one).
    pub fn time_offset_of(&self, camera: &str) -> Option<Span> {
        let entry = match self.cameras.contains_key(camera) {
            true => camera,
            false => match self.entry_of(camera) {
                Some(entry) => entry,
                None if self.cameras.len() == 1 => self.cameras.keys().next()?,
                None => return self.time_offset,
            },
        };
        self.time_offset.or_else(|| self.time_offsets.get(entry).copied())
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

    /// The file for pictures of this size, which a data set without a calibration of its own has: taken where the file says
    /// none.
    ///
    /// # Errors
    /// [`DataError`] with the path if the file is of another size.
    pub fn of_pictures(&self, name: &str, size: [u32; 2]) -> DataResult<Self> {
        let mut file = self.clone();
        let Some(entry) = file.cameras.get_mut(name) else { return Ok(file) };
        match entry.resolution {
            Some([w, h]) if [w, h] != size => Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!(
                    "[{name}]: the calibration is of {w}x{h} images, the data set's have {}x{}",
                    size[0], size[1]
                ),
            )
            .at(&self.path)
            .hint("were the images made smaller? Then size and intrinsics are smaller too")),
            _ => {
                entry.resolution = Some(size);
                Ok(file)
            }
        }
    }

    /// Extrinsics of a camera, where the file has them.
    pub fn body_from_camera(&self, name: &str) -> Option<BodyFromCamera> {
        self.cameras.get(name)?.body_from_camera
    }

    /// The text of a TOML file.
    pub fn to_toml(&self) -> String {
        toml_file::to_text(self)
    }

    /// Writes TOML, all or nothing.
    ///
    /// # Errors
    /// [`DataError`] if the file cannot be written or may not be replaced.
    pub fn write(&self, path: impl AsRef<Path>, overwrite: Overwrite) -> DataResult<()> {
        let text = self.to_toml();
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

    /// The camera: `base`, the data set's, with what is said here in its place; `None` where nothing is said of the
    /// intrinsics.
    ///
    /// # Errors
    /// [`DataError`] if what is left out is not in `base` either, or the parts do not fit.
    pub fn camera(&self, base: Option<&Camera>) -> DataResult<Option<Camera>> {
        if self.has_intrinsics() { self.combine(base).map(Some) } else { Ok(None) }
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
        camera.map_err(DataError::of)
    }
}

/// COLMAP's binary list of cameras, by its name.
fn is_binary(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bin"))
}

fn in_camera(name: &str, problem: &impl std::fmt::Display) -> DataError {
    DataError::new(format!("[{name}]: {problem}"))
}

#[cfg(test)]
mod dialect_tests;
#[cfg(test)]
mod tests;
