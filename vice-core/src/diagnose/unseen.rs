//! How well a fit explains labels that it has not seen: the ground on which flaws are compared.
//!
//! Each block of time is left out in turn, the fit is taken to where it would be without that block (one step of the
//! quadratic piece), and its loss there is measured. A flaw that is not there bends itself to the wander of the blocks
//! it sees and fails on the one it does not; so more parameters are no advantage of their own.

use nalgebra::{DMatrix, DVector};

use super::blocks::{Blocks, Cell};
use super::noise::{Noise, Whitener, coordinate};
use super::solve::{Fit, Normal};
use crate::random::SplitMix;

/// Errors longer than this many deviations count linearly.
const HUBER: f64 = 3.0;

/// What unseen errors are measured with: the noise that the best fit leaves.
pub(super) struct Ruler {
    whiteners: Vec<Option<Whitener>>,
}

impl Ruler {
    pub(super) fn new(noise: &Noise, blocks: &Blocks) -> Self {
        Self { whiteners: blocks.cells.iter().map(|cell| noise.whitener(cell, |_| 1.0)).collect() }
    }
}

/// Loss of one cell, the fit moved by a step.
fn loss(fit: &Fit, cell: &Cell, step: &DVector<f64>, whitener: Option<&Whitener>) -> f64 {
    let Some(whitener) = whitener else { return 0.0 };
    let moved = [0, 1].map(|axis| {
        let columns = fit.columns(cell, axis);
        coordinate(&fit.residuals, cell, axis) + columns * step
    });
    let both = whitener.apply(DMatrix::from_columns(&moved));
    let pull = huber_loss(fit.pull(cell, step).abs());
    both.row_iter().map(|row| huber_loss(row.norm())).sum::<f64>() + pull
}

/// Half the squared length up to [`HUBER`], linear beyond.
fn huber_loss(deviations: f64) -> f64 {
    if deviations <= HUBER { 0.5 * deviations * deviations } else { HUBER * (deviations - 0.5 * HUBER) }
}

/// Losses of each block, by the fit without it.
#[derive(Clone, Debug)]
pub(super) struct Unseen {
    /// Huber's loss of the independent parts of the errors, in their deviations.
    pub(super) losses: Vec<f64>,
}

impl Unseen {
    /// `ruler` is the same for all fits that are compared.
    pub(super) fn new(fit: &Fit, blocks: &Blocks, ruler: &Ruler) -> Self {
        let count = fit.parameters.len();
        let mut by_block = vec![Normal::zeros(count); blocks.len()];
        let mut all = Normal::zeros(count);
        for (cell, piece) in blocks.cells.iter().zip(&fit.pieces) {
            by_block[cell.block].add(piece, 1.0);
            all.add(piece, 1.0);
        }
        let ridge = fit.ridge();
        let steps: Vec<DVector<f64>> = by_block
            .iter()
            .map(|piece| {
                let mut others = all.clone();
                others.add(piece, -1.0);
                others.solve(&ridge, 0.0).unwrap_or_else(|| DVector::zeros(count))
            })
            .collect();
        let mut losses = vec![0.0; blocks.len()];
        for (cell, whitener) in blocks.cells.iter().zip(&ruler.whiteners) {
            losses[cell.block] += loss(fit, cell, &steps[cell.block], whitener.as_ref());
        }
        Self { losses }
    }

    pub(super) fn total(&self) -> f64 {
        self.losses.iter().sum()
    }

    /// How sure it is that this fit is better than `other`: the share of resampled blocks of time in which its loss is
    /// smaller. With few blocks even unanimity may be luck, so that it stays below `1 - 2^-blocks`.
    pub(super) fn sureness_over(&self, other: &Self, resamples: usize, seed: u64) -> f64 {
        let gains: Vec<f64> = other.losses.iter().zip(&self.losses).map(|(o, s)| o - s).collect();
        let count = gains.len();
        if count == 0 || resamples == 0 {
            return 0.0;
        }
        let mut random = SplitMix(seed);
        let better = (0..resamples)
            .filter(|_| (0..count).map(|_| gains[random.below(count as u64) as usize]).sum::<f64>() > 0.0);
        let share = better.count() as f64 / resamples as f64;
        share.min(1.0 - 0.5_f64.powi(count as i32))
    }
}
