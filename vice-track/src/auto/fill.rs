//! Between and beyond what a person placed: the same point, followed from each of its places.

use std::collections::BTreeMap;

use vice_core::camera::Pixel;

use super::agree::Piece;
use super::path::{Path, confidence};
use super::sweep::Start;
use super::{AutoLabel, Given, Timeline};

/// Between two places of a person the ways from both must meet within this, pixels.
const MEET_PX: f64 = 1.5;

/// Where given points are followed from, in the positions of a sweep that way. A place that is followed by another one
/// right away, or hidden, is no start.
pub(super) fn starts(given: &[Given], timeline: &Timeline, backward: bool) -> Vec<Start> {
    let turned = |position: usize| if backward { timeline.len() - 1 - position } else { position };
    let mut starts = Vec::new();
    for (point, given) in given.iter().enumerate() {
        let count = given.places.len();
        for (i, place) in given.places.iter().enumerate().filter(|(_, p)| !p.occluded) {
            let next = if backward { i.checked_sub(1) } else { Some(i + 1).filter(|n| *n < count) };
            let next = next.map(|n| given.places[n].position);
            // What comes before an observation that starts nothing belongs to nothing.
            let nothing_before = backward && i == 0 && !place.keyframe;
            if nothing_before || next.is_some_and(|n| n.abs_diff(place.position) <= 1) {
                continue;
            }
            let until = next.map_or(timeline.len() - 1, turned);
            let (position, px) = (turned(place.position), place.px);
            starts.push(Start { position, px, until, given: (point, i) });
        }
    }
    starts.sort_by_key(|s| (s.position, s.given));
    starts
}

/// How many given places are on frames that are labelled.
pub(super) fn given_count(given: &[Given], timeline: &Timeline) -> usize {
    given.iter().flat_map(|g| &g.places).filter(|p| timeline.is_chosen(p.position)).count()
}

/// What was found of a given point on the way from one of its places.
type Way<'a> = Option<(&'a Path, Piece)>;

/// The labels of each given point that follow from its own places.
pub(super) fn fill(
    given: &[Given],
    paths: &[Path],
    pieces: &[Piece],
    timeline: &Timeline,
) -> Vec<Vec<AutoLabel>> {
    // The piece that holds the place itself: behind a cut it is another point.
    let mut forward: BTreeMap<(usize, usize), (&Path, Piece)> = BTreeMap::new();
    let mut backward: BTreeMap<(usize, usize), (&Path, Piece)> = BTreeMap::new();
    for piece in pieces {
        let path = &paths[piece.path];
        let Some((point, place)) = path.given else { continue };
        let at = given[point].places[place].position;
        if piece.from == at {
            forward.insert((point, place), (path, *piece));
        } else if piece.to == at {
            backward.insert((point, place), (path, *piece));
        }
    }
    given
        .iter()
        .enumerate()
        .map(|(point, of)| {
            let mut labels = Vec::new();
            let count = of.places.len();
            for gap in 0..=count {
                let from = gap.checked_sub(1);
                let to = Some(gap).filter(|g| *g < count);
                let there: Way<'_> = from.and_then(|f| forward.get(&(point, f))).copied();
                let back: Way<'_> = to.and_then(|t| backward.get(&(point, t))).copied();
                let end = to.map(|t| of.places[t]);
                let first = from.map_or(0, |f| of.places[f].position + 1);
                let last = end.map_or(timeline.len(), |e| e.position);
                let same = from.is_some() && end.is_some_and(|e| !e.keyframe);
                if same {
                    labels.extend(between((first, last), there, back, timeline));
                } else {
                    labels.extend(apart((first, last), there, back, timeline));
                }
            }
            labels
        })
        .collect()
}

fn label(way: Way<'_>, position: usize) -> Option<(Pixel, f64)> {
    let (path, piece) = way?;
    let inside = (piece.from..=piece.to).contains(&position);
    path.at(position).filter(|_| inside).map(|seen| (seen.px, confidence(seen, piece.off)))
}

/// Between two places of one segment: where both ways are known they must meet, and share the place.
fn between(
    (first, last): (usize, usize),
    there: Way<'_>,
    back: Way<'_>,
    timeline: &Timeline,
) -> Vec<AutoLabel> {
    let mut labels = Vec::new();
    let length = (last - first + 1) as f64;
    for position in (first..last).filter(|p| timeline.is_chosen(*p)) {
        let found = match (label(there, position), label(back, position)) {
            (Some((a, sure_a)), Some((b, sure_b))) if a.distance_px(b) <= MEET_PX => {
                // The nearer end knows better.
                let share = (position - first + 1) as f64 / length;
                let mix = |a: f64, b: f64| a + share * (b - a);
                Some((Pixel::new(mix(a.u, b.u), mix(a.v, b.v)), sure_a.min(sure_b)))
            }
            (Some(_), Some(_)) | (None, None) => None,
            (one, None) | (None, one) => one,
        };
        labels.extend(found.map(|(px, confidence)| AutoLabel { position, px, confidence, keyframe: false }));
    }
    labels
}

/// Where the gap ends with a key frame, or at an end of the window: the way from before goes as far as it goes, and the
/// way back from the key frame is a segment of its own, ahead of it.
fn apart(
    (first, last): (usize, usize),
    there: Way<'_>,
    back: Way<'_>,
    timeline: &Timeline,
) -> Vec<AutoLabel> {
    let mut labels = Vec::new();
    let mut begun = false;
    for position in (first..last).filter(|p| timeline.is_chosen(*p)) {
        let (found, keyframe) = match (label(there, position), label(back, position)) {
            (Some(found), _) => (found, false),
            (None, Some(found)) => (found, !std::mem::replace(&mut begun, true)),
            (None, None) => continue,
        };
        labels.push(AutoLabel { position, px: found.0, confidence: found.1, keyframe });
    }
    labels
}
