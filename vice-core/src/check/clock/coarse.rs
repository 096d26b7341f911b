//! Where the magnitudes of two turn rates look alike: magnitudes are the same in every frame.

use nalgebra::Vector3;

use super::super::turning::Turning;
use super::pieces::Pieces;
use crate::parallel::*;
use crate::statistics::{quantile, sorted};

/// Stretches that are compared at each lag, at most.
const MOST: usize = 3000;
/// Fewer say nothing.
pub(super) const FEWEST: usize = 20;
/// A lag counts where this share of the stretches that any lag has is compared.
const SHARE: f64 = 0.5;
/// Rates beyond this many times the 95 % quantile are a glitch, such as a flipped marker, and count as that much.
const CLIP: f64 = 2.0;
/// How many peaks are looked at.
const PEAKS: usize = 4;

/// Correlations over lags.
pub(super) struct Lags {
    pub(super) step_s: f64,
    /// From the least lag on; `None` where too little overlaps.
    pub(super) correlations: Vec<Option<f64>>,
    pub(super) first_s: f64,
}

/// Correlations for lags from `-range_s` to `range_s`, about a lag of `middle_s` seconds added to the sparse one's times.
pub(super) fn correlate(pieces: &Pieces, other: &Turning, middle_s: f64, range_s: f64) -> Lags {
    let few = pieces.every(pieces.len().div_ceil(MOST).max(1));
    let own = clipped(few.rates.iter().map(Vector3::norm).collect());
    let step_s = 0.04_f64.min(range_s / 10.0);
    let half = (range_s / step_s).round() as i64;
    let lags: Vec<f64> = (-half..=half).map(|i| i as f64 * step_s).collect();
    let found: Vec<Option<(f64, usize)>> =
        lags.par_iter().map(|lag| magnitudes(&own, &few.seen_by(other, |t| t + middle_s + lag))).collect();
    let most = found.iter().flatten().map(|(_, n)| *n).max().unwrap_or(0);
    let enough = |n: usize| n >= FEWEST && n as f64 >= SHARE * most as f64;
    let correlations = found.into_iter().map(|f| f.filter(|(_, n)| enough(*n)).map(|(c, _)| c)).collect();
    Lags { step_s, correlations, first_s: -half as f64 * step_s }
}

/// The correlation of the magnitudes at one place, as [`correlate`] has it.
pub(super) fn at(pieces: &Pieces, other: &Turning, moment: impl Fn(f64) -> f64) -> Option<f64> {
    let own = clipped(pieces.rates.iter().map(Vector3::norm).collect());
    Some(magnitudes(&own, &pieces.seen_by(other, moment))?.0)
}

impl Lags {
    /// The best peaks: lag and correlation, the best first.
    pub(super) fn peaks(&self) -> Vec<(f64, f64)> {
        let value = |i: usize| self.correlations[i].unwrap_or(f64::NEG_INFINITY);
        let last = self.correlations.len() - 1;
        let mut peaks: Vec<(f64, f64)> = (0..=last)
            .filter(|i| self.correlations[*i].is_some())
            .filter(|i| (*i == 0 || value(i - 1) < value(*i)) && (*i == last || value(i + 1) <= value(*i)))
            .map(|i| (self.first_s + i as f64 * self.step_s, value(i)))
            .collect();
        peaks.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.abs().total_cmp(&b.0.abs())));
        peaks.truncate(PEAKS);
        peaks
    }

    /// The best lag and correlation outside the hill that `around_s` stands on.
    pub(super) fn best_elsewhere(&self, around_s: f64) -> Option<(f64, f64)> {
        let value = |i: usize| self.correlations[i].unwrap_or(f64::NEG_INFINITY);
        let last = self.correlations.len() - 1;
        let mut top = ((around_s - self.first_s) / self.step_s).round().clamp(0.0, last as f64) as usize;
        // The nearest sample need not be the top.
        while top > 0 && value(top - 1) > value(top) {
            top -= 1;
        }
        while top < last && value(top + 1) > value(top) {
            top += 1;
        }
        let (mut low, mut high) = (top, top);
        while low > 0 && value(low - 1) < value(low) {
            low -= 1;
        }
        while high < last && value(high + 1) < value(high) {
            high += 1;
        }
        let outside = (0..low).chain(high + 1..=last).filter_map(|i| Some((i, self.correlations[i]?)));
        let best = outside.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((self.first_s + best.0 as f64 * self.step_s, best.1))
    }
}

/// Magnitudes of which none is a glitch.
fn clipped(magnitudes: Vec<f64>) -> Vec<f64> {
    let limit = quantile(&sorted(magnitudes.clone()), 0.95).map_or(f64::INFINITY, |q| CLIP * q);
    magnitudes.into_iter().map(|m| m.min(limit)).collect()
}

/// Pearson's correlation of magnitudes, and of how many.
fn magnitudes(own: &[f64], seen: &[Option<Vector3<f64>>]) -> Option<(f64, usize)> {
    let (mine, theirs): (Vec<f64>, Vec<f64>) =
        own.iter().zip(seen).filter_map(|(a, b)| Some((*a, b.as_ref()?.norm()))).unzip();
    let theirs = clipped(theirs);
    let n = mine.len();
    if n < FEWEST {
        return None;
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n as f64;
    let (a, b) = (mean(&mine), mean(&theirs));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (x, y) in mine.iter().zip(&theirs) {
        aa += (x - a) * (x - a);
        bb += (y - b) * (y - b);
        ab += (x - a) * (y - b);
    }
    let size = (aa * bb).sqrt();
    (size > 0.0).then(|| (ab / size, n))
}
