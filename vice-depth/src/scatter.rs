//! How points lie about their mean: what a plane through them is fitted to.

use nalgebra::{Matrix3, Vector3};

/// Points summed up.
pub(crate) struct Scatter {
    /// How many, at least one.
    pub(crate) count: f64,
    /// Their mean.
    pub(crate) mean: Vector3<f64>,
    /// The sum of the outer squares of what they differ from it: the covariance times their number. Its eigenvector of
    /// the least eigenvalue is the normal of the plane of least squares.
    pub(crate) squares: Matrix3<f64>,
}

impl Scatter {
    /// The mean first, so that points far from the origin lose no digits.
    pub(crate) fn of(points: impl ExactSizeIterator<Item = Vector3<f64>> + Clone) -> Self {
        let count = points.len().max(1) as f64;
        let mean = points.clone().sum::<Vector3<f64>>() / count;
        let mut squares = Matrix3::zeros();
        for point in points {
            let d = point - mean;
            squares += d * d.transpose();
        }
        Self { count, mean, squares }
    }
}
