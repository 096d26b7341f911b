//! The worst moments of a run, each far enough from the others to be one of its own.

use vice_core::result::PointName;
use vice_core::time::{Span, Stamp};

use super::marks::Marks;

/// Moments that a page shows.
const MOST: usize = 10;
/// Frames nearer than this show the same, seconds.
const APART_S: f64 = 0.5;

/// A frame in which a stream is far off.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Moment {
    pub(crate) stamp: Stamp,
    /// The point that is furthest off.
    pub(crate) point: PointName,
    /// The stream, by its place in [`Marks::carriers`].
    pub(crate) carrier: usize,
    pub(crate) error_px: f64,
}

/// The worst sample of each frame, of the estimates or of the reference where there is none.
fn worst_of_frames(marks: &Marks) -> Vec<Moment> {
    let shown = marks.shown();
    let of_frame = |(stamp, points): (&Stamp, &super::marks::FrameMarks)| {
        let samples = points.iter().flat_map(|(point, mark)| {
            let carried = mark.carried.iter().filter(|c| shown.contains(&c.0) && c.2.is_finite());
            carried.map(move |c| (point, c.0, c.2))
        });
        let worst = samples.max_by(|a, b| a.2.total_cmp(&b.2))?;
        Some(Moment { stamp: *stamp, point: worst.0.clone(), carrier: worst.1, error_px: worst.2 })
    };
    marks.frames.iter().filter_map(of_frame).collect()
}

/// The worst moments, the worst first.
pub(crate) fn worst_moments(marks: &Marks) -> Vec<Moment> {
    let mut all = worst_of_frames(marks);
    // Of equal ones the first in time, so that the choice is the same on every run.
    all.sort_by(|a, b| b.error_px.total_cmp(&a.error_px).then(a.stamp.cmp(&b.stamp)));
    let mut kept: Vec<Moment> = Vec::new();
    for moment in all {
        let apart = |other: &Moment| {
            let span: Span = moment.stamp.since(other.stamp);
            span.as_secs_f64().abs() >= APART_S
        };
        if kept.len() < MOST && kept.iter().all(apart) {
            kept.push(moment);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, part, sample};

    #[test]
    fn neighbours_of_a_bad_frame_are_the_same_moment() {
        let tenth = 100_000_000;
        let error = |i: i64| if (20..25).contains(&i) { 50.0 + i as f64 } else { i as f64 / 10.0 };
        let samples: Vec<_> = (0..60).map(|i| sample("a", i * tenth, error(i))).collect();
        let marks = Marks::of(&document(vec![part("e", &samples)]), None).unwrap();
        let moments = worst_moments(&marks);
        let at: Vec<i64> = moments.iter().map(|m| m.stamp.as_nanos() / tenth).collect();
        assert_eq!(at[..3], [24, 59, 54]);
        assert_eq!(moments.len(), 10);
        assert!(at.iter().all(|a| at.iter().all(|b| a == b || (a - b).abs() >= 5)), "{at:?}");
    }

    #[test]
    fn a_reference_is_looked_at_where_it_is_alone() {
        let mut reference = part("truth", &[sample("a", 0, 3.0)]);
        reference.role = vice_core::result::Role::Reference;
        let alone = document(vec![reference.clone()]);
        assert_eq!(worst_moments(&Marks::of(&alone, None).unwrap())[0].error_px, 3.0);
        let both = document(vec![reference, part("e", &[sample("a", 0, 1.0)])]);
        assert_eq!(worst_moments(&Marks::of(&both, None).unwrap())[0].error_px, 1.0);
    }
}
