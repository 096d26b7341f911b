//! Segments of a point: each begins with a key frame, which says what place of the scene the observations up to the next one
//! are of. Edits keep that true.

use vice_core::label::{Observation, ObservationSource};
use vice_core::time::Stamp;

use super::document::{Cell, Document};

/// Cells that delete observations of a point. Where a key frame goes and a part of its segment stays, that part gets a key
/// frame of its own: else it would be taken for what the segment before is of.
pub(super) fn delete(document: &Document, point: &str, wanted: impl Fn(Stamp) -> bool) -> Vec<Cell> {
    let mut cells = Vec::new();
    let mut headless = false;
    for (stamp, o) in document.point(point).into_iter().flatten() {
        if wanted(*stamp) {
            headless |= o.keyframe;
            cells.extend(document.cell(point, *stamp, None));
        } else if headless && (o.keyframe || !o.occluded) {
            headless = false;
            cells.extend(document.cell(point, *stamp, Some(o.as_keyframe())));
        }
    }
    cells
}

/// Cells that begin a segment with `first`, in a gap or in the middle of another one.
///
/// What follows of the other one is of another place of the scene. In a gap its first observation becomes a key frame. In the
/// middle the tracker's observations go, up to the first one that it may not change, which becomes the key frame.
pub(super) fn begin(document: &Document, point: &str, first: Observation) -> Vec<Cell> {
    let stamp = first.stamp;
    let mut cells: Vec<Cell> = document.cell(point, stamp, Some(first.as_keyframe())).into_iter().collect();
    let inside = document.get(point, stamp).is_some();
    let later = document.point(point).into_iter().flatten().filter(|(s, _)| **s > stamp);
    for (stamp, o) in later.take_while(|(_, o)| !o.keyframe) {
        if inside && o.source == ObservationSource::Auto {
            cells.extend(document.cell(point, *stamp, None));
        } else if !o.occluded {
            cells.extend(document.cell(point, *stamp, Some(o.as_keyframe())));
            break;
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;
    use vice_core::camera::Pixel;
    use vice_core::label::{LabelRow, LabelSet};

    use super::*;

    fn stamp(frame: usize) -> Stamp {
        Stamp::from_nanos(1000 * frame as i64)
    }

    /// What is in a frame: nothing, by hand or tracked, a key frame or not, hidden or not.
    fn lane() -> impl Strategy<Value = Vec<Option<(bool, bool, bool)>>> {
        let cell = (any::<bool>(), prop::bool::weighted(0.2), prop::bool::weighted(0.15));
        prop::collection::vec(prop::option::weighted(0.8, cell), 1..16)
    }

    fn document(lane: &[Option<(bool, bool, bool)>]) -> Document {
        let rows = lane.iter().enumerate().filter_map(|(frame, cell)| {
            let (tracked, keyframe, occluded) = (*cell)?;
            let source = if tracked { ObservationSource::Auto } else { ObservationSource::Manual };
            let observation = Observation {
                source,
                keyframe,
                occluded: occluded && !keyframe,
                ..Observation::manual(stamp(frame), Pixel::new(frame as f64, 1.0))
            };
            Some(LabelRow { point: "1".to_string(), observation })
        });
        Document::from_labels(&LabelSet::from_rows(rows).unwrap())
    }

    /// By stamp, which key frame an observation is held against; those that are hidden are held against none.
    fn heads(document: &Document) -> BTreeMap<Stamp, Option<Stamp>> {
        let mut head = None;
        let mut heads = BTreeMap::new();
        for (stamp, o) in document.point("1").into_iter().flatten() {
            if o.keyframe {
                head = Some(*stamp);
            }
            if !o.occluded {
                heads.insert(*stamp, head);
            }
        }
        heads
    }

    /// Nothing that is left may be held against a key frame of another place than before.
    fn keeps_segments(before: &Document, after: &Document) -> Result<(), TestCaseError> {
        let (old, new) = (heads(before), heads(after));
        for (stamp, head) in &new {
            let Some(head) = head else { continue };
            // Both were there before, and of the same place.
            if let (Some(was), Some(of_head)) = (old.get(stamp), old.get(head)) {
                prop_assert_eq!(was, of_head, "{} is held against {}", stamp, head);
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn what_is_left_of_a_segment_stays_apart_from_the_one_before(lane in lane(), from in 0..16_usize, to in 0..16_usize) {
            let before = document(&lane);
            let mut after = before.clone();
            let gone = stamp(from.min(to))..=stamp(from.max(to));
            after.apply(&delete(&before, "1", |s| gone.contains(&s))).unwrap();
            keeps_segments(&before, &after)?;
            let left = before.point("1").into_iter().flatten().filter(|(s, _)| !gone.contains(s)).count();
            prop_assert_eq!(after.point("1").map_or(0, BTreeMap::len), left);
        }

        #[test]
        fn a_new_segment_takes_over_nothing_of_the_old_one(lane in lane(), at in 0..16_usize) {
            let before = document(&lane);
            let mut after = before.clone();
            let first = Observation::manual(stamp(at), Pixel::new(50.0, 50.0));
            after.apply(&begin(&before, "1", first)).unwrap();
            let new = heads(&after);
            prop_assert!(after.get("1", stamp(at)).unwrap().keyframe);
            // Nobody who was there is held against the new place.
            let taken: Vec<_> = new.iter().filter(|(s, head)| **s != stamp(at) && **head == Some(stamp(at))).collect();
            prop_assert!(taken.is_empty(), "{:?}", taken);
            // What a person placed stays.
            for (s, o) in before.point("1").into_iter().flatten() {
                if o.source == ObservationSource::Manual && *s != stamp(at) {
                    prop_assert!(after.get("1", *s).is_some());
                }
            }
        }
    }
}
