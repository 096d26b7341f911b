//! Intervals by resampling points and blocks of time, both with replacement.
//!
//! A label takes part as often as its point was drawn times as often as its block was: errors that points share at an
//! instant and errors that a point keeps over time both widen the interval (Owen, "The pigeonhole bootstrap", 2007).
//! Each resample is refitted by one step of the quadratic piece at the solution, which costs no projection.

use nalgebra::DVector;

use super::blocks::Blocks;
use super::solve::{Fit, Normal};
use crate::random::SplitMix;

/// The middle of the resampled values that an interval spans.
const INTERVAL: f64 = 0.95;

/// Parameters of resampled fits.
#[derive(Clone, Debug)]
pub(super) struct Resampled {
    /// One vector of parameters for each resample.
    values: Vec<DVector<f64>>,
}

impl Resampled {
    pub(super) fn new(fit: &Fit, blocks: &Blocks, resamples: usize, seed: u64) -> Self {
        let points = blocks.cells.iter().map(|c| c.point).max().map_or(0, |p| p + 1);
        let solution =
            DVector::from_iterator(fit.parameters.len(), fit.parameters.iter().map(|p| fit.theta[*p]));
        let ridge = fit.ridge();
        let mut random = SplitMix(seed);
        let mut values = Vec::with_capacity(resamples);
        for _ in 0..resamples {
            let (point_times, block_times) = (random.resample(points), random.resample(blocks.len()));
            let mut sum = Normal::zeros(fit.parameters.len());
            for (cell, piece) in blocks.cells.iter().zip(&fit.pieces) {
                let times = point_times[cell.point] * block_times[cell.block];
                if times > 0 {
                    sum.add(piece, f64::from(times));
                }
            }
            if let Some(step) = sum.solve(&ridge, 0.0) {
                values.push(&solution + step);
            }
        }
        Self { values }
    }

    /// Where the middle 95 % of a number lie that is made of the parameters.
    pub(super) fn interval(&self, number: impl Fn(&[f64]) -> f64) -> [f64; 2] {
        let mut sorted: Vec<f64> = self.values.iter().map(|v| number(v.as_slice())).collect();
        sorted.sort_by(f64::total_cmp);
        [quantile(&sorted, 0.5 * (1.0 - INTERVAL)), quantile(&sorted, 0.5 * (1.0 + INTERVAL))]
    }

    /// Standard deviation of each parameter.
    pub(super) fn deviations(&self) -> Vec<f64> {
        let Some(first) = self.values.first() else { return vec![] };
        let count = self.values.len() as f64;
        (0..first.len())
            .map(|i| {
                let mean = self.values.iter().map(|v| v[i]).sum::<f64>() / count;
                (self.values.iter().map(|v| (v[i] - mean).powi(2)).sum::<f64>() / count).sqrt()
            })
            .collect()
    }
}

/// Quantile of ascending values, linear between neighbours; NaN where there are none.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = share * last as f64;
    let (below, above) = (at.floor() as usize, at.ceil() as usize);
    sorted[below] + (sorted[above] - sorted[below]) * (at - at.floor())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_neighbours() {
        let values = [0.0, 1.0, 2.0, 3.0];
        assert_eq!((quantile(&values, 0.0), quantile(&values, 1.0)), (0.0, 3.0));
        assert_eq!(quantile(&values, 0.5), 1.5);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
