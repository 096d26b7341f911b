//! Which point of one set is which of the other.

use std::collections::BTreeMap;

use vice_core::label::{LabelSet, PointLabels};
use vice_core::statistics::median;
use vice_core::time::Stamp;

/// Points of different names are the same where they lie this near (the median over the frames of both), pixels.
const SAME_PX: f64 = 5.0;
/// In so many frames at least.
const SAME_FRAMES: usize = 3;

/// Points of both by their names; where no name is in both, by where they are: the nearest ones first.
pub(super) fn pairs<'a>(a: &'a LabelSet, b: &'a LabelSet) -> Vec<(&'a PointLabels, &'a PointLabels)> {
    let named: Vec<_> = a
        .points()
        .iter()
        .filter_map(|one| Some((one, b.points().iter().find(|other| other.name == one.name)?)))
        .collect();
    if !named.is_empty() {
        return named;
    }
    let mut near: Vec<(f64, usize, usize)> = Vec::new();
    for (j, other) in b.points().iter().enumerate() {
        let places: BTreeMap<Stamp, _> = other.observations.iter().map(|o| (o.stamp, o.px)).collect();
        for (i, one) in a.points().iter().enumerate() {
            let mut apart: Vec<f64> = one
                .observations
                .iter()
                .filter_map(|o| Some(places.get(&o.stamp)?.distance_px(o.px)))
                .collect();
            if apart.len() >= SAME_FRAMES
                && let Some(px) = median(&mut apart).filter(|px| *px <= SAME_PX)
            {
                near.push((px, i, j));
            }
        }
    }
    near.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut taken: (Vec<usize>, Vec<usize>) = Default::default();
    for (_, i, j) in near {
        if !taken.0.contains(&i) && !taken.1.contains(&j) {
            taken.0.push(i);
            taken.1.push(j);
        }
    }
    let mut found: Vec<(usize, usize)> = taken.0.into_iter().zip(taken.1).collect();
    found.sort_unstable();
    found.into_iter().map(|(i, j)| (&a.points()[i], &b.points()[j])).collect()
}
