//! Two results at the same labels: paired differences, so that what makes a label hard cancels out.
//!
//! Intervals come from resampling points and segments, both with replacement: a label takes part as often as its point
//! was drawn times as often as its segment was, since errors that a point keeps and errors that a stretch of time
//! shares are no independent draws (Owen, "The pigeonhole bootstrap", 2007).

use std::collections::BTreeMap;

use crate::result::{PixelPart, PointName, Sample};
use crate::statistics::{WithInterval, bootstrap};
use crate::time::Stamp;

/// Resamples of an interval.
pub const RESAMPLES: usize = 2000;
/// Labels closer than this are the same, pixels.
const SAME_LABEL_PX: f64 = 0.01;

/// What two results say at the labels that both scored. Differences are B minus A: negative where B is better.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Paired {
    /// Labels that both scored.
    pub labels: u64,
    /// Points among them.
    pub points: usize,
    /// Segments among them, by the stamp of their key frame.
    pub segments: usize,
    /// Labels that only A scored.
    pub only_a: u64,
    /// Labels that only B scored.
    pub only_b: u64,
    /// Pairs whose labels are not at the same pixel: then not the same is compared.
    pub moved_labels: u64,
    /// RMSE_2D of A at the common labels, pixels.
    pub rmse_a_px: f64,
    /// RMSE_2D of B at the common labels, pixels.
    pub rmse_b_px: f64,
    /// Difference of the two.
    pub rmse_difference_px: WithInterval,
    /// Mean difference of the errors, pixels.
    pub mean_difference_px: WithInterval,
    /// Share of the labels at which B is nearer.
    pub b_nearer_share: f64,
}

/// Sums over the labels of a point in a segment.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    count: f64,
    squares_a_px2: f64,
    squares_b_px2: f64,
    difference_px: f64,
}

impl Cell {
    fn add(&mut self, other: &Self, times: f64) {
        self.count += times * other.count;
        self.squares_a_px2 += times * other.squares_a_px2;
        self.squares_b_px2 += times * other.squares_b_px2;
        self.difference_px += times * other.difference_px;
    }

    fn rmse_difference_px(&self) -> f64 {
        (self.squares_b_px2 / self.count).sqrt() - (self.squares_a_px2 / self.count).sqrt()
    }

    fn mean_difference_px(&self) -> f64 {
        self.difference_px / self.count
    }
}

/// Compares B with A; `None` where they have no label in common. The same seed gives the same intervals.
pub fn paired(a: &PixelPart, b: &PixelPart, seed: u64) -> Option<Paired> {
    let by_label = |part: &'_ PixelPart| -> BTreeMap<(PointName, Stamp), Sample> {
        part.samples.iter().map(|s| ((s.point.clone(), s.timestamp_ns), s.clone())).collect()
    };
    let (of_a, of_b) = (by_label(a), by_label(b));
    let mut starts: BTreeMap<&PointName, Vec<Stamp>> = BTreeMap::new();
    for keyframe in &a.keyframes {
        starts.entry(&keyframe.point).or_default().push(keyframe.timestamp_ns);
    }
    starts.values_mut().for_each(|s| s.sort_unstable());
    let mut cells: BTreeMap<(&PointName, Option<Stamp>), Cell> = BTreeMap::new();
    let (mut labels, mut nearer, mut moved_labels) = (0, 0, 0);
    for (key, a) in &of_a {
        let Some(b) = of_b.get(key) else { continue };
        labels += 1;
        nearer += u64::from(b.error_px < a.error_px);
        moved_labels += u64::from(a.label_px.distance_px(b.label_px) > SAME_LABEL_PX);
        let started =
            starts.get(&key.0).and_then(|s| s[..s.partition_point(|k| *k <= key.1)].last().copied());
        let one = Cell {
            count: 1.0,
            squares_a_px2: a.error_px * a.error_px,
            squares_b_px2: b.error_px * b.error_px,
            difference_px: b.error_px - a.error_px,
        };
        cells.entry((&key.0, started)).or_default().add(&one, 1.0);
    }
    if labels == 0 {
        return None;
    }
    let mut all = Cell::default();
    cells.values().for_each(|c| all.add(c, 1.0));
    let (points, segments) = (places(cells.keys().map(|k| k.0)), places(cells.keys().map(|k| k.1)));
    let placed: Vec<(usize, usize, Cell)> =
        cells.iter().map(|((point, start), cell)| (points[point], segments[start], *cell)).collect();
    let resampled = resample(&placed, points.len(), segments.len(), seed);
    let with_interval =
        |number: fn(&Cell) -> f64| WithInterval::of(number(&all), resampled.iter().map(number).collect());
    Some(Paired {
        labels,
        points: points.len(),
        segments: segments.len(),
        only_a: of_a.len() as u64 - labels,
        only_b: of_b.len() as u64 - labels,
        moved_labels,
        rmse_a_px: (all.squares_a_px2 / all.count).sqrt(),
        rmse_b_px: (all.squares_b_px2 / all.count).sqrt(),
        rmse_difference_px: with_interval(Cell::rmse_difference_px),
        mean_difference_px: with_interval(Cell::mean_difference_px),
        b_nearer_share: nearer as f64 / labels as f64,
    })
}

/// The place of each distinct value.
fn places<T: Ord>(values: impl Iterator<Item = T>) -> BTreeMap<T, usize> {
    let distinct: std::collections::BTreeSet<T> = values.collect();
    distinct.into_iter().enumerate().map(|(place, value)| (value, place)).collect()
}

/// Sums over resampled points and segments; nothing where there is nothing to draw from.
fn resample(cells: &[(usize, usize, Cell)], points: usize, segments: usize, seed: u64) -> Vec<Cell> {
    if cells.len() < 2 {
        return vec![];
    }
    bootstrap(RESAMPLES, seed, |random| {
        let (of_points, of_segments) = (random.resample(points), random.resample(segments));
        let mut sum = Cell::default();
        for (point, segment, cell) in cells {
            sum.add(cell, f64::from(of_points[*point]) * f64::from(of_segments[*segment]));
        }
        // Points and segments may be drawn that never meet.
        (sum.count > 0.0).then_some(sum)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Pixel;
    use crate::result::{KeyframePart, Role};
    use proptest::prelude::*;

    fn part(errors: &[(&str, i64, f64)]) -> PixelPart {
        let sample = |(point, stamp, error_px): &(&str, i64, f64)| Sample {
            point: PointName((*point).into()),
            timestamp_ns: Stamp::from_nanos(*stamp),
            label_px: Pixel::new(5.0, 5.0),
            tracked_px: Pixel::new(5.0 + error_px, 5.0),
            error_px: *error_px,
        };
        let keyframe = |(point, stamp): (&str, i64)| KeyframePart {
            point: PointName(point.into()),
            timestamp_ns: Stamp::from_nanos(stamp),
            label_px: None,
            depth_z_m: 1.0,
            point_world_m: None,
            on_edge: false,
            triangulated: None,
        };
        PixelPart {
            stream: "s".to_string(),
            role: Role::Estimate,
            depth: "floor".to_string(),
            rmse_px: BTreeMap::new(),
            pooled_rmse_px: None,
            held_rmse_px: None,
            interval_95: None,
            held: None,
            by_age: vec![],
            by_distance: vec![],
            scored: errors.len() as u64,
            skipped: vec![],
            depth_doubts: vec![],
            triangulation: None,
            keyframes: [("a", 0), ("a", 10), ("b", 0), ("b", 10)].map(keyframe).to_vec(),
            samples: errors.iter().map(sample).collect(),
        }
    }

    #[test]
    fn pairs_are_made_by_point_and_stamp() {
        let a = part(&[("a", 1, 3.0), ("a", 2, 4.0), ("b", 1, 1.0)]);
        let b = part(&[("a", 2, 1.0), ("b", 1, 2.0), ("b", 11, 9.0)]);
        let found = paired(&a, &b, 1).unwrap();
        assert_eq!((found.labels, found.only_a, found.only_b, found.moved_labels), (2, 1, 1, 0));
        assert!(
            (found.rmse_a_px - 8.5_f64.sqrt()).abs() < 1e-12
                && (found.rmse_b_px - 2.5_f64.sqrt()).abs() < 1e-12
        );
        assert_eq!((found.mean_difference_px.value, found.b_nearer_share), (-1.0, 0.5));
        assert_eq!(found, paired(&a, &b, 1).unwrap(), "the same on every run");
        assert_eq!(paired(&a, &part(&[("c", 1, 1.0)]), 1), None);
    }

    #[test]
    fn a_clear_difference_excludes_zero_and_one_segment_has_no_interval() {
        let errors = |more: f64| -> Vec<(&'static str, i64, f64)> {
            let each = |i: i64| [("a", i, 2.0 + 0.1 * (i % 3) as f64 + more), ("b", i, 3.0 + more)];
            (1..20).filter(|i| *i != 10).flat_map(each).collect()
        };
        let (a, b) = (part(&errors(0.0)), part(&errors(1.5)));
        let found = paired(&a, &b, 7).unwrap();
        let [low, high] = found.rmse_difference_px.interval_95.unwrap();
        assert!(low > 1.0 && low <= 1.5 + 1e-9 && high >= 1.5 - 1e-9, "{low} {high}");
        assert_eq!((found.points, found.segments), (2, 2));
        let one = part(&[("a", 1, 1.0), ("a", 2, 1.0)]);
        assert_eq!(paired(&one, &one, 7).unwrap().rmse_difference_px.interval_95, None);
    }

    proptest! {
        #[test]
        fn swapping_changes_the_sign(errors in prop::collection::vec((0.0..50.0_f64, 0.0..50.0_f64), 2..30)) {
            let of = |side: fn(&(f64, f64)) -> f64| {
                part(&errors.iter().enumerate().map(|(i, e)| (if i % 2 == 0 { "a" } else { "b" }, 1 + i as i64, side(e))).collect::<Vec<_>>())
            };
            let (a, b) = (of(|e| e.0), of(|e| e.1));
            let (there, back) = (paired(&a, &b, 3).unwrap(), paired(&b, &a, 3).unwrap());
            prop_assert!((there.rmse_difference_px.value + back.rmse_difference_px.value).abs() < 1e-9);
            if let (Some(there), Some(back)) = (there.mean_difference_px.interval_95, back.mean_difference_px.interval_95) {
                prop_assert!((there[0] + back[1]).abs() < 1.0 + there[1] - there[0]);
            }
        }
    }
}
