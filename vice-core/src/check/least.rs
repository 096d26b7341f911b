//! Least squares with outliers counted less, and how sure the answer is by how much parts of the rows disagree.

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};

use crate::metrics::student::quantile_975;
use crate::statistics::median;

/// Rounds of counting outliers less.
const ROUNDS: usize = 8;
/// Rows count in full up to so many standard deviations, and not at all from so many on.
const FULL: f64 = 2.5;
const NONE: f64 = 7.0;
/// Parts that are held against each other.
const PARTS: usize = 20;

/// Three equations: `lever * x = value`.
pub(super) struct Row {
    pub(super) lever: Matrix3xX<f64>,
    pub(super) value: Vector3<f64>,
}

/// The answer.
pub(super) struct Solved {
    pub(super) x: DVector<f64>,
    /// Half of the 95 % interval of each.
    pub(super) half_95: DVector<f64>,
    /// RMS of what is left, weighted.
    pub(super) left: f64,
}

/// Solves rows that stand in the order of time; `prior`: what is added to the diagonal of the normal equations. `None` where
/// they do not determine `x`.
pub(super) fn solve(rows: &[Row], prior: &[f64]) -> Option<Solved> {
    let n = prior.len();
    if rows.len() < 2 * PARTS.max(n) {
        return None;
    }
    let mut weights = vec![1.0; rows.len()];
    let mut x = DVector::zeros(n);
    let mut inverse = DMatrix::zeros(n, n);
    let off = |x: &DVector<f64>, row: &Row| row.value - &row.lever * x;
    for _ in 0..ROUNDS {
        let mut normal = DMatrix::from_diagonal(&DVector::from_column_slice(prior));
        let mut right = DVector::zeros(n);
        for (row, w) in rows.iter().zip(&weights) {
            normal += row.lever.transpose() * &row.lever * *w;
            right += row.lever.transpose() * row.value * *w;
        }
        inverse = normal.try_inverse().filter(|m| m.iter().all(|v| v.is_finite()))?;
        x = &inverse * right;
        let sizes: Vec<f64> = rows.iter().map(|row| off(&x, row).norm()).collect();
        // Of a length in three directions the median is this many standard deviations.
        let sd = median(&mut sizes.clone())? / 1.54 + 1e-12;
        weights = sizes.iter().map(|size| weight(size / sd)).collect();
    }
    let mut pulls = vec![DVector::zeros(n); PARTS];
    let (mut sum, mut total) = (0.0, 0.0);
    for (i, (row, w)) in rows.iter().zip(&weights).enumerate() {
        let left = off(&x, row);
        pulls[i * PARTS / rows.len()] += row.lever.transpose() * left * *w;
        sum += w * left.norm_squared();
        total += w;
    }
    let spread: DMatrix<f64> = pulls.iter().fold(DMatrix::zeros(n, n), |m, p| m + p * p.transpose());
    let covariance = &inverse * spread * &inverse * (PARTS as f64 / (PARTS as f64 - 1.0));
    let t = quantile_975(PARTS as f64 - 1.0)?;
    let half_95 = DVector::from_fn(n, |i, _| t * covariance[(i, i)].max(0.0).sqrt());
    Some(Solved { x, half_95, left: (sum / f64::max(total, 1e-12)).sqrt() })
}

/// Huber's weight that goes to zero: 1 up to 2.5 standard deviations, 0 from 7 on.
pub(super) fn weight(deviations: f64) -> f64 {
    if deviations <= FULL { 1.0 } else { FULL / deviations * ((NONE - deviations) / (NONE - FULL)).max(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;

    #[test]
    fn an_answer_is_found_beside_outliers_and_its_interval_holds() {
        let truth = DVector::from_vec(vec![0.3, -1.0, 2.0, 0.5]);
        let (mut inside, mut most) = (0, 0.0_f64);
        for seed in 0..50 {
            let mut random = SplitMix::new(seed);
            let rows: Vec<Row> = (0..300)
                .map(|i| {
                    let lever = Matrix3xX::from_fn(4, |_, _| random.normal());
                    let wrong = if i % 15 == 3 { 20.0 } else { 0.0 };
                    let value = &lever * &truth + Vector3::from_fn(|_, _| 0.1 * random.normal() + wrong);
                    Row { lever, value }
                })
                .collect();
            let found = solve(&rows, &[0.0; 4]).unwrap();
            for i in 0..4 {
                let off = (found.x[i] - truth[i]).abs();
                inside += i32::from(off < found.half_95[i]);
                most = most.max(off);
            }
            assert!((found.left - 0.1 * 3.0_f64.sqrt()).abs() < 0.02, "{}", found.left);
        }
        assert!((175..=200).contains(&inside) && most < 0.03, "{inside} of 200, {most}");
        assert!(solve(&[], &[0.0; 4]).is_none());
    }
}
