//! Labels that hold: which labels are blunders, told from what the other points do in the same frames.
//!
//! A blunder on a key frame moves its whole segment, so that RMSE_2D of all labels is the mean of a heavy tail which few
//! points do not see; without blunders an interval holds. A label is set aside where it jumps against its neighbours in
//! its segment, a whole segment where its first samples are off from the start. Both only where another point is seen at
//! that time and the others do not do the same: what all points do is the estimate's error.
//!
//! `r` is carried minus label, px; medians of `r` are by component.
//! - A label: `d = |r - median of the five r around it|`, `s` = median of `d > 0` over 1.1774.
//! - A key frame: `g = |median of the first three r|`, `s` = median of `g` over 1.1774.
//! - Flagged above `max(5 s, 2.5 px)`, where the median of the others' `d` at that frame, or of their step there (the
//!   median of the next three `r` minus that of the last three; their own `g` where their key frame is the same), is
//!   at most half of that.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::statistics::{Counted, median};

/// Median of the length of a vector of two Gaussian components of deviation one.
const MEDIAN_LENGTH: f64 = 1.1774;
/// A label is off from so many deviations on.
const DEVIATIONS: f64 = 5.0;
/// And never below this, px: labels are not better than that.
const LEAST_PX: f64 = 2.5;

/// The scored labels of all segments, each from one point's key frame on, in time. Frames are in any numbering that grows
/// with time and is the same for all points; segments of a point do not overlap.
pub trait Segments {
    /// How many segments.
    fn count(&self) -> usize;

    /// Which point a segment is of.
    fn point(&self, segment: usize) -> usize;

    /// Frame of the key frame.
    fn keyframe(&self, segment: usize) -> u32;

    /// Frames of the samples.
    fn frames(&self, segment: usize) -> Vec<u32>;

    /// By how much each sample is off from the median of the five around it, px.
    fn jumps_px(&self, segment: usize) -> &[f32];

    /// Length of the median of the first three residuals, px; `None` where there is no sample.
    fn start_px(&self, segment: usize) -> Option<f64>;

    /// Where the point was carried minus where the label is, of some samples, px.
    fn residuals(&self, segment: usize, samples: Range<usize>) -> Vec<[f64; 2]>;
}

/// What is set aside of a segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aside {
    /// By how much its key frame is off, px, where that sets the whole segment aside.
    pub keyframe_px: Option<f64>,
    /// Single samples: their place in the segment, ascending, and by how much they jump, px.
    pub labels: Vec<(usize, f64)>,
}

/// What to set aside, by segment; of those that are not named nothing is.
pub fn set_aside(segments: &impl Segments) -> BTreeMap<usize, Aside> {
    let mut aside = BTreeMap::new();
    let by_point = by_point(segments);
    if by_point.len() < 2 {
        return aside;
    }
    labels(segments, &by_point, &mut aside);
    keyframes(segments, &by_point, &mut aside);
    aside
}

/// The segments of each point, in time.
fn by_point(segments: &impl Segments) -> BTreeMap<usize, Vec<usize>> {
    let mut by_point: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for segment in 0..segments.count() {
        by_point.entry(segments.point(segment)).or_default().push(segment);
    }
    by_point.values_mut().for_each(|list| list.sort_by_key(|s| segments.keyframe(*s)));
    by_point
}

/// A label that jumps: its frame, segment and place there.
type Jump = (u32, usize, usize);

fn labels(
    segments: &impl Segments,
    by_point: &BTreeMap<usize, Vec<usize>>,
    aside: &mut BTreeMap<usize, Aside>,
) {
    let parts: Vec<&[f32]> = (0..segments.count()).map(|s| segments.jumps_px(s)).collect();
    let Some(typical) = Counted::new(&parts, |d| *d > 0.0).median() else { return };
    let limit = LEAST_PX.max(DEVIATIONS * typical / MEDIAN_LENGTH);
    let flagged = |d: &f32| f64::from(*d) > limit;
    let mut jumps: Vec<Jump> = Vec::new();
    for (segment, part) in parts.iter().enumerate().filter(|(_, part)| part.iter().any(flagged)) {
        let frames = segments.frames(segment);
        let of_segment = part.iter().enumerate().filter(|(_, d)| flagged(d));
        jumps.extend(of_segment.map(|(place, _)| (frames[place], segment, place)));
    }
    jumps.sort_unstable();
    let mut cursors: Vec<Cursor<'_>> =
        by_point.iter().map(|(point, list)| Cursor { point: *point, list, at: 0, frames: None }).collect();
    for at_frame in jumps.chunk_by(|a, b| a.0 == b.0) {
        let frame = at_frame[0].0;
        let seen: Vec<(usize, f64)> = cursors
            .iter_mut()
            .filter_map(|cursor| Some((cursor.point, f64::from(cursor.jump_at(segments, frame)?))))
            .collect();
        for (_, segment, place) in at_frame {
            let point = segments.point(*segment);
            let mut others: Vec<f64> = seen.iter().filter(|(p, _)| *p != point).map(|(_, d)| *d).collect();
            if median(&mut others).is_some_and(|typical| typical <= 0.5 * limit) {
                let off_px = f64::from(parts[*segment][*place]);
                aside.entry(*segment).or_default().labels.push((*place, off_px));
            }
        }
    }
}

/// Goes through the segments of a point in time.
struct Cursor<'a> {
    point: usize,
    list: &'a [usize],
    at: usize,
    /// Frames of the segment that was looked at last, and which it is.
    frames: Option<(usize, Vec<u32>)>,
}

impl Cursor<'_> {
    /// By how much the point's label in a frame jumps; frames are asked in ascending order.
    fn jump_at(&mut self, segments: &impl Segments, frame: u32) -> Option<f32> {
        while self.list.get(self.at + 1).is_some_and(|next| segments.keyframe(*next) <= frame) {
            self.at += 1;
        }
        let segment = self.list[self.at];
        if self.frames.as_ref().is_none_or(|(of, _)| *of != segment) {
            self.frames = Some((segment, segments.frames(segment)));
        }
        let (_, frames) = self.frames.as_ref()?;
        Some(segments.jumps_px(segment)[frames.binary_search(&frame).ok()?])
    }
}

fn keyframes(
    segments: &impl Segments,
    by_point: &BTreeMap<usize, Vec<usize>>,
    aside: &mut BTreeMap<usize, Aside>,
) {
    let starts: Vec<Option<f64>> = (0..segments.count()).map(|s| segments.start_px(s)).collect();
    let Some(typical) = median(&mut starts.iter().copied().flatten().collect::<Vec<f64>>()) else { return };
    let limit = LEAST_PX.max(DEVIATIONS * typical / MEDIAN_LENGTH);
    for (segment, start) in starts.into_iter().enumerate() {
        let Some(start) = start.filter(|g| *g > limit) else { continue };
        let (point, keyframe) = (segments.point(segment), segments.keyframe(segment));
        let others = by_point.iter().filter(|(other, _)| **other != point);
        let mut steps: Vec<f64> = others.filter_map(|(_, list)| step_px(segments, list, keyframe)).collect();
        if median(&mut steps).is_some_and(|typical| typical <= 0.5 * limit) {
            aside.entry(segment).or_default().keyframe_px = Some(start);
        }
    }
}

/// The step that a point makes at a frame: from the last three residuals up to it to the next three; from none at all
/// where its key frame is the same. `None` where it is not seen then.
fn step_px(segments: &impl Segments, of_point: &[usize], frame: u32) -> Option<f64> {
    let segment = *of_point[..of_point.partition_point(|s| segments.keyframe(*s) <= frame)].last()?;
    let frames = segments.frames(segment);
    let after = frames.partition_point(|f| *f <= frame);
    let end = frames.len().min(after + 3);
    if after == end {
        return None;
    }
    let before = after.saturating_sub(3);
    let around = segments.residuals(segment, before..end);
    let (last, next) = around.split_at_checked(after - before)?;
    let next = median_residual(next);
    // At its key frame a point is where its label is.
    let last = if last.is_empty() { [0.0; 2] } else { median_residual(last) };
    Some(length([next[0] - last[0], next[1] - last[1]]))
}

fn median_residual(residuals: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| median_of(&residuals.iter().map(|r| r[axis]).collect::<Vec<f64>>()))
}

/// The median of a few numbers, zero of none.
pub(crate) fn median_of(values: &[f64]) -> f64 {
    median(&mut values.to_vec()).unwrap_or(0.0)
}

fn length(v: [f64; 2]) -> f64 {
    // Pixels: their squares neither overflow nor vanish, and `hypot` takes ten times as long.
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The samples of one point from one key frame on: frame and residual.
    struct Segment {
        point: usize,
        keyframe: u32,
        samples: Vec<(u32, [f64; 2])>,
        jumps_px: Vec<f32>,
    }

    impl Segment {
        fn new(point: usize, keyframe: u32, samples: Vec<(u32, [f64; 2])>) -> Self {
            let residuals: Vec<[f64; 2]> = samples.iter().map(|s| s.1).collect();
            let jump = |i: usize| {
                let around = &residuals[i.saturating_sub(2)..residuals.len().min(i + 3)];
                let middle = median_residual(around);
                let off = length([residuals[i][0] - middle[0], residuals[i][1] - middle[1]]);
                if around.len() < 3 { 0.0 } else { off as f32 }
            };
            Self { point, keyframe, jumps_px: (0..residuals.len()).map(jump).collect(), samples }
        }
    }

    impl Segments for &[Segment] {
        fn count(&self) -> usize {
            self.len()
        }
        fn point(&self, segment: usize) -> usize {
            self[segment].point
        }
        fn keyframe(&self, segment: usize) -> u32 {
            self[segment].keyframe
        }
        fn frames(&self, segment: usize) -> Vec<u32> {
            self[segment].samples.iter().map(|s| s.0).collect()
        }
        fn jumps_px(&self, segment: usize) -> &[f32] {
            &self[segment].jumps_px
        }
        fn start_px(&self, segment: usize) -> Option<f64> {
            let first = self.residuals(segment, 0..self[segment].samples.len().min(3));
            (!first.is_empty()).then(|| length(median_residual(&first)))
        }
        fn residuals(&self, segment: usize, samples: Range<usize>) -> Vec<[f64; 2]> {
            self[segment].samples[samples].iter().map(|s| s.1).collect()
        }
    }

    fn set_aside(segments: &[Segment]) -> Vec<Aside> {
        let found = super::set_aside(&segments);
        (0..segments.len()).map(|i| found.get(&i).cloned().unwrap_or_default()).collect()
    }

    /// A small wobble that is the same on every run, px.
    fn wobble(point: usize, frame: u32) -> [f64; 2] {
        let at = f64::from(frame) * 1.7 + point as f64 * 2.3;
        [0.4 * at.sin(), 0.4 * (1.3 * at).cos()]
    }

    fn segment(point: usize, keyframe: u32, count: u32, more: impl Fn(u32) -> f64) -> Segment {
        let sample = |frame: u32| {
            let [u, v] = wobble(point, frame);
            (frame, [u + more(frame), v])
        };
        Segment::new(point, keyframe, (keyframe + 1..=keyframe + count).map(sample).collect())
    }

    #[test]
    fn one_label_that_jumps_is_set_aside_and_one_that_all_points_share_is_not() {
        let one = |f: u32| if f == 7 { 12.0 } else { 0.0 };
        let none = |_: u32| 0.0;
        let alone = set_aside(&[segment(0, 0, 20, one), segment(1, 3, 20, none), segment(2, 0, 20, none)]);
        assert_eq!(alone[0].labels.len(), 1);
        assert_eq!(alone[0].labels[0].0, 6);
        assert!((alone[0].labels[0].1 - 12.0).abs() < 1.5);
        assert!(alone[1..].iter().all(|a| a.labels.is_empty() && a.keyframe_px.is_none()));
        let shared = set_aside(&[segment(0, 0, 20, one), segment(1, 3, 20, one), segment(2, 0, 20, one)]);
        assert!(shared.iter().all(|a| a.labels.is_empty()), "{shared:?}");
        // Nobody else is seen at that frame.
        let far = set_aside(&[segment(0, 0, 20, one), segment(1, 30, 20, none)]);
        assert!(far[0].labels.is_empty());
        assert!(set_aside(&[segment(0, 0, 20, one)])[0].labels.is_empty(), "a point alone cannot be judged");
    }

    #[test]
    fn a_key_frame_that_is_off_takes_its_segment_and_a_jump_of_the_estimate_does_not() {
        let off = |_: u32| 8.0;
        let none = |_: u32| 0.0;
        let blunder = [
            segment(0, 0, 20, none),
            segment(0, 21, 20, off),
            segment(1, 5, 40, none),
            segment(2, 0, 40, none),
        ];
        let found = set_aside(&blunder);
        assert!(found[1].keyframe_px.is_some_and(|px| (px - 8.0).abs() < 1.0), "{found:?}");
        assert!(found[0].labels.is_empty());
        assert!([0, 2, 3].iter().all(|i| found[*i].keyframe_px.is_none()));
        // The estimate jumps right after that key frame: the other points step as well.
        let jump = |f: u32| if f > 21 { 8.0 } else { 0.0 };
        let all = [
            segment(0, 0, 20, none),
            segment(0, 21, 20, off),
            segment(1, 5, 40, jump),
            segment(2, 0, 40, jump),
        ];
        assert!(set_aside(&all).iter().all(|a| a.keyframe_px.is_none()));
        // Others whose key frame is the same are off from the start as well.
        let same = [
            segment(0, 0, 20, none),
            segment(0, 21, 20, off),
            segment(1, 21, 20, off),
            segment(2, 0, 20, none),
        ];
        assert!(set_aside(&same).iter().all(|a| a.keyframe_px.is_none()));
    }

    #[test]
    fn exact_labels_and_short_segments_are_kept() {
        let exact = |point, keyframe, count| {
            Segment::new(point, keyframe, (keyframe + 1..=keyframe + count).map(|f| (f, [0.0; 2])).collect())
        };
        let found = set_aside(&[exact(0, 0, 2), exact(0, 3, 1), exact(1, 0, 9), exact(2, 0, 0)]);
        assert!(found.iter().all(|a| *a == Aside::default()));
        assert!(set_aside(&[]).is_empty());
    }
}
