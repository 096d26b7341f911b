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
