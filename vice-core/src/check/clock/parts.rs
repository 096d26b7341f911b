//! Clocks whose offset changes so much that no one lag fits all: a wrong frame rate, or a step in the stamps.
//!
//! Each part of some seconds gets a lag of its own. Where the lags of most parts lie on a line, its slope is a rate to start
//! the whole fit from; where they have two values, one after the other, the clock was set in between.

use super::super::turning::Turning;
use super::coarse::correlate;
use super::fit::{What, fit};
use super::pieces::Pieces;
use crate::statistics::{median, quantile, sorted};

/// Length of a part, seconds: short enough that a wrong frame rate does not smear it.
const PART_S: f64 = 5.0;
/// Parts that are looked at, at most.
const MOST: usize = 60;
/// Fewer parts say nothing.
const FEWEST: usize = 4;
/// A part's lag counts from this correlation on.
const CORRELATION: f64 = 0.8;
/// Lags of parts agree within this, seconds.
const AGREE_S: f64 = 0.03;
/// So many parts must agree, a share of those that have a lag.
const SHARE: f64 = 0.7;
/// A smaller step is none, seconds.
const STEP_S: f64 = 0.03;
/// Steps between neighbouring lags that a rate may make, a share: no clock is further off than a wrong frame rate.
const FASTEST: f64 = 0.15;

/// How the lag changes over the recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Change {
    /// Lag at the middle of all stretches, and what it grows by a second.
    Rate(f64, f64),
    /// When (seconds since the sparse one's origin), and the lag before and after.
    Step(f64, f64, f64),
}

/// How the lag changes, where parts tell.
pub(super) fn change(pieces: &Pieces, other: &Turning, apart_s: f64, range_s: f64) -> Option<Change> {
    let lags = lags(pieces, other, apart_s, range_s);
    if lags.len() < FEWEST {
        return None;
    }
    step(&lags).or_else(|| line(&lags, pieces))
}

/// Middle and lag of each part that has one.
fn lags(pieces: &Pieces, other: &Turning, apart_s: f64, range_s: f64) -> Vec<(f64, f64)> {
    let (Some(first), length) = (pieces.ends.first().map(|e| e.0), pieces.seconds()) else {
        return Vec::new();
    };
    let count = (length / PART_S).floor().max(1.0);
    let every = (count / MOST as f64).ceil().max(1.0) as usize;
    (0..count as usize)
        .step_by(every)
        .filter_map(|k| {
            let from = first + k as f64 * PART_S;
            let part = pieces.between(from, from + PART_S);
            let peaks = correlate(&part, other, apart_s, range_s).peaks();
            let best = peaks
                .iter()
                .filter_map(|(lag, _)| fit(&part, other, What::Vectors, (apart_s + lag, 0.0), false))
                .max_by(|a, b| a.correlation.total_cmp(&b.correlation))?;
            (best.correlation > CORRELATION).then_some((from + 0.5 * PART_S, best.lag_s))
        })
        .collect()
}

/// Two lags, one after the other.
fn step(lags: &[(f64, f64)]) -> Option<Change> {
    let middle = |part: &[(f64, f64)]| median(&mut part.iter().map(|l| l.1).collect::<Vec<_>>());
    let near =
        |part: &[(f64, f64)], lag: f64| part.iter().filter(|l| (l.1 - lag).abs() < AGREE_S / 2.0).count();
    let best = (2..=lags.len() - 2)
        .filter_map(|k| {
            let (before, after) = (middle(&lags[..k])?, middle(&lags[k..])?);
            let agree = near(&lags[..k], before) + near(&lags[k..], after);
            let enough = near(&lags[..k], before) >= 2 && near(&lags[k..], after) >= 2;
            let at = f64::midpoint(lags[k - 1].0, lags[k].0);
            (enough && (after - before).abs() > STEP_S).then_some((agree, at, before, after))
        })
        .max_by_key(|found| found.0)?;
    (best.0 as f64 >= (SHARE * lags.len() as f64).max(lags.len() as f64 - 1.5 - 0.1 * lags.len() as f64))
        .then_some(Change::Step(best.1, best.2, best.3))
}

/// A line through the lags (Theil and Sen).
fn line(lags: &[(f64, f64)], pieces: &Pieces) -> Option<Change> {
    let mut slopes = Vec::new();
    for (i, a) in lags.iter().enumerate() {
        slopes.extend(lags[i + 1..].iter().map(|b| (b.1 - a.1) / (b.0 - a.0)).filter(|s| s.abs() < FASTEST));
    }
    let slope = quantile(&sorted(slopes), 0.5)?;
    let middle = pieces.middle_s();
    let at = median(&mut lags.iter().map(|l| l.1 - slope * (l.0 - middle)).collect::<Vec<_>>())?;
    let agree = lags.iter().filter(|l| (l.1 - at - slope * (l.0 - middle)).abs() < AGREE_S).count();
    (agree as f64 >= SHARE * lags.len() as f64 && agree >= FEWEST).then_some(Change::Rate(at, slope))
}
