//! The lag that fits best, from a lag near to it: least squares of turn rates with outliers counted less.

use nalgebra::{Matrix2, Matrix3, UnitQuaternion, Vector2, Vector3};

use super::super::turning::Turning;
use super::coarse::FEWEST;
use super::pieces::Pieces;
use crate::metrics::align::best_rotation;
use crate::metrics::student::quantile_975;
use crate::statistics::median;

/// Steps at most.
const STEPS: usize = 30;
/// A step of the lag is at most this, seconds.
const LARGEST_STEP_S: f64 = 0.1;
/// Residuals count in full up to so many standard deviations, and not at all from so many on.
const FULL: f64 = 3.0;
const NONE: f64 = 8.0;
/// Blocks are this long, seconds: longer than turn rates remember.
const BLOCK_S: f64 = 5.0;
const BLOCKS: (f64, f64) = (5.0, 24.0);

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum What {
    /// Turn rates as vectors, with the constant rotation between both bodies: tells more.
    Vectors,
    /// Their magnitudes: where no rotation makes the vectors alike.
    Magnitudes,
}

/// A fitted lag.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// Lag in the middle of the stretches, seconds that are added to the sparse one's times.
    pub(super) lag_s: f64,
    /// By how much the other's clock is faster, a share.
    pub(super) rate: f64,
    /// Half of the 95 % intervals, by blocks; infinite for fewer than three.
    pub(super) lag_half_s: f64,
    pub(super) rate_half: f64,
    /// Correlation of what was compared, without the means.
    pub(super) correlation: f64,
    /// Stretches compared.
    pub(super) count: usize,
    /// Takes the other's body to the sparse one's.
    pub(super) sparse_from_other: UnitQuaternion<f64>,
    /// Middle of a block in seconds since the sparse one's origin, its own lag, and its standard deviation.
    pub(super) blocks: Vec<(f64, f64, f64)>,
    /// RMS of the sparse one's rates about their mean, rad/s.
    pub(super) motion_rad_s: f64,
}

/// Normal equations of one stretch.
struct Row {
    at_s: f64,
    slope: f64,
    pull: f64,
}

/// Fits from a lag, and from a rate that stays unless `free_rate`.
pub(super) fn fit(
    pieces: &Pieces,
    other: &Turning,
    what: What,
    start: (f64, f64),
    free_rate: bool,
) -> Option<Fit> {
    let (mut lag, mut rate) = start;
    let middle_s = pieces.middle_s();
    let h = (0.5 * other.spacing_s()).max(0.002);
    let mut weights = vec![1.0; pieces.len()];
    for step in 0..STEPS {
        let moment = |t: f64, lag: f64| t + lag + rate * (t - middle_s);
        let here = pieces.seen_by(other, |t| moment(t, lag));
        let later = pieces.seen_by(other, |t| moment(t, lag + h));
        let earlier = pieces.seen_by(other, |t| moment(t, lag - h));
        let used: Vec<usize> = (0..pieces.len())
            .filter(|i| here[*i].is_some() && later[*i].is_some() && earlier[*i].is_some())
            .collect();
        if used.len() < FEWEST {
            return None;
        }
        let vector = |v: &Vector3<f64>| match what {
            What::Vectors => *v,
            What::Magnitudes => Vector3::new(v.norm(), 0.0, 0.0),
        };
        let of =
            |list: &[Option<Vector3<f64>>], i: usize| list[i].as_ref().map_or_else(Vector3::zeros, vector);
        let total: f64 = used.iter().map(|i| weights[*i]).sum();
        let mean = |f: &dyn Fn(usize) -> Vector3<f64>| -> Vector3<f64> {
            used.iter().map(|i| weights[*i] * f(*i)).sum::<Vector3<f64>>() / total
        };
        let own = |i: usize| vector(&pieces.rates[i]);
        let slope = |i: usize| (of(&later, i) - of(&earlier, i)) / (2.0 * h);
        let (own_mean, here_mean, slope_mean) = (mean(&own), mean(&|i| of(&here, i)), mean(&slope));
        let turn = match what {
            What::Magnitudes => UnitQuaternion::identity(),
            What::Vectors => {
                let correlation: Matrix3<f64> = used
                    .iter()
                    .map(|i| weights[*i] * (of(&here, *i) - here_mean) * (own(*i) - own_mean).transpose())
                    .sum();
                best_rotation(&correlation).rotation
            }
        };
        let mut rows = Vec::with_capacity(used.len());
        let mut sizes = Vec::with_capacity(used.len());
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
        for i in &used {
            let a = own(*i) - own_mean;
            let b = turn * (of(&here, *i) - here_mean);
            let d = turn * (slope(*i) - slope_mean);
            let (residual, w) = (a - b, weights[*i]);
            sizes.push(residual.norm());
            rows.push(Row {
                at_s: 0.5 * (pieces.ends[*i].0 + pieces.ends[*i].1),
                slope: w * d.dot(&d),
                pull: w * d.dot(&residual),
            });
            aa += w * a.dot(&a);
            bb += w * b.dot(&b);
            ab += w * a.dot(&b);
        }
        let by = solve(&rows, middle_s, free_rate)?;
        let moved = by.step[0].clamp(-LARGEST_STEP_S, LARGEST_STEP_S);
        let done = step > 4 && by.step[0].abs() < 1e-6 && (by.step[1] * pieces.seconds()).abs() < 1e-6;
        if done || step + 1 == STEPS {
            if !done && by.step[0].abs() > 1e-4 {
                return None;
            }
            return Some(Fit {
                lag_s: lag,
                rate,
                lag_half_s: by.half[0],
                rate_half: by.half[1],
                correlation: if aa * bb > 0.0 { ab / (aa * bb).sqrt() } else { 0.0 },
                count: used.len(),
                sparse_from_other: turn,
                blocks: by
                    .blocks
                    .iter()
                    .map(|(t, by, sd)| (*t, lag + rate * (t - middle_s) + by, *sd))
                    .collect(),
                motion_rad_s: (aa / total).sqrt(),
            });
        }
        lag += moved;
        rate += by.step[1];
        let usual = if what == What::Vectors { 1.54 } else { 0.6745 };
        let sd = median(&mut sizes.clone())? / usual + 1e-12;
        for (i, size) in used.iter().zip(&sizes) {
            weights[*i] = weight(size / sd);
        }
    }
    None
}

/// Huber's weight that goes to zero.
fn weight(deviations: f64) -> f64 {
    if deviations <= FULL { 1.0 } else { FULL / deviations * ((NONE - deviations) / (NONE - FULL)).max(0.0) }
}

struct Step {
    step: [f64; 2],
    half: [f64; 2],
    /// Middle, own step and standard deviation of each block.
    blocks: Vec<(f64, f64, f64)>,
}

/// The step of lag and rate, and intervals from how much blocks of time pull one way or the other: samples of one block
/// need not be independent.
fn solve(rows: &[Row], middle_s: f64, free_rate: bool) -> Option<Step> {
    let (first, last) = (rows.first()?.at_s, rows.last()?.at_s);
    let count = ((last - first) / BLOCK_S).floor().clamp(BLOCKS.0, BLOCKS.1);
    let block = |t: f64| ((t - first) / (last - first).max(1e-9) * count).min(count - 1.0) as usize;
    let lever = |t: f64| Vector2::new(1.0, if free_rate { t - middle_s } else { 0.0 });
    let mut normal = Matrix2::zeros();
    let mut pull = Vector2::zeros();
    let mut pulls = vec![Vector2::zeros(); count as usize];
    let mut own = vec![(0.0, 0.0); count as usize];
    for row in rows {
        let l = lever(row.at_s);
        normal += row.slope * l * l.transpose();
        pull += row.pull * l;
        pulls[block(row.at_s)] += row.pull * l;
        own[block(row.at_s)].0 += row.slope;
        own[block(row.at_s)].1 += row.pull;
    }
    if !free_rate {
        normal[(1, 1)] = 1.0;
    }
    let inverse = normal.try_inverse().filter(|m| m.iter().all(|v| v.is_finite()))?;
    let step = inverse * pull;
    // What each block pulls once the step is made.
    let mut spread = Matrix2::zeros();
    let mut filled = 0.0_f64;
    for (k, p) in pulls.iter().enumerate() {
        if own[k].0 > 0.0 {
            filled += 1.0;
        }
        spread += p * p.transpose();
    }
    let free = filled - if free_rate { 2.0 } else { 1.0 };
    let t = quantile_975(free).filter(|_| free >= 2.0).unwrap_or(f64::INFINITY);
    let covariance = inverse * spread * inverse * (filled / free.max(1.0));
    let half = |i: usize| t * covariance[(i, i)].max(0.0).sqrt();
    let strong = own.iter().map(|o| o.0).sum::<f64>() / count;
    let blocks = (0..own.len())
        .filter(|k| own[*k].0 > 0.1 * strong)
        .map(|k| {
            let at = first + (k as f64 + 0.5) * (last - first) / count;
            let (slope, pull) = own[k];
            // The noise that all rows together show, for this block's share of the slopes.
            let sd = (covariance[(0, 0)].max(0.0) * normal[(0, 0)] / slope).sqrt();
            (at, pull / slope, sd)
        })
        .collect();
    Some(Step { step: [step[0], step[1]], half: [half(0), if free_rate { half(1) } else { 0.0 }], blocks })
}
