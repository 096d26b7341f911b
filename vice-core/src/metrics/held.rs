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

use crate::statistics::median;

/// Median of the length of a vector of two Gaussian components of deviation one.
const MEDIAN_LENGTH: f64 = 1.1774;
/// A label is off from so many deviations on.
const DEVIATIONS: f64 = 5.0;
/// And never below this, px: labels are not better than that.
const LEAST_PX: f64 = 2.5;

/// One scored label of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carried {
    /// Its frame, by any numbering that grows with time and is the same for all points.
    pub frame: u32,
    /// Where the point was carried minus where the label is, px.
    pub residual_px: [f64; 2],
    /// Angle between the rays of the two, radians; NaN where the label has no ray.
    pub angle_rad: f32,
    /// Distance between the rays at the depth of the carried point, metres; NaN where the label has no ray.
    pub offset_m: f32,
}

impl Carried {
    /// The squared error, px².
    pub fn square_px2(&self) -> f64 {
        self.residual_px[0] * self.residual_px[0] + self.residual_px[1] * self.residual_px[1]
    }
}

/// The scored labels of one point from one key frame on, in time.
#[derive(Clone, Debug, PartialEq)]
pub struct CarriedSegment {
    /// Which point; segments of a point do not overlap.
    pub point: usize,
    /// Frame of the key frame.
    pub keyframe: u32,
    /// The samples, in time.
    pub samples: Vec<Carried>,
}

/// What is set aside of a segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aside {
    /// By how much its key frame is off, px, where that sets the whole segment aside.
    pub keyframe_px: Option<f64>,
    /// Single samples: their place in the segment, and by how much they jump, px.
    pub labels: Vec<(usize, f64)>,
}

impl Aside {
    /// The samples of the segment that hold.
    pub fn held<'a>(&'a self, segment: &'a CarriedSegment) -> impl Iterator<Item = &'a Carried> {
        let mut next = self.labels.iter().map(|(place, _)| *place).peekable();
        let samples = if self.keyframe_px.is_some() { &[][..] } else { &segment.samples };
        samples.iter().enumerate().filter_map(move |(place, sample)| {
            if next.next_if_eq(&place).is_some() { None } else { Some(sample) }
        })
    }
}

/// What to set aside of each segment, in their order.
pub fn set_aside(segments: &[CarriedSegment]) -> Vec<Aside> {
    let mut aside = vec![Aside::default(); segments.len()];
    let by_point = by_point(segments);
    if by_point.len() < 2 {
        return aside;
    }
    labels(segments, &mut aside);
    keyframes(segments, &by_point, &mut aside);
    aside
}

fn by_point(segments: &[CarriedSegment]) -> BTreeMap<usize, Vec<&CarriedSegment>> {
    let mut by_point: BTreeMap<usize, Vec<&CarriedSegment>> = BTreeMap::new();
    for segment in segments {
        by_point.entry(segment.point).or_default().push(segment);
    }
    by_point.values_mut().for_each(|list| list.sort_by_key(|s| s.keyframe));
    by_point
}

fn labels(segments: &[CarriedSegment], aside: &mut [Aside]) {
    let jumps: Vec<Vec<f32>> = segments.iter().map(|s| jumps_px(&s.samples)).collect();
    let mut above_zero: Vec<f64> =
        jumps.iter().flatten().filter(|d| **d > 0.0).map(|d| f64::from(*d)).collect();
    let Some(typical) = median(&mut above_zero) else { return };
    drop(above_zero);
    let limit = LEAST_PX.max(DEVIATIONS * typical / MEDIAN_LENGTH);
    let flagged = |d: &f32| f64::from(*d) > limit;
    let mut at_frame: BTreeMap<u32, Vec<(usize, f64)>> = BTreeMap::new();
    for (segment, jumps) in segments.iter().zip(&jumps) {
        for (sample, _) in segment.samples.iter().zip(jumps).filter(|(_, d)| flagged(d)) {
            at_frame.entry(sample.frame).or_default();
        }
    }
    if at_frame.is_empty() {
        return;
    }
    for (segment, jumps) in segments.iter().zip(&jumps) {
        for (sample, d) in segment.samples.iter().zip(jumps) {
            if let Some(list) = at_frame.get_mut(&sample.frame) {
                list.push((segment.point, f64::from(*d)));
            }
        }
    }
    for ((segment, jumps), aside) in segments.iter().zip(&jumps).zip(aside) {
        for (place, (sample, d)) in
            segment.samples.iter().zip(jumps).enumerate().filter(|(_, (_, d))| flagged(d))
        {
            let others = at_frame.get(&sample.frame).map_or(&[][..], Vec::as_slice);
            let mut others: Vec<f64> =
                others.iter().filter(|(point, _)| *point != segment.point).map(|(_, d)| *d).collect();
            if median(&mut others).is_some_and(|typical| typical <= 0.5 * limit) {
                aside.labels.push((place, f64::from(*d)));
            }
        }
    }
}

fn keyframes(
    segments: &[CarriedSegment],
    by_point: &BTreeMap<usize, Vec<&CarriedSegment>>,
    aside: &mut [Aside],
) {
    let starts: Vec<Option<f64>> = segments.iter().map(start_px).collect();
    let Some(typical) = median(&mut starts.iter().copied().flatten().collect::<Vec<f64>>()) else { return };
    let limit = LEAST_PX.max(DEVIATIONS * typical / MEDIAN_LENGTH);
    for ((segment, start), aside) in segments.iter().zip(starts).zip(aside) {
        let Some(start) = start.filter(|g| *g > limit) else { continue };
        let others = by_point.iter().filter(|(point, _)| **point != segment.point);
        let mut steps: Vec<f64> = others.filter_map(|(_, list)| step_px(list, segment.keyframe)).collect();
        if median(&mut steps).is_some_and(|typical| typical <= 0.5 * limit) {
            aside.keyframe_px = Some(start);
        }
    }
}

/// By how much each sample is off from the median of the five around it; zero where there are fewer than three.
fn jumps_px(samples: &[Carried]) -> Vec<f32> {
    let jump = |i: usize| {
        let around = &samples[i.saturating_sub(2)..samples.len().min(i + 3)];
        if around.len() < 3 {
            return 0.0;
        }
        let (middle, r) = (median_residual(around), samples[i].residual_px);
        length([r[0] - middle[0], r[1] - middle[1]]) as f32
    };
    (0..samples.len()).map(jump).collect()
}

/// By how much a segment is off from the start.
fn start_px(segment: &CarriedSegment) -> Option<f64> {
    let first = &segment.samples[..segment.samples.len().min(3)];
    (!first.is_empty()).then(|| length(median_residual(first)))
}

/// The step that a point makes at a frame: from the last three residuals up to it to the next three; from none at all
/// where its key frame is the same. `None` where it is not seen then.
fn step_px(of_point: &[&CarriedSegment], frame: u32) -> Option<f64> {
    let segment = of_point[..of_point.partition_point(|s| s.keyframe <= frame)].last()?;
    let after = segment.samples.partition_point(|s| s.frame <= frame);
    let next = &segment.samples[after..segment.samples.len().min(after + 3)];
    if next.is_empty() {
        return None;
    }
    let next = median_residual(next);
    // At its key frame a point is where its label is.
    let last = match &segment.samples[after.saturating_sub(3)..after] {
        [] => [0.0; 2],
        last => median_residual(last),
    };
    Some(length([next[0] - last[0], next[1] - last[1]]))
}

fn median_residual(samples: &[Carried]) -> [f64; 2] {
    [0, 1].map(|axis| {
        let mut values = [0.0; 5];
        let values = &mut values[..samples.len()];
        values.iter_mut().zip(samples).for_each(|(v, s)| *v = s.residual_px[axis]);
        median(values).unwrap_or(0.0)
    })
}

fn length(v: [f64; 2]) -> f64 {
    // Pixels: their squares neither overflow nor vanish, and `hypot` takes ten times as long.
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A small wobble that is the same on every run, px.
    fn wobble(point: usize, frame: u32) -> [f64; 2] {
        let at = f64::from(frame) * 1.7 + point as f64 * 2.3;
        [0.4 * at.sin(), 0.4 * (1.3 * at).cos()]
    }

    fn segment(point: usize, keyframe: u32, count: u32, more: impl Fn(u32) -> f64) -> CarriedSegment {
        let sample = |frame: u32| {
            let [u, v] = wobble(point, frame);
            Carried { frame, residual_px: [u + more(frame), v], angle_rad: 0.0, offset_m: 0.0 }
        };
        CarriedSegment { point, keyframe, samples: (keyframe + 1..=keyframe + count).map(sample).collect() }
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
        assert_eq!(found[1].held(&blunder[1]).count(), 0);
        assert_eq!(found[0].held(&blunder[0]).count(), 20);
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
            let mut s = segment(point, keyframe, count, |_| 0.0);
            s.samples.iter_mut().for_each(|s| s.residual_px = [0.0; 2]);
            s
        };
        let found = set_aside(&[exact(0, 0, 2), exact(0, 3, 1), exact(1, 0, 9), exact(2, 0, 0)]);
        assert!(found.iter().all(|a| *a == Aside::default()));
        assert!(set_aside(&[]).is_empty());
    }
}
