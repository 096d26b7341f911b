//! The points that cover image and time best.

use std::collections::{BTreeMap, BTreeSet};

use vice_core::camera::Camera;
use vice_core::label::LabelSet;

/// Parts of the image along each side, and of the time.
const PARTS: usize = 6;
const TIMES: usize = 20;

/// Names of the `n` points that together are seen in the most parts of image and time, taken one after the other so
/// that each adds most; at equal gain the one that is labelled more often, then the first in order.
pub(crate) fn best_spread(labels: &LabelSet, camera: &Camera, n: usize) -> Vec<String> {
    let stamps = labels.points().iter().flat_map(|p| &p.observations).map(|o| o.stamp);
    let (Some(first), Some(last)) = (stamps.clone().min(), stamps.max()) else { return vec![] };
    let length = (last - first).as_secs_f64().max(1e-9);
    let part = |at: f64, of: f64, parts: usize| ((at / of * parts as f64).max(0.0) as usize).min(parts - 1);
    let cells: Vec<BTreeSet<(usize, usize, usize)>> = labels
        .points()
        .iter()
        .map(|p| {
            p.observations
                .iter()
                .map(|o| {
                    (
                        part((o.stamp - first).as_secs_f64(), length, TIMES),
                        part(o.px.u + 0.5, f64::from(camera.width()), PARTS),
                        part(o.px.v + 0.5, f64::from(camera.height()), PARTS),
                    )
                })
                .collect()
        })
        .collect();
    // How often a cell is covered already: a second point there is worth half, a third a third.
    let mut covered: BTreeMap<(usize, usize, usize), u32> = BTreeMap::new();
    let mut left: Vec<usize> = (0..cells.len()).collect();
    let mut chosen = Vec::new();
    while chosen.len() < n && !left.is_empty() {
        let gain = |point: usize| {
            cells[point]
                .iter()
                .map(|c| 1.0 / f64::from(1 + covered.get(c).copied().unwrap_or(0)))
                .sum::<f64>()
        };
        let seen = |point: usize| labels.points()[point].observations.len();
        let mut best = 0;
        for candidate in 1..left.len() {
            let (a, b) = (left[candidate], left[best]);
            if gain(a).total_cmp(&gain(b)).then(seen(a).cmp(&seen(b))).is_gt() {
                best = candidate;
            }
        }
        let point = left.remove(best);
        for cell in &cells[point] {
            *covered.entry(*cell).or_default() += 1;
        }
        chosen.push(labels.points()[point].name.clone());
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::camera::{Model, Pixel};
    use vice_core::label::{LabelRow, Observation};
    use vice_core::time::Stamp;

    #[test]
    fn points_far_apart_come_before_neighbours() {
        let camera = Camera::new(600, 600, [500.0, 500.0, 300.0, 300.0], Model::Pinhole).unwrap();
        let at = |name: &str, times: std::ops::Range<i64>, u: f64, v: f64| {
            times
                .map(|t| LabelRow {
                    point: name.to_string(),
                    observation: Observation::manual(Stamp::from_nanos(t * 1_000_000_000), Pixel::new(u, v)),
                })
                .collect::<Vec<_>>()
        };
        let rows = [
            at("a", 0..20, 50.0, 50.0),
            at("b", 0..19, 52.0, 50.0),
            at("c", 0..18, 550.0, 50.0),
            at("d", 5..20, 300.0, 550.0),
        ];
        let labels = LabelSet::from_rows(rows.concat()).unwrap();
        assert_eq!(best_spread(&labels, &camera, 3), ["a", "c", "d"]);
        assert_eq!(best_spread(&labels, &camera, 9).len(), 4);
    }
}
