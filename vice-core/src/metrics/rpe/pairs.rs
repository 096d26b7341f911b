//! Which two poses are a `delta` apart.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::parallel::*;
use nalgebra::UnitQuaternion;

use super::turns::{Band, Turns, angle_between};
use super::{ALL_PAIRS_TOLERANCE, Delta, DeltaUnit, MAX_PAIRS, PairMode, PairsFrom, RpeOptions};
use crate::error::{DataError, DataResult};
use crate::frames::WorldFromBody;
use crate::metrics::associate::PosePairs;
use crate::time::{Span, Stamp};

/// Indices of two poses, the earlier one first.
type Pairs = Vec<(usize, usize)>;

impl PairsFrom {
    /// The poses that tell how far two of them are apart.
    pub(super) fn of(self, pairs: &PosePairs) -> &[WorldFromBody] {
        match self {
            Self::Estimate => pairs.estimate(),
            Self::Reference => pairs.reference(),
        }
    }
}

/// The pairs of poses to compare, possibly none.
pub(super) fn choose(pairs: &PosePairs, options: &RpeOptions) -> DataResult<Pairs> {
    let poses = options.pairs_from.of(pairs);
    let Delta { value, unit } = options.delta;
    Ok(match (unit, options.mode) {
        (DeltaUnit::Frames, mode) => by_frames(poses.len(), value, mode),
        (DeltaUnit::Seconds, mode) => by_seconds(pairs.stamps(), options.delta.span(), mode),
        (DeltaUnit::Meters, PairMode::Consecutive) => accumulated(&steps_m(poses), value),
        (DeltaUnit::Meters, PairMode::All) => all_by_path(&steps_m(poses), value),
        (DeltaUnit::Degrees, PairMode::Consecutive) => {
            let step = |w: &[WorldFromBody]| angle_between(&w[0].rotation(), &w[1].rotation());
            accumulated(&poses.windows(2).map(step).collect::<Vec<_>>(), value.to_radians())
        }
        (DeltaUnit::Degrees, PairMode::All) => {
            let rotations: Vec<_> = poses.iter().map(WorldFromBody::rotation).collect();
            all_by_angle(&rotations, value, MAX_PAIRS)?
        }
    })
}

fn by_frames(n: usize, delta: f64, mode: PairMode) -> Pairs {
    // Whole and above zero; beyond the range of usize the cast saturates, and there is no pair.
    let delta = delta as usize;
    let starts = match mode {
        PairMode::Consecutive => delta,
        PairMode::All => 1,
    };
    (0..n.saturating_sub(delta)).step_by(starts).map(|i| (i, i + delta)).collect()
}

fn by_seconds(stamps: &[Stamp], delta: Span, mode: PairMode) -> Pairs {
    let Some(&[before_last, last]) = stamps.last_chunk::<2>() else { return Vec::new() };
    // The last pose stands for the half step after it too: the jitter of a clock must not cost the last pairs.
    let end = last + Span::from_nanos((last - before_last).as_nanos() / 2);
    let partner = |i: usize| {
        let target = stamps[i].checked_add(delta).filter(|t| *t <= end)?;
        let after = (i + 1 + stamps[i + 1..].partition_point(|s| *s < target)).min(stamps.len() - 1);
        let before = after - 1;
        let nearest =
            if (stamps[after] - target).abs() < (target - stamps[before]).abs() { after } else { before };
        (nearest > i).then_some(nearest)
    };
    let mut pairs = Vec::new();
    let mut i = 0;
    while i + 1 < stamps.len() {
        let found = partner(i);
        pairs.extend(found.map(|j| (i, j)));
        i = match (mode, found) {
            (PairMode::Consecutive, Some(j)) => j,
            _ => i + 1,
        };
    }
    pairs
}

/// Lengths of the steps between poses, metres.
fn steps_m(poses: &[WorldFromBody]) -> Vec<f64> {
    poses.windows(2).map(|w| (w[1].translation() - w[0].translation()).norm()).collect()
}

/// Pairs that end where the steps, added up since the pair's start, reach `delta`.
fn accumulated(steps: &[f64], delta: f64) -> Pairs {
    let mut pairs = Vec::new();
    let (mut start, mut sum) = (0, 0.0);
    for (i, step) in steps.iter().enumerate() {
        sum += step;
        if sum >= delta {
            pairs.push((start, i + 1));
            (start, sum) = (i + 1, 0.0);
        }
    }
    pairs
}

/// For each pose the first later one whose path from it is nearest to `delta`, within the tolerance.
fn all_by_path(steps: &[f64], delta: f64) -> Pairs {
    let mut path = vec![0.0];
    path.extend(steps.iter().scan(0.0, |sum, step| {
        *sum += step;
        Some(*sum)
    }));
    let tolerance = delta * ALL_PAIRS_TOLERANCE;
    let off = |i: usize, j: usize| (path[j] - path[i] - delta).abs();
    (0..steps.len())
        .filter_map(|i| {
            // The path never gets shorter, so the nearest is on either side of where it reaches delta.
            let first_from = |length: f64| i + 1 + path[i + 1..].partition_point(|p| p - path[i] < length);
            let reaches = first_from(delta);
            let mut best = reaches;
            if reaches > i + 1 && (reaches == path.len() || off(i, reaches - 1) <= off(i, reaches)) {
                // Where the agent stood still, the first of the poses at this place.
                best = first_from(path[reaches - 1] - path[i]);
            }
            (best < path.len() && off(i, best) <= tolerance).then_some((i, best))
        })
        .collect()
}

/// Every two poses whose orientations are `degrees` apart, within the tolerance; at most `limit`.
///
/// Shared among threads row by row. The result does not depend on their number.
pub(super) fn all_by_angle(
    rotations: &[UnitQuaternion<f64>],
    degrees: f64,
    limit: usize,
) -> DataResult<Pairs> {
    let (delta, tolerance) = (degrees.to_radians(), (degrees * ALL_PAIRS_TOLERANCE).to_radians());
    let turns = Turns::new(rotations, Band::new(delta - tolerance, delta + tolerance));
    let found = AtomicUsize::new(0);
    let rows: Option<Vec<Vec<usize>>> = (0..rotations.len())
        .into_par_iter()
        .map(|i| {
            let row = turns.after(i);
            (found.fetch_add(row.len(), Ordering::Relaxed) + row.len() <= limit).then_some(row)
        })
        .collect();
    let rows = rows.ok_or_else(|| {
        DataError::new(format!(
            "more than {limit} pairs of {} poses are {degrees} degrees apart within {} %",
            rotations.len(),
            ALL_PAIRS_TOLERANCE * 100.0
        ))
        .hint("take consecutive pairs, a shorter part of the trajectory, or a sparser one")
    })?;
    Ok(rows.into_iter().enumerate().flat_map(|(i, row)| row.into_iter().map(move |j| (i, j))).collect())
}
