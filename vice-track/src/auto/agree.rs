//! Paths against each other: cut where they stop to move as the scene does.
//!
//! At each check the paths are held against the frames of a fifth of a second, four fifths and some two seconds before:
//! a slip shows over a short time, a drift over a long one.

use rayon::prelude::*;
use vice_core::camera::Camera;
use vice_core::statistics::median;

use super::Timeline;
use super::path::{End, Path};
use crate::two_view::{Agreement, MIN_POINTS, Pair, Sight, agreement};

/// Checks between the two frames that are held against each other.
const LAGS: [usize; 3] = [1, 4, 10];

/// A path at a check, held against itself some checks before.
#[derive(Clone, Copy, Debug)]
struct Held {
    path: usize,
    /// Index of the check, and of the one before.
    check: usize,
    before: usize,
    /// How far off it is, and how far it may be, pixels.
    off_px: f64,
    limit_px: f64,
}

/// What all paths together say.
pub(super) struct Checked {
    /// By path, then by check.
    held: Vec<Held>,
    pub(super) pairs: usize,
    pub(super) unchecked: usize,
    shares: Vec<f64>,
}

/// A part of a path that can be labels: it begins and ends where it was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) path: usize,
    pub(super) from: usize,
    pub(super) to: usize,
    /// How far off the others' motion it was at worst, in parts of what is allowed; NaN where too few were there.
    pub(super) off: f64,
}

impl Checked {
    /// The median share of points that follow one motion, and the least.
    pub(super) fn agreement(&self) -> Option<[f64; 2]> {
        let least = self.shares.iter().copied().min_by(f64::total_cmp)?;
        Some([median(&mut self.shares.clone())?, least])
    }
}

/// Holds paths against each other in pairs of frames.
pub(super) fn check(paths: &[Path], camera: &Camera, timeline: &Timeline) -> Checked {
    let checks = timeline.checks();
    // Who is where at each check.
    let sights: Vec<Vec<(usize, Sight)>> = checks
        .par_iter()
        .map(|position| {
            let at = |(i, path): (usize, &Path)| Some((i, Sight::new(camera, path.at(*position)?.px)?));
            paths.iter().enumerate().filter_map(at).collect()
        })
        .collect();
    let pairs: Vec<(usize, usize)> = (0..checks.len())
        .flat_map(|check| LAGS.iter().filter_map(move |lag| Some((check.checked_sub(*lag)?, check))))
        .collect();
    let judged: Vec<(Vec<usize>, Option<Agreement>)> = pairs
        .par_iter()
        .map(|(before, check)| {
            let (indices, common) = common(&sights[*before], &sights[*check]);
            let seed = (*before as u64) << 32 | *check as u64;
            (indices, agreement(&common, seed))
        })
        .collect();
    let mut checked = Checked { held: Vec::new(), pairs: pairs.len(), unchecked: 0, shares: Vec::new() };
    for ((before, check), (indices, found)) in pairs.into_iter().zip(judged) {
        let Some(found) = found else {
            // Over a long time few points stay in view, and no more is to be said than over shorter ones.
            checked.unchecked += usize::from(check - before == LAGS[0] || indices.len() >= MIN_POINTS);
            continue;
        };
        checked.shares.push(found.share());
        let limit_px = found.limit_px;
        let held = |(path, off_px)| Held { path, check, before, off_px, limit_px };
        checked.held.extend(indices.into_iter().zip(found.off_px).map(held));
    }
    checked.held.sort_by_key(|h| (h.path, h.check, h.before));
    checked
}

/// Paths that are in both frames, in order, with where they are.
fn common(before: &[(usize, Sight)], now: &[(usize, Sight)]) -> (Vec<usize>, Vec<Pair>) {
    let mut rest = before.iter().peekable();
    let mut found = (Vec::new(), Vec::new());
    for (index, to) in now {
        while rest.next_if(|(other, _)| other < index).is_some() {}
        if let Some((_, from)) = rest.next_if(|(other, _)| other == index) {
            found.0.push(*index);
            found.1.push(Pair { from: *from, to: *to });
        }
    }
    found
}

/// The parts of each path between the checks where it did not follow. `cuts` counts these.
pub(super) fn pieces(paths: &[Path], checked: &Checked, timeline: &Timeline, cuts: &mut usize) -> Vec<Piece> {
    let checks = timeline.checks();
    let mut pieces = Vec::new();
    let mut held = checked.held.as_slice();
    for (index, path) in paths.iter().enumerate() {
        let own;
        (own, held) = held.split_at(held.partition_point(|h| h.path == index));
        let (mut from, mut off) = (path.start, f64::NAN);
        let mut rest = own;
        while let Some(check) = rest.first().map(|h| h.check) {
            let here;
            (here, rest) = rest.split_at(rest.partition_point(|h| h.check == check));
            // What happened before the piece began is no concern of it.
            let worst = here
                .iter()
                .filter(|h| checks[h.before] >= from)
                .map(|h| h.off_px / h.limit_px)
                .fold(f64::NAN, f64::max);
            if worst > 1.0 {
                *cuts += 1;
                let before = checks[check - 1];
                pieces.extend(piece(index, path, from, before, off));
                (from, off) = (checks[check], f64::NAN);
            } else {
                off = off.max(worst);
            }
        }
        pieces.extend(piece(index, path, from, trusted_end(path, checks), off));
    }
    pieces
}

/// Where a point is lost, the way there is doubtful since the last check.
fn trusted_end(path: &Path, checks: &[usize]) -> usize {
    let last = path.last();
    match path.end {
        End::Lost | End::Doubtful => {
            let before = checks.partition_point(|c| *c <= last);
            before.checked_sub(1).map_or(path.start, |i| checks[i].max(path.start))
        }
        End::Open | End::Left | End::NoWayBack => last,
    }
}

/// A piece that begins and ends where the point was seen, if it is more than one place.
fn piece(index: usize, path: &Path, from: usize, to: usize, off: f64) -> Option<Piece> {
    let mut seen = (from..=to).filter(|p| path.at(*p).is_some());
    let first = seen.next()?;
    Some(Piece { path: index, from: first, to: seen.next_back()?, off })
}

/// Paths that nobody held against others, whole.
pub(super) fn whole(paths: &[Path], first_index: usize) -> Vec<Piece> {
    let of = |(i, path): (usize, &Path)| piece(first_index + i, path, path.start, path.last(), f64::NAN);
    paths.iter().enumerate().filter_map(of).collect()
}
