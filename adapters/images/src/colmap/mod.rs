//! COLMAP's sparse models, as text and as binary (colmap.github.io/format.html).
//!
//! An image's pose is `camera_from_world`, its quaternion w first. Coordinates of the image count from its corner, where
//! pixel centres are halves: half a pixel is taken off the principal point. The world is the model's own: its up and its
//! scale are not known.

mod binary;
mod camera;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Point3, Vector3};
use vice_core::dataset::{CloudRef, CloudSource};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{Rigid, World, WorldFromBody};

pub(crate) use camera::ModelCamera;

/// An image of a model.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ModelImage {
    /// As the model names it, relative to the folder of images.
    pub(crate) name: String,
    pub(crate) camera: u32,
    pub(crate) world_from_camera: WorldFromBody,
}

/// Cameras and images of a model.
#[derive(Clone, Debug)]
pub(crate) struct SparseModel {
    pub(crate) folder: PathBuf,
    pub(crate) cameras: BTreeMap<u32, ModelCamera>,
    /// In natural order of their names.
    pub(crate) images: Vec<ModelImage>,
}

/// Whether a folder holds a model: its binary files first, as COLMAP itself looks.
pub(crate) fn is_model(folder: &Path) -> bool {
    is_binary(folder) || folder.join("cameras.txt").is_file() && folder.join("images.txt").is_file()
}

fn is_binary(folder: &Path) -> bool {
    folder.join("cameras.bin").is_file() && folder.join("images.bin").is_file()
}

impl SparseModel {
    /// Reads cameras and images.
    ///
    /// # Errors
    /// [`DataError`] with the file and the line or byte that is wrong.
    pub(crate) fn read(folder: &Path) -> DataResult<Self> {
        let binary = is_binary(folder);
        let file = |name: &str| folder.join(format!("{name}.{}", if binary { "bin" } else { "txt" }));
        let (cameras_file, images_file) = (file("cameras"), file("images"));
        let cameras = match binary {
            true => binary::cameras(&cameras_file),
            false => text::cameras(&cameras_file),
        };
        let cameras = cameras.map_err(|e| e.at(&cameras_file))?;
        let images = match binary {
            true => binary::images(&images_file),
            false => text::images(&images_file),
        };
        let mut images = images.map_err(|e| e.at(&images_file))?;
        if images.is_empty() {
            return Err(DataError::of_kind(ErrorKind::Missing, "the model holds no images").at(images_file));
        }
        if let Some(lost) = images.iter().find(|i| !cameras.contains_key(&i.camera)) {
            return Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!(
                    "{} is of camera {}, which {} does not have",
                    lost.name,
                    lost.camera,
                    cameras_file.display()
                ),
            )
            .at(images_file));
        }
        images.sort_by(|a, b| crate::files::natural(&a.name, &b.name));
        Ok(Self { folder: folder.to_path_buf(), cameras, images })
    }

    /// The model's points as a scan. They are moved to their middle before they become single precision.
    ///
    /// # Errors
    /// [`DataError`] with the file and the line or byte that is wrong.
    pub(crate) fn cloud(folder: &Path) -> DataResult<CloudRef> {
        let file = folder.join(if is_binary(folder) { "points3D.bin" } else { "points3D.txt" });
        let points = if is_binary(folder) { binary::points(&file) } else { text::points(&file) };
        let points = points.map_err(|e| e.at(&file))?;
        let middle = match points.len() {
            0 => Vector3::zeros(),
            n => points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / n as f64,
        };
        let near = |p: &Point3<f64>| Point3::from((p.coords - middle).cast::<f32>());
        let near: Vec<Point3<f32>> = points.iter().map(near).collect();
        Ok(CloudRef {
            source: CloudSource::Points(near.into()),
            world_from_cloud: Rigid::<World, _>::from_parts(middle, nalgebra::UnitQuaternion::identity()),
        })
    }
}

/// Whether a folder has points.
pub(crate) fn has_points(folder: &Path) -> bool {
    folder.join(if is_binary(folder) { "points3D.bin" } else { "points3D.txt" }).is_file()
}

/// A pose from the numbers of both files: `camera_from_world`, turned around.
fn pose(q_wxyz: [f64; 4], t: [f64; 3]) -> DataResult<WorldFromBody> {
    let camera_from_world = Rigid::<vice_core::frames::Body, World>::try_from_parts(t, q_wxyz);
    camera_from_world.map(|pose| pose.inverse()).map_err(DataError::of)
}
