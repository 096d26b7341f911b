//! The noise that is left when a flaw is taken out: of labels, of key frames, and of poses that wander.
//!
//! Residuals of a segment start at its key frame. What its own label was off by, they all share; then the pose wanders
//! away like a random walk; and each label has noise of its own. Weighting with that covariance is what makes a fit
//! precise: the wander of a good odometry is slow, what a late clock does is not.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::blocks::{Blocks, Cell};
use super::problem::Residual;

/// No label is better than this, pixels: exact residuals must not divide by nothing.
const FLOOR_PX: f64 = 0.01;
/// What a cell shares is nearly free, in deviations of a label: a key frame may be an outlier.
const SHARED_SIGMAS: f64 = 10.0;
/// Fewer labels than this in a cell share nothing that could be told from their own noise.
const SHARING: usize = 3;
/// Labels further than this many deviations from what their neighbours say are outliers, and weigh less.
const OUTLIER: f64 = 3.0;
/// Cells whose mean square is larger than this, in units of what it should be, are outliers as a whole: what a wrong key
/// frame does turns with the camera and is no constant.
const OUTLIER_CELL: f64 = 1.5;

/// Standard deviations of one coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Noise {
    /// Of a label, pixels.
    pub(super) label_px: f64,
    /// Of the wander, pixels after one second; it grows with the root of the time.
    pub(super) wander_px: f64,
}

impl Noise {
    /// From residuals: differences of labels of a cell grow with the time between them by the wander alone. Medians,
    /// so that outliers do not count.
    pub(super) fn of(residuals: &[Residual], blocks: &Blocks) -> Self {
        let (mut near, mut far) = (Differences::default(), Differences::default());
        for cell in &blocks.cells {
            let count = cell.labels.len();
            let add = |to: &mut Differences, a: usize, b: usize| {
                let length = (residuals[cell.labels[b]] - residuals[cell.labels[a]]).norm();
                to.add(length, cell.seconds[b] - cell.seconds[a]);
            };
            (1..count).for_each(|i| add(&mut near, i - 1, i));
            (count / 2..count).filter(|i| *i > 0).for_each(|i| add(&mut far, i - count / 2, i));
        }
        let (Some((near_px2, near_s)), Some((far_px2, far_s))) = (near.variance(), far.variance()) else {
            let lengths = residuals.iter().map(|r| r.norm()).collect();
            return Self { label_px: median_px2(lengths).sqrt().max(FLOOR_PX), wander_px: 0.0 };
        };
        let slope = if far_s > near_s { ((far_px2 - near_px2) / (far_s - near_s)).max(0.0) } else { 0.0 };
        let label_px2 = 0.5 * (near_px2 - slope * near_s);
        // A wander can at most be all of the nearest differences.
        let wander_px2 = slope.min(near_px2 / near_s.max(f64::MIN_POSITIVE));
        Self { label_px: label_px2.max(0.0).sqrt().max(FLOOR_PX), wander_px: wander_px2.sqrt() }
    }

    /// Deviation of a label so long after its key frame, pixels.
    pub(super) fn after_px(&self, seconds: f64) -> f64 {
        (self.label_px.powi(2) + self.wander_px.powi(2) * seconds).sqrt()
    }

    /// Covariance of one coordinate of the labels of a cell, px².
    fn covariance(&self, cell: &Cell, weights: impl Fn(usize) -> f64) -> DMatrix<f64> {
        let label_px2 = self.label_px.powi(2);
        let shared = if cell.labels.len() < SHARING { 0.0 } else { SHARED_SIGMAS.powi(2) * label_px2 };
        DMatrix::from_fn(cell.labels.len(), cell.labels.len(), |i, j| {
            let own = if i == j { label_px2 / weights(i) } else { 0.0 };
            own + shared + self.wander_px.powi(2) * cell.seconds[i].min(cell.seconds[j])
        })
    }

    /// What turns the labels of a cell into independent ones.
    pub(super) fn whitener(&self, cell: &Cell, weights: impl Fn(usize) -> f64) -> Option<Whitener> {
        self.covariance(cell, weights).cholesky().map(|factor| Whitener { factor, weight: 1.0 })
    }

    /// The same, the cell as a whole weighted by how well its residuals agree with the noise.
    pub(super) fn robust_whitener(
        &self,
        cell: &Cell,
        residuals: &[Residual],
        weights: &[f64],
    ) -> Option<Whitener> {
        let mut whitener = self.whitener(cell, |i| weights[cell.labels[i]])?;
        if cell.labels.len() >= SHARING {
            let both = [0, 1].map(|axis| coordinate(residuals, cell, axis));
            let squares = whitener.apply(DMatrix::from_columns(&both)).norm_squared();
            let excess = squares / (2 * cell.labels.len()) as f64;
            whitener.weight = (OUTLIER_CELL / excess.max(OUTLIER_CELL)).powi(2);
        }
        Some(whitener)
    }

    /// Robust weights of all labels: by how far each is from what the others of its cell predict.
    pub(super) fn weights(&self, residuals: &[Residual], blocks: &Blocks) -> Vec<f64> {
        let mut weights = vec![1.0; residuals.len()];
        for cell in &blocks.cells {
            let Some(precision) = self.covariance(cell, |_| 1.0).cholesky().map(|c| c.inverse()) else {
                continue;
            };
            let [u, v] = [0, 1].map(|axis| &precision * coordinate(residuals, cell, axis));
            for (i, label) in cell.labels.iter().enumerate() {
                let deviations = u[i].hypot(v[i]) / precision[(i, i)].max(f64::MIN_POSITIVE).sqrt();
                weights[*label] = (OUTLIER / deviations.max(OUTLIER)).powi(2);
            }
        }
        weights
    }
}

/// The factor of a covariance, and the weight of its cell.
pub(super) struct Whitener {
    factor: Cholesky<f64, Dyn>,
    weight: f64,
}

impl Whitener {
    /// Columns made independent, of unit variance.
    pub(super) fn apply(&self, mut columns: DMatrix<f64>) -> DMatrix<f64> {
        self.factor.l_dirty().solve_lower_triangular_mut(&mut columns);
        columns * self.weight.sqrt()
    }
}

/// One coordinate of the residuals of a cell.
pub(super) fn coordinate(residuals: &[Residual], cell: &Cell, axis: usize) -> DVector<f64> {
    DVector::from_iterator(cell.labels.len(), cell.labels.iter().map(|l| residuals[*l][axis]))
}

/// Lengths of differences, and the times they are over.
#[derive(Default)]
struct Differences {
    lengths_px: Vec<f64>,
    seconds: f64,
}

impl Differences {
    fn add(&mut self, length_px: f64, seconds: f64) {
        self.lengths_px.push(length_px);
        self.seconds += seconds;
    }

    /// Variance of one coordinate and the mean time; `None` where there are too few.
    fn variance(self) -> Option<(f64, f64)> {
        const FEWEST: usize = 8;
        let count = self.lengths_px.len();
        (count >= FEWEST).then(|| (median_px2(self.lengths_px), self.seconds / count as f64))
    }
}

/// Variance of one coordinate from the median length: that of a normal distribution in the plane is `√(2 ln 2)`
/// deviations long.
fn median_px2(mut lengths_px: Vec<f64>) -> f64 {
    lengths_px.sort_by(f64::total_cmp);
    let median = lengths_px.get(lengths_px.len() / 2).copied().unwrap_or(0.0);
    median * median / (2.0 * std::f64::consts::LN_2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::problem::ScoredLabel;
    use crate::random::SplitMix;
    use crate::time::Stamp;
    use nalgebra::Vector2;

    /// Standard normal enough: twelve uniform numbers.
    fn normal(random: &mut SplitMix) -> f64 {
        (0..12).map(|_| (random.next() >> 11) as f64 / (1_u64 << 53) as f64).sum::<f64>() - 6.0
    }

    #[test]
    fn label_noise_and_wander_are_told_apart_and_outliers_do_not_count() {
        let mut random = SplitMix(5);
        let (mut labels, mut residuals, mut outliers) = (vec![], vec![], vec![]);
        for segment in 0..60_i64 {
            let mut walk = Vector2::zeros();
            for i in 1..=30_i64 {
                let at = |ms: i64| Stamp::from_nanos(1_000_000 * ms);
                labels.push(ScoredLabel {
                    point: 0,
                    name: "p".into(),
                    stamp: at(10_000 * segment + 100 * i),
                    keyframe: at(10_000 * segment),
                });
                let step =
                    |random: &mut SplitMix, sigma: f64| Vector2::new(normal(random), normal(random)) * sigma;
                walk += step(&mut random, 0.8 * 0.1_f64.sqrt());
                let outlier = random.below(50) == 0;
                outliers.push(outlier);
                let far = if outlier { Vector2::new(10.0, 0.0) } else { Vector2::zeros() };
                residuals.push(walk + far + step(&mut random, 0.5));
            }
        }
        let blocks = Blocks::new(&labels);
        let noise = Noise::of(&residuals, &blocks);
        assert!((noise.label_px - 0.5).abs() < 0.06, "{noise:?}");
        assert!((noise.wander_px - 0.8).abs() < 0.25, "{noise:?}");
        let weights = noise.weights(&residuals, &blocks);
        let mean = |which: bool| {
            let some: Vec<f64> =
                weights.iter().zip(&outliers).filter(|(_, o)| **o == which).map(|(w, _)| *w).collect();
            some.iter().sum::<f64>() / some.len() as f64
        };
        assert!(mean(true) < 0.15 && mean(false) > 0.95, "{} {}", mean(true), mean(false));
    }
}
