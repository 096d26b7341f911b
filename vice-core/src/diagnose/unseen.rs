//! How well a fit explains labels that it has not seen: the ground on which flaws are compared.
//!
//! Each block of time is left out in turn, the fit is taken to where it would be without that block (one step of the
//! quadratic piece), and its loss there is measured. A flaw that is not there bends itself to the wander of the blocks
//! it sees and fails on the one it does not; so more parameters are no advantage of their own.

use nalgebra::DVector;

use super::blocks::Blocks;
use super::problem::Residual;
use super::solve::{Fit, Normal, huber_loss};
use crate::random::SplitMix;

/// Losses and squared errors of each block, by the fit without it.
#[derive(Clone, Debug)]
pub(super) struct Unseen {
    /// Huber's loss, px².
    pub(super) losses: Vec<f64>,
}

impl Unseen {
    /// `sigma_px` is the same for all fits that are compared: it says which errors count linearly.
    pub(super) fn new(fit: &Fit, blocks: &Blocks, sigma_px: f64) -> Self {
        let pieces: Vec<Normal> = blocks.by_time.iter().map(|labels| fit.normal(labels)).collect();
        let mut all = Normal::zeros(fit.parameters.len());
        pieces.iter().for_each(|piece| all.add(piece, 1.0));
        let ridge = fit.ridge();
        let losses = blocks.by_time.iter().zip(&pieces).map(|(labels, piece)| {
            let mut others = all.clone();
            others.add(piece, -1.0);
            let step = others.solve(&ridge, 0.0).unwrap_or_else(|| DVector::zeros(fit.parameters.len()));
            let loss = |label: &usize| {
                let moved: Residual = fit.residuals[*label] + fit.rows(*label) * &step;
                huber_loss(moved.norm(), sigma_px)
            };
            labels.iter().map(loss).sum()
        });
        Self { losses: losses.collect() }
    }

    pub(super) fn total(&self) -> f64 {
        self.losses.iter().sum()
    }

    /// Share of the loss of `other` that this fit takes away, negative where it adds to it.
    pub(super) fn explains_of(&self, other: &Self) -> f64 {
        1.0 - self.total() / other.total().max(f64::MIN_POSITIVE)
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
        let better = (0..resamples).filter(|_| {
            (0..count).map(|_| gains[random.below(count as u64) as usize]).sum::<f64>() > 0.0
        });
        let share = better.count() as f64 / resamples as f64;
        share.min(1.0 - 0.5_f64.powi(count as i32))
    }
}
