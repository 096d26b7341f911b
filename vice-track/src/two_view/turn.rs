//! The turn that brings directions onto others, robustly.

use nalgebra::{Matrix3, Rotation3};

use super::Pair;

/// Rounds of weighting points by how far they are off.
const ROUNDS: usize = 12;
/// Points that are so far off count half, pixels; where most are further off, their median.
const HALF_PX: f64 = 1.0;

/// The turn `to = turn · from` that most points follow: Kabsch's solution, weighted anew by what is left over.
pub(super) fn fit(pairs: &[Pair]) -> Rotation3<f64> {
    let mut turn = Rotation3::identity();
    let mut weights = vec![1.0; pairs.len()];
    for _ in 0..ROUNDS {
        let mut sum = Matrix3::zeros();
        for (pair, weight) in pairs.iter().zip(&weights) {
            sum += pair.to.ray * pair.from.ray.transpose() * *weight;
        }
        turn = nearest(&sum).unwrap_or(turn);
        let off: Vec<f64> = pairs.iter().map(|p| off_px(&turn, p)).collect();
        let scale = super::median_of(&off).max(HALF_PX);
        weights = off.iter().map(|off| 1.0 / (1.0 + (off / scale).powi(2))).collect();
    }
    turn
}

/// How far a point is off the place that the turn gives it, pixels.
pub(super) fn off_px(turn: &Rotation3<f64>, pair: &Pair) -> f64 {
    (turn * pair.from.ray).cross(&pair.to.ray).norm() * pair.px_per_rad()
}

/// The rotation nearest to a matrix.
fn nearest(matrix: &Matrix3<f64>) -> Option<Rotation3<f64>> {
    let svd = matrix.svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?);
    let sign = (u * v).determinant().signum();
    let flip = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, 1.0, sign));
    let turn = u * flip * v;
    turn.iter().all(|x| x.is_finite()).then(|| Rotation3::from_matrix_unchecked(turn))
}
