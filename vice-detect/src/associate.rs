//! From corners in frames to labels over time: names, key frames, respawns.

use std::collections::BTreeMap;

use vice_core::camera::Pixel;
use vice_core::label::{LabelRow, Observation, ObservationSource, Provenance};
use vice_core::time::{Span, Stamp};

use crate::board::{Board, BoardSize};
use crate::tag::Tag;

/// Corners that are less sure than this are marked as uncertain.
const UNCERTAIN: f32 = 0.05;
/// A board that has no top of its own keeps its names from frame to frame while the other ways to name it would move
/// its corners this many times as far.
const CLEARLY: f64 = 2.0;

/// What was found in a frame.
#[derive(Clone, Debug)]
pub(crate) struct Sighting {
    pub(crate) stamp: Stamp,
    pub(crate) tags: Vec<Tag>,
    pub(crate) board: Option<Board>,
}

/// When a point starts anew.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gaps {
    /// Unseen for longer than this.
    pub(crate) any: Span,
    /// Missed in a frame, and unseen for longer than this.
    pub(crate) missed: Span,
}

/// A point in a frame of those that were looked at.
struct Seen {
    frame: usize,
    px: Pixel,
    confidence: f32,
    /// Whether it is sure to be the same corner as before.
    same: bool,
}

/// Labels of all corners, frames in time order. `inside` says whether a pixel may be labelled.
pub(crate) fn rows(
    sightings: &[Sighting],
    size: Option<BoardSize>,
    gaps: Gaps,
    inside: impl Fn(Pixel) -> bool,
) -> Vec<LabelRow> {
    let mut points: BTreeMap<String, Vec<Seen>> = BTreeMap::new();
    let mut see = |name: String, seen: Seen| {
        if inside(seen.px) {
            points.entry(name).or_default().push(seen);
        }
    };
    let mut before: Option<(Stamp, Vec<Pixel>)> = None;
    for (frame, sighting) in sightings.iter().enumerate() {
        for tag in &sighting.tags {
            for (corner, px) in tag.corners.into_iter().enumerate() {
                let name = format!("tag{}.c{corner}", tag.id);
                see(name, Seen { frame, px, confidence: tag.confidence, same: true });
            }
        }
        let (Some(board), Some(size)) = (&sighting.board, size) else { continue };
        let last = before.as_ref().filter(|(stamp, _)| sighting.stamp - *stamp <= gaps.missed);
        let (corners, same) = turn_of(board, last.map(|(_, corners)| corners.as_slice()));
        for (i, px) in corners.iter().enumerate() {
            let name = format!("board.r{}c{}", i / size.columns(), i % size.columns());
            see(name, Seen { frame, px: *px, confidence: board.confidence, same });
        }
        before = Some((sighting.stamp, corners.to_vec()));
    }
    points.iter().flat_map(|(name, seen)| observations(name, seen, sightings, gaps)).collect()
}

/// The way to name a board's corners that moves them least, and whether that is sure to be the way of before.
fn turn_of<'a>(board: &'a Board, before: Option<&[Pixel]>) -> (&'a [Pixel], bool) {
    if let [only] = board.turns.as_slice() {
        return (only, true);
    }
    let distance = |turn: &[Pixel]| match before {
        Some(last) => {
            turn.iter().zip(last).map(|(a, b)| a.distance_px(*b)).sum::<f64>() / last.len().max(1) as f64
        }
        // Nothing to go by: the one whose first corner is nearest to the top left of the picture.
        None => turn.first().map_or(0.0, |p| p.u + p.v),
    };
    let mut turns: Vec<(f64, &[Pixel])> = board.turns.iter().map(|t| (distance(t), t.as_slice())).collect();
    turns.sort_by(|a, b| a.0.total_cmp(&b.0));
    let same = before.is_some() && turns.len() > 1 && turns[1].0 > CLEARLY * turns[0].0;
    (turns.first().map_or(&[], |t| t.1), same)
}

fn observations<'a>(
    name: &'a str,
    seen: &'a [Seen],
    sightings: &'a [Sighting],
    gaps: Gaps,
) -> impl Iterator<Item = LabelRow> + use<'a> {
    seen.iter().enumerate().map(move |(i, s)| {
        let stamp = sightings[s.frame].stamp;
        let keyframe = match i.checked_sub(1).map(|i| &seen[i]) {
            None => true,
            Some(last) => {
                let gap = stamp - sightings[last.frame].stamp;
                !s.same || gap > gaps.any || (s.frame > last.frame + 1 && gap > gaps.missed)
            }
        };
        let observation = Observation {
            source: ObservationSource::Detected,
            keyframe,
            uncertain: s.confidence < UNCERTAIN,
            provenance: Provenance {
                confidence: Some(f64::from(s.confidence.clamp(0.0, 1.0))),
                ..Provenance::default()
            },
            ..Observation::manual(stamp, s.px)
        };
        LabelRow { point: name.to_string(), observation }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAPS: Gaps = Gaps { any: Span::from_millis(3000), missed: Span::from_millis(500) };

    fn tag(id: usize, u: f64) -> Tag {
        let corners = [0.0, 10.0, 20.0, 30.0].map(|v| Pixel::new(u, v));
        Tag { id, corners, wrong_cells: 0, border: 1, confidence: 1.0 }
    }

    fn keyframes(times_ms: &[i64], with_tag: &[bool]) -> Vec<bool> {
        let sightings: Vec<Sighting> = times_ms
            .iter()
            .zip(with_tag)
            .map(|(ms, with)| Sighting {
                stamp: Stamp::from_nanos(ms * 1_000_000),
                tags: if *with { vec![tag(3, 5.0)] } else { vec![] },
                board: None,
            })
            .collect();
        let rows = rows(&sightings, None, GAPS, |_| true);
        assert_eq!(rows.iter().filter(|r| r.point == "tag3.c2").count() * 4, rows.len());
        rows.iter().filter(|r| r.point == "tag3.c2").map(|r| r.observation.keyframe).collect()
    }

    #[test]
    fn a_point_that_was_lost_starts_anew() {
        // A flicker of one frame does not end a segment, being away does, and so does a long pause of the camera.
        assert_eq!(keyframes(&[0, 100, 200, 300], &[true, true, false, true]), [true, false, false]);
        assert_eq!(keyframes(&[0, 400, 800], &[true, false, true]), [true, true]);
        assert_eq!(keyframes(&[0, 2000, 6000], &[true; 3]), [true, false, true]);
    }

    #[test]
    fn a_board_without_a_top_keeps_its_names_while_it_moves_little() {
        let size = BoardSize::new(3, 3).unwrap();
        let corners: Vec<Pixel> = (0..9)
            .map(|i| Pixel::new(100.0 + 20.0 * f64::from(i % 3), 50.0 + 20.0 * f64::from(i / 3)))
            .collect();
        let board = |shift: f64, flipped: bool| {
            let moved: Vec<Pixel> = corners.iter().map(|p| Pixel::new(p.u + shift, p.v)).collect();
            let back: Vec<Pixel> = moved.iter().rev().copied().collect();
            let turns = if flipped { vec![back, moved] } else { vec![moved, back] };
            Board { turns, confidence: 1.0 }
        };
        let sighting = |ms: i64, board| Sighting {
            stamp: Stamp::from_nanos(ms * 1_000_000),
            tags: vec![],
            board: Some(board),
        };
        let seen = [
            sighting(0, board(0.0, false)),
            sighting(100, board(4.0, true)),
            sighting(200, board(8.0, true)),
            sighting(2000, board(0.0, true)),
        ];
        let rows = rows(&seen, Some(size), GAPS, |px| px.u < 1000.0);
        let first: Vec<&Observation> =
            rows.iter().filter(|r| r.point == "board.r0c0").map(|r| &r.observation).collect();
        let along: Vec<(f64, bool)> = first.iter().map(|o| (o.px.u, o.keyframe)).collect();
        // The last one is far enough away in time to start anew, whichever way round it is named.
        assert_eq!(along, [(100.0, true), (104.0, false), (108.0, false), (100.0, true)]);
    }
}
