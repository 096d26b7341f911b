//! From pieces of paths to points with segments.
//!
//! A point of the labels is a lane in time. Where it is free, at a check, it takes the piece that stays in view long and
//! lies far, in the image and in depth, from where the other lanes are; a key frame starts it. When the piece ends the
//! lane is free again.

use std::collections::BTreeSet;

use vice_core::camera::Pixel;

use super::agree::Piece;
use super::path::{Path, confidence};
use super::{AutoLabel, Given, Timeline};

/// To stay in view for longer is worth no more, seconds.
const LONG_S: f64 = 6.0;
/// A piece that is over sooner is no segment, seconds, unless the frames are further apart.
const SHORT_S: f64 = 0.4;
/// Two lanes are never nearer, pixels.
const NEAR_PX: f64 = 10.0;

/// What a lane is busy with.
#[derive(Clone, Copy)]
struct Busy {
    piece: usize,
    until: usize,
}

/// Labels of all lanes: those that were filled already go on where they are free.
pub(super) fn assemble(
    count: usize,
    given: &[Given],
    filled: Vec<Vec<AutoLabel>>,
    paths: &[Path],
    pieces: &[Piece],
    timeline: &Timeline,
) -> Vec<Vec<AutoLabel>> {
    let mut lanes: Vec<Vec<AutoLabel>> = filled;
    lanes.resize_with(count, Vec::new);
    // Positions that are taken in lanes with given points: nothing may reach into them.
    let taken: Vec<BTreeSet<usize>> = lanes
        .iter()
        .enumerate()
        .map(|(lane, labels)| {
            let own = given.get(lane).into_iter().flat_map(|g| g.places.iter().map(|p| p.position));
            labels.iter().map(|l| l.position).chain(own).collect()
        })
        .collect();
    // Where given points are, so that others keep away.
    let given_at = |lane: usize, position: usize| {
        let own =
            given.get(lane).and_then(|g| g.places.iter().find(|p| p.position == position).map(|p| p.px));
        own.or_else(|| lanes_at(&lanes, lane, position))
    };
    let mut busy: Vec<Option<Busy>> = vec![None; count];
    let mut used = vec![false; pieces.len()];
    let mut new: Vec<Vec<AutoLabel>> = vec![Vec::new(); count];
    for check in timeline.checks().iter().copied().filter(|c| timeline.is_chosen(*c)) {
        for lane in busy.iter_mut() {
            if lane.is_some_and(|b| b.until < check) {
                *lane = None;
            }
        }
        let mut here: Vec<(Pixel, Option<f64>)> = Vec::new();
        for (lane, busy) in busy.iter().enumerate() {
            let px = match busy {
                Some(b) => paths[pieces[b.piece].path].at(check).map(|s| s.px),
                None => given_at(lane, check),
            };
            let z_m = busy.and_then(|b| depth_at(&paths[pieces[b.piece].path], check));
            here.extend(px.map(|px| (px, z_m)));
        }
        for lane in 0..count {
            if busy[lane].is_some() || taken[lane].contains(&check) {
                continue;
            }
            let next = taken[lane].range(check..).next().copied();
            // A segment that started before what belongs to another one would take that over.
            if !next.map_or_else(|| ends_free(given, lane), |next| starts_segment(given, &lanes, lane, next))
            {
                continue;
            }
            let limit = next.unwrap_or(timeline.len());
            let Some((piece, until)) = best(check, limit, &used, &here, paths, pieces, timeline) else {
                continue;
            };
            let path = &paths[pieces[piece].path];
            used[piece] = true;
            // A piece that is used from its middle on has no other use.
            busy[lane] = Some(Busy { piece, until });
            here.extend(path.at(check).map(|s| (s.px, depth_at(path, check))));
            for position in (check..=until).filter(|p| timeline.is_chosen(*p)) {
                let Some(seen) = path.at(position) else { continue };
                let confidence = confidence(seen, pieces[piece].off);
                new[lane].push(AutoLabel { position, px: seen.px, confidence, keyframe: position == check });
            }
        }
    }
    for (lane, new) in lanes.iter_mut().zip(new) {
        lane.extend(new);
        lane.sort_by_key(|l| l.position);
    }
    lanes
}

/// Whether what a lane has at a position starts a segment.
fn starts_segment(given: &[Given], lanes: &[Vec<AutoLabel>], lane: usize, position: usize) -> bool {
    let own = given.get(lane).and_then(|g| g.places.iter().find(|p| p.position == position));
    own.map(|p| p.keyframe).unwrap_or_else(|| {
        lanes[lane].binary_search_by_key(&position, |l| l.position).is_ok_and(|i| lanes[lane][i].keyframe)
    })
}

/// Whether nothing behind the window belongs to a segment that began in it.
fn ends_free(given: &[Given], lane: usize) -> bool {
    given.get(lane).is_none_or(|g| !g.continues)
}

fn lanes_at(lanes: &[Vec<AutoLabel>], lane: usize, position: usize) -> Option<Pixel> {
    let labels = lanes.get(lane)?;
    labels.binary_search_by_key(&position, |l| l.position).ok().map(|i| labels[i].px)
}

/// How far away a path is at a check, where a label may start there and that is known.
fn depth_at(path: &Path, check: usize) -> Option<f64> {
    fit_at(path, check).flatten()
}

/// Whether a label may start there, and how far away it is.
fn fit_at(path: &Path, check: usize) -> Option<Option<f64>> {
    path.fit.binary_search_by_key(&check, |f| f.0).ok().map(|i| path.fit[i].1)
}

/// The best free piece at a check, and its last position before `limit`.
fn best(
    check: usize,
    limit: usize,
    used: &[bool],
    here: &[(Pixel, Option<f64>)],
    paths: &[Path],
    pieces: &[Piece],
    timeline: &Timeline,
) -> Option<(usize, usize)> {
    let mut best: Option<(f64, usize, usize)> = None;
    for (index, piece) in pieces.iter().enumerate() {
        if used[index] || piece.from > check || piece.to <= check {
            continue;
        }
        let path = &paths[piece.path];
        // What was given has its own lane.
        if path.given.is_some() {
            continue;
        }
        let (Some(seen), Some(z_m)) = (path.at(check), fit_at(path, check)) else { continue };
        let until =
            (check..=piece.to.min(limit - 1)).rev().find(|p| timeline.is_chosen(*p) && path.at(*p).is_some());
        let Some(until) = until.filter(|u| *u > check) else { continue };
        let seconds = timeline.seconds(check, until);
        let labels = (check..=until).filter(|p| timeline.is_chosen(*p)).take(3).count();
        if seconds < SHORT_S && labels < 3 {
            continue;
        }
        let apart =
            here.iter().map(|(px, other_z)| apart(seen.px, z_m, *px, *other_z)).fold(f64::INFINITY, f64::min);
        if here.iter().any(|(px, _)| px.distance_px(seen.px) < NEAR_PX) {
            continue;
        }
        let worth =
            (seconds.min(LONG_S) / LONG_S).sqrt() * apart.min(400.0) * confidence(seen, piece.off).max(0.1);
        if best.is_none_or(|(most, _, _)| worth > most) {
            best = Some((worth, index, until));
        }
    }
    best.map(|(_, index, until)| (index, until))
}

/// Distance in the image, and in depth: twice as far away is as good as this many pixels.
fn apart(px: Pixel, z_m: Option<f64>, other: Pixel, other_z: Option<f64>) -> f64 {
    const DOUBLE_PX: f64 = 100.0;
    let depth = match (z_m, other_z) {
        (Some(a), Some(b)) if a > 0.0 && b > 0.0 => DOUBLE_PX * (a / b).log2().abs(),
        _ => 0.0,
    };
    px.distance_px(other).hypot(depth)
}
