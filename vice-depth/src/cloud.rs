//! A scan of the scene in memory.

use std::path::Path;
use std::sync::Arc;

use nalgebra::Point3;
use vice_core::dataset::{CloudRef, CloudSource};
use vice_core::error::{DataError, DataResult};

use crate::ply;

/// How a scan is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CloudOptions {
    /// Keep at most one point in each cube of this edge, metres.
    pub voxel_m: Option<f64>,
    /// Most memory that the points may take, bytes; by default what the machine has free.
    pub max_bytes: Option<u64>,
}

/// The points of a scan, metres, in the frame of the scan.
#[derive(Clone, Debug)]
pub struct Cloud {
    points: Vec<[f32; 3]>,
}

impl Cloud {
    /// Reads a PLY file.
    ///
    /// # Errors
    /// [`DataError`] with the byte or line if the file cannot be used.
    pub fn read_ply(path: impl AsRef<Path>, _options: &CloudOptions) -> DataResult<Self> {
        let path = path.as_ref();
        let points = ply::read_points(path)?.into_iter().map(|p| p.map(|v| v as f32)).collect();
        Self::checked(points).map_err(|e| e.at(path))
    }

    /// A scan from points in memory, metres.
    ///
    /// # Errors
    /// [`DataError`] if there is no point that is finite.
    pub fn from_points(
        points: impl IntoIterator<Item = Point3<f32>>,
        _options: &CloudOptions,
    ) -> DataResult<Self> {
        Self::checked(points.into_iter().map(|p| [p.x, p.y, p.z]).collect())
    }

    fn checked(mut points: Vec<[f32; 3]>) -> DataResult<Self> {
        let all = points.len();
        points.retain(|p| p.iter().all(|v| v.is_finite()));
        let left_out = all - points.len();
        if points.is_empty() {
            return Err(DataError::new("the cloud has no finite point"));
        }
        if left_out > 0 {
            tracing::warn!("{left_out} of {all} points are not finite and were left out");
        }
        Ok(Self { points })
    }

    /// Number of points, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "a cloud is never empty")]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// The points, metres, in no order that a file had.
    pub fn points(&self) -> impl ExactSizeIterator<Item = Point3<f64>> + '_ {
        self.points.iter().map(|p| Point3::from(*p).cast())
    }
}

/// Reads or copies the points that a data set refers to.
///
/// # Errors
/// As [`Cloud::read_ply`] and [`Cloud::from_points`].
pub fn load_cloud(cloud: &CloudRef, options: &CloudOptions) -> DataResult<Arc<Cloud>> {
    let cloud = match &cloud.source {
        CloudSource::Ply(path) => Cloud::read_ply(path, options)?,
        CloudSource::Points(points) => Cloud::from_points(points.iter().copied(), options)?,
        _ => return Err(DataError::new("a cloud of this kind cannot be read")),
    };
    Ok(Arc::new(cloud))
}
