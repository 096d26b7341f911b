//! The file `vice-video.toml`.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use vice_core::camera::{Camera, Model};
use vice_core::dataset::{Floor, Plane};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::BodyFromCamera;

/// What `vice-video.toml` says; the crate's page shows one.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Description {
    /// Name of the data set.
    pub name: Option<String>,
    /// The film, relative to the file.
    pub film: String,
    /// The list of its stamps, relative to the file.
    pub stamps: String,
    /// Whether the film is decoded to gray.
    #[serde(default)]
    pub gray: bool,
    /// Inertial samples, relative to the file.
    pub imu: Option<String>,
    /// The plane `nx ny nz d` with n·p + d = 0 in the world, metres.
    pub floor: Option<[f64; 4]>,
    /// The camera.
    pub camera: CameraPart,
    /// Files of poses by the name of their stream, relative to the file.
    #[serde(default)]
    pub trajectories: BTreeMap<String, String>,
}

/// The camera of a [`Description`].
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraPart {
    /// Its name.
    #[serde(default = "default_name")]
    pub name: String,
    /// Columns and rows.
    pub size: [u32; 2],
    /// fx fy cx cy, pixels.
    pub intrinsics: [f64; 4],
    /// Name of the model.
    #[serde(default = "default_model")]
    pub model: String,
    /// Coefficients of the model.
    #[serde(default)]
    pub distortion: Vec<f64>,
    /// Row-major 4x4, metres.
    pub body_from_camera: Option<[f64; 16]>,
}

fn default_name() -> String {
    "camera".to_string()
}

fn default_model() -> String {
    "pinhole".to_string()
}

impl Description {
    /// Reads the text of a description.
    ///
    /// # Errors
    /// [`DataError`] with the line if the text is no TOML, misses an entry, or has one that is not known.
    pub fn parse(text: &str) -> DataResult<Self> {
        toml::from_str(text).map_err(|e| {
            let error = DataError::new(format!("is no description of a film: {}", e.message()));
            match e.span() {
                Some(span) => {
                    let before = text.get(..span.start).unwrap_or(text);
                    error.line(before.bytes().filter(|b| *b == b'\n').count() as u64 + 1)
                }
                None => error,
            }
        })
    }

    /// Reads a description file.
    ///
    /// # Errors
    /// [`DataError`] with path and line as [`Description::parse`], or if the file cannot be read.
    pub fn read(path: &Path) -> DataResult<Self> {
        let bytes = vice_files::image_file::read_bytes(path)?;
        let text = String::from_utf8(bytes).map_err(|_| DataError::new("is not UTF-8 text").at(path))?;
        Self::parse(&vice_files::leniency::without_marks(&text)).map_err(|e| e.at(path))
    }

    /// The floor.
    ///
    /// # Errors
    /// [`DataError`] if the numbers are no plane.
    pub(crate) fn floor(&self) -> DataResult<Floor> {
        Ok(Floor::World(match self.floor {
            Some([x, y, z, d]) => Plane::new([x, y, z], d)?,
            None => Plane::z_zero(),
        }))
    }
}

impl CameraPart {
    /// The intrinsics.
    ///
    /// # Errors
    /// [`DataError`] if the numbers are no camera.
    pub(crate) fn camera(&self) -> DataResult<Camera> {
        let [width, height] = self.size;
        Model::from_name(&self.model, &self.distortion)
            .and_then(|model| Camera::new(width, height, self.intrinsics, model))
            .map_err(DataError::of)
    }

    /// The extrinsics.
    ///
    /// # Errors
    /// [`DataError`] if the matrix is no rigid transform.
    pub(crate) fn extrinsics(&self) -> DataResult<BodyFromCamera> {
        match &self.body_from_camera {
            Some(matrix) => BodyFromCamera::try_from_row_major(matrix)
                .map_err(|e| DataError::new(format!("body_from_camera: {e}"))),
            None => Ok(BodyFromCamera::identity()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: &str = "film = \"a.mov\"\nstamps = \"s.txt\"\n[camera]\nsize = [64, 48]\nintrinsics = [50, 50, 31.5, 23.5]\n";

    #[test]
    fn defaults_are_a_pinhole_that_is_the_body() {
        let d = Description::parse(SHORT).unwrap();
        assert_eq!(d.camera.camera().unwrap().width(), 64);
        assert_eq!(d.camera.extrinsics().unwrap(), BodyFromCamera::identity());
        assert_eq!(d.floor().unwrap(), Floor::World(Plane::z_zero()));
        assert_eq!((d.camera.name.as_str(), d.gray, d.trajectories.len()), ("camera", false, 0));
    }

    #[test]
    fn mistakes_are_named_with_their_line() {
        let error = |text: &str| Description::parse(text).unwrap_err().to_string();
        let unknown = error(&SHORT.replace("stamps", "stamp"));
        assert!(unknown.contains("line 2") && unknown.contains("unknown field `stamp`"), "{unknown}");
        assert!(error("film = 3").contains("line 1"));
        assert!(error("film = \"a\"\nstamps = \"b\"").contains("missing field `camera`"));
        let bad = Description::parse(&SHORT.replace("[50,", "[-50,")).unwrap();
        assert!(bad.camera.camera().unwrap_err().to_string().contains("fx"));
        let mut mirrored = Description::parse(SHORT).unwrap().camera;
        let mut m = BodyFromCamera::identity().to_row_major();
        m[0] = -1.0;
        mirrored.body_from_camera = Some(m);
        assert!(mirrored.extrinsics().unwrap_err().to_string().contains("mirrored"));
        let mut floor = Description::parse(SHORT).unwrap();
        floor.floor = Some([0.0; 4]);
        assert!(floor.floor().is_err());
    }
}
