//! How directions move that lie on a plane, robustly: a homography.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::Pair;

/// Rounds of weighting points by how far they are off.
const ROUNDS: usize = 5;

/// `to ~ matrix · from`.
pub(super) type Homography = Matrix3<f64>;

/// The homography of weighted points, four at least: the smallest of all ways to miss `to × (matrix · from) = 0`.
pub(super) fn through(points: &[Pair], weights: &[f64]) -> Option<Homography> {
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (pair, weight) in points.iter().zip(weights) {
        let (x, y) = (pair.from.ray, pair.to.ray);
        let cross = y.cross_matrix();
        for row in 0..3 {
            let mut line = SVector::<f64, 9>::zeros();
            for k in 0..3 {
                for column in 0..3 {
                    line[3 * k + column] = cross[(row, k)] * x[column];
                }
            }
            normal += line * line.transpose() * *weight;
        }
    }
    let eigen = normal.symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    let h = eigen.eigenvectors.column(smallest);
    let matrix = Matrix3::from_row_slice(h.as_slice());
    let matrix = if matrix.determinant() < 0.0 { -matrix } else { matrix };
    matrix.iter().all(|v| v.is_finite()).then_some(matrix)
}

/// The homography that most points follow, near a start.
pub(super) fn refined(pairs: &[Pair], start: Homography, half_px: f64) -> Homography {
    let mut best = (cost(pairs, &start, half_px), start);
    let mut plane = start;
    for _ in 0..ROUNDS {
        let weight = |p: &Pair| 1.0 / (1.0 + (off_px(&plane, p) / half_px).powi(2)).powi(2);
        let weights: Vec<f64> = pairs.iter().map(weight).collect();
        let Some(next) = through(pairs, &weights) else { break };
        plane = next;
        let now = cost(pairs, &plane, half_px);
        if now < best.0 {
            best = (now, plane);
        }
    }
    best.1
}

/// How far a point is off the place that the plane gives it, pixels.
pub(super) fn off_px(plane: &Homography, pair: &Pair) -> f64 {
    let there: Vector3<f64> = plane * pair.from.ray;
    let length = there.norm();
    // Behind the camera is as far off as can be.
    if length < 1e-12 || there.dot(&pair.to.ray) <= 0.0 {
        return pair.px_per_rad();
    }
    (there / length).cross(&pair.to.ray).norm() * pair.px_per_rad()
}

/// Sum of squared distances, each at most `most_px`.
pub(super) fn cost(pairs: &[Pair], plane: &Homography, most_px: f64) -> f64 {
    pairs.iter().map(|p| off_px(plane, p).min(most_px).powi(2)).sum()
}
