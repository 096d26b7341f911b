//! The second step: points that a nearer surface hides.

use std::collections::BTreeMap;

use super::interpolate::Seen;

/// Edge of a cell of the z-buffer, pixels.
const CELL_PX: f64 = 4.0;

/// Drops points that lie further behind the nearest one of their cell than `depth_ratio`.
pub(crate) fn visible(seen: Vec<Seen>, depth_ratio: f64) -> Vec<Seen> {
    let cell = |s: &Seen| ((s.u / CELL_PX).floor() as i64, (s.v / CELL_PX).floor() as i64);
    let mut nearest = BTreeMap::new();
    for s in &seen {
        let z = nearest.entry(cell(s)).or_insert(s.z_m);
        *z = s.z_m.min(*z);
    }
    seen.into_iter().filter(|s| s.z_m <= nearest[&cell(s)] * (1.0 + depth_ratio)).collect()
}
