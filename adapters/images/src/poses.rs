//! Poses of layouts as poses of the core: whose they are, which axes they have, and which way is up.

use std::path::Path;
use std::sync::Arc;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Rigid, World, WorldFromBody};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_core::trajectory::{Trajectory, in_other_world};
use vice_files::trajectory::{self, ReadOptions};

use crate::parts::{Poses, StreamPart};

/// A world whose z points up, from one with a camera's axes: x right, y down, z forward. What was forward is x.
pub(crate) fn up_from_down() -> Rigid<World, World> {
    let rotation = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    turn(rotation)
}

fn turn(rotation: Matrix3<f64>) -> Rigid<World, World> {
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Rigid::from_parts(Vector3::zeros(), rotation)
}

/// Poses in a file, in any layout that is told by its content.
pub(crate) fn of_file(path: &Path, options: &ReadOptions) -> DataResult<Poses> {
    let file = trajectory::read(path, options)?;
    Ok(Poses { trajectory: file.trajectory, suspicions: file.suspicions.into_iter().collect() })
}

/// A stream that is a file.
pub(crate) fn stream(name: &str, path: &Path) -> StreamPart {
    let path = path.to_path_buf();
    StreamPart { name: name.to_string(), read: Box::new(move || of_file(&path, &ReadOptions::default())) }
}

/// The same poses in another world.
pub(crate) fn turned(poses: Poses, new_from_old: &Rigid<World, World>) -> Poses {
    Poses { trajectory: in_other_world(new_from_old, &poses.trajectory), ..poses }
}

/// Poses that were collected one by one, by stamp; two of one stamp are refused.
pub(crate) fn collected(
    about: &Path,
    mut poses: Vec<(Stamp, WorldFromBody)>,
    suspicions: Vec<Suspicion>,
) -> DataResult<Poses> {
    poses.sort_by_key(|(stamp, _)| *stamp);
    let trajectory = Trajectory::from_poses(poses).map_err(|e| DataError::of(e).at(about))?;
    Ok(Poses { trajectory, suspicions })
}

/// What is to be said of poses that are none.
pub(crate) fn left_out(about: &Path, count: u64, first: &str) -> Option<Suspicion> {
    (count > 0).then(|| {
        Suspicion::new("poses-left-out", about.display().to_string(), "poses that are none are left out")
            .evidence(format!("{count}, the first is {first}"))
            .times(count)
    })
}

/// Several readers of the same thing share what one of them read.
pub(crate) struct Shared<T>(std::sync::OnceLock<T>, Box<dyn Fn() -> DataResult<T> + Send + Sync>);

impl<T: Send + Sync + 'static> Shared<T> {
    pub(crate) fn new(read: impl Fn() -> DataResult<T> + Send + Sync + 'static) -> Arc<Self> {
        Arc::new(Self(std::sync::OnceLock::new(), Box::new(read)))
    }

    pub(crate) fn get(&self) -> DataResult<&T> {
        vice_files::once::cached(&self.0, &self.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn what_is_down_in_a_camera_is_down_in_the_world() {
        let up = up_from_down();
        let below = up.transform_point(&Point3::new(0.0, 1.65, 0.0));
        assert!((below - Point3::new(0.0, 0.0, -1.65)).norm() < 1e-12);
        let ahead = up.transform_point(&Point3::new(0.0, 0.0, 1.0));
        assert!((ahead - Point3::new(1.0, 0.0, 0.0)).norm() < 1e-12);
        let right = up.transform_point(&Point3::new(1.0, 0.0, 0.0));
        assert!((right - Point3::new(0.0, -1.0, 0.0)).norm() < 1e-12);
    }
}
