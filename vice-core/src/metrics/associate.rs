//! Which pose of an estimate belongs to which pose of the reference.
//!
//! [`associate`] pairs the poses that are nearest in time, one to one; [`PosePairs`] is what every trajectory metric
//! works on, whether its poses were paired here, interpolated, or taken at the same frames.

use crate::error::{DataError, DataResult};
use crate::frames::WorldFromBody;
use crate::time::{Span, Stamp};
use crate::time_unit::{own_start, suspect_unit};
use crate::trajectory::Trajectory;

/// How poses of the reference are found for poses of the estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Matching {
    /// The nearest pose of the reference, one to one; see [`associate`].
    Nearest {
        /// The largest time difference that still pairs two poses.
        t_max_diff: Span,
    },
    /// The reference interpolated at the stamps of the estimate, linear in position and slerp in rotation.
    Interpolate {
        /// The widest gap between two poses of the reference that is interpolated over.
        max_gap: Span,
    },
}

/// Indices of two poses that belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexPair {
    /// Index in the reference.
    pub reference: usize,
    /// Index in the estimate.
    pub estimate: usize,
}

/// Poses of a reference and an estimate at the same instants: not empty, finite, in order of time.
///
/// Each stream has its own world frame until the estimate was aligned ([`crate::metrics::align`]).
#[derive(Clone, Debug, PartialEq)]
pub struct PosePairs {
    stamps: Vec<Stamp>,
    reference: Vec<WorldFromBody>,
    estimate: Vec<WorldFromBody>,
}

/// Pairs each pose of the estimate with the reference pose nearest in time, one to one.
///
/// `t_offset` is added to the estimate's stamps first. Candidates are each estimate pose's nearest reference pose (the
/// earlier of two at the same distance) with `|Δt| <= t_max_diff`. They are accepted by growing `|Δt|`, ties to the
/// earlier stamps, and each pose is used once. The pairs come in order of time. Costs O(n log m).
///
/// # Errors
/// [`DataError`] if nothing matches; it prints both time ranges and the unit that may be mixed up.
pub fn associate(
    reference: &Trajectory,
    estimate: &Trajectory,
    t_max_diff: Span,
    t_offset: Span,
) -> DataResult<Vec<IndexPair>> {
    let mut pairs: Vec<IndexPair> = Vec::with_capacity(reference.len().min(estimate.len()));
    let mut last_difference = Span::MAX;
    for (index, stamp) in estimate.stamps().iter().enumerate() {
        let stamp = *stamp + t_offset;
        let nearest = reference.nearest(stamp);
        let difference = (stamp - reference.stamps()[nearest]).abs();
        if difference > t_max_diff {
            continue;
        }
        // An estimate pose has one candidate only, and the nearest reference never runs backwards: so poses contend
        // for a reference pose only with their neighbours in time, and the smallest difference wins it.
        match pairs.last_mut() {
            Some(last) if last.reference == nearest => {
                if difference < last_difference {
                    last.estimate = index;
                    last_difference = difference;
                }
            }
            _ => {
                pairs.push(IndexPair { reference: nearest, estimate: index });
                last_difference = difference;
            }
        }
    }
    if pairs.is_empty() {
        return Err(nothing_matches(
            reference,
            estimate,
            t_offset,
            &format!("no two poses are within {t_max_diff}"),
        ));
    }
    Ok(pairs)
}

/// The part of a trajectory between two stamps, both included; `None` leaves that end as it is.
///
/// # Errors
/// [`DataError`] where no pose is left; it prints the range there is.
pub fn crop(trajectory: &Trajectory, t_start: Option<Stamp>, t_end: Option<Stamp>) -> DataResult<Trajectory> {
    let (start, end) = (trajectory.start(), trajectory.end());
    let (first, last) = (t_start.unwrap_or(start), t_end.unwrap_or(end));
    trajectory.between(first, last).ok_or_else(|| {
        DataError::new(format!(
            "no pose lies between {} s and {} s: the trajectory goes from {} s to {} s",
            first.to_seconds_text(),
            last.to_seconds_text(),
            start.to_seconds_text(),
            end.to_seconds_text()
        ))
    })
}

impl PosePairs {
    /// Pairs from streams that were read at the same stamps: `(stamp, reference, estimate)`.
    ///
    /// # Errors
    /// [`DataError`] if there are none, a pose is not finite, or the stamps do not increase.
    pub fn new(pairs: impl IntoIterator<Item = (Stamp, WorldFromBody, WorldFromBody)>) -> DataResult<Self> {
        let pairs = pairs.into_iter();
        let n = pairs.size_hint().0;
        let mut all = Self {
            stamps: Vec::with_capacity(n),
            reference: Vec::with_capacity(n),
            estimate: Vec::with_capacity(n),
        };
        for (stamp, reference, estimate) in pairs {
            if all.stamps.last().is_some_and(|last| *last >= stamp) {
                return Err(DataError::new(format!("the paired poses do not go on in time at {stamp} ns")));
            }
            for (pose, name) in [(&reference, "reference"), (&estimate, "estimate")] {
                let finite = pose.translation().iter().all(|v| v.is_finite())
                    && pose.rotation().coords.iter().all(|v| v.is_finite());
                if !finite {
                    return Err(DataError::new(format!(
                        "the pose of the {name} at {stamp} ns is not finite"
                    )));
                }
            }
            all.stamps.push(stamp);
            all.reference.push(reference);
            all.estimate.push(estimate);
        }
        if all.stamps.is_empty() { Err(DataError::new("no poses to compare")) } else { Ok(all) }
    }

    /// Matches an estimate with a reference; `t_offset` is added to the estimate's stamps.
    ///
    /// The stamps of the result are the reference's, or the estimate's with the offset where the reference is
    /// interpolated.
    ///
    /// # Errors
    /// [`DataError`] if nothing matches, as [`associate`].
    pub fn match_up(
        reference: &Trajectory,
        estimate: &Trajectory,
        matching: Matching,
        t_offset: Span,
    ) -> DataResult<Self> {
        match matching {
            Matching::Nearest { t_max_diff } => {
                let pairs = associate(reference, estimate, t_max_diff, t_offset)?;
                Self::new(pairs.into_iter().map(|p| {
                    let stamp = reference.stamps()[p.reference];
                    (stamp, reference.poses()[p.reference], estimate.poses()[p.estimate])
                }))
            }
            Matching::Interpolate { max_gap } => {
                let pairs: Vec<_> = estimate
                    .iter()
                    .filter_map(|(stamp, pose)| {
                        let stamp = stamp + t_offset;
                        reference.pose_at(stamp, max_gap).ok().map(|at| (stamp, at, pose))
                    })
                    .collect();
                if pairs.is_empty() {
                    let what = format!(
                        "no pose of the estimate lies between two of the reference at most {max_gap} apart"
                    );
                    return Err(nothing_matches(reference, estimate, t_offset, &what));
                }
                Self::new(pairs)
            }
        }
    }

    /// As [`PosePairs::match_up`], in the memory of the trajectories where the nearest poses are taken.
    ///
    /// # Errors
    /// As [`PosePairs::match_up`].
    pub fn match_up_owned(
        reference: Trajectory,
        estimate: Trajectory,
        matching: Matching,
        t_offset: Span,
    ) -> DataResult<Self> {
        let Matching::Nearest { t_max_diff } = matching else {
            return Self::match_up(&reference, &estimate, matching, t_offset);
        };
        let pairs = associate(&reference, &estimate, t_max_diff, t_offset)?;
        let (mut stamps, mut reference) = reference.into_parts();
        let (_, mut estimate) = estimate.into_parts();
        // Both indices only grow, so that what is read lies at or behind what is written.
        for (k, pair) in pairs.iter().enumerate() {
            stamps[k] = stamps[pair.reference];
            reference[k] = reference[pair.reference];
            estimate[k] = estimate[pair.estimate];
        }
        stamps.truncate(pairs.len());
        reference.truncate(pairs.len());
        estimate.truncate(pairs.len());
        Ok(Self { stamps, reference, estimate })
    }

    /// Number of pairs, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "pairs are never empty")]
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Stamps, strictly increasing.
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// Poses of the reference, one for each stamp.
    pub fn reference(&self) -> &[WorldFromBody] {
        &self.reference
    }

    /// Poses of the estimate, one for each stamp.
    pub fn estimate(&self) -> &[WorldFromBody] {
        &self.estimate
    }

    /// Reference and estimate together.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&WorldFromBody, &WorldFromBody)> + '_ {
        self.reference.iter().zip(&self.estimate)
    }

    /// The same pairs with each pose of the estimate changed.
    #[must_use]
    pub fn map_estimate(&self, f: impl FnMut(&WorldFromBody) -> WorldFromBody) -> Self {
        Self {
            stamps: self.stamps.clone(),
            reference: self.reference.clone(),
            estimate: self.estimate.iter().map(f).collect(),
        }
    }

    /// Changes each pose of the estimate.
    pub(crate) fn change_estimate(&mut self, f: impl Fn(&WorldFromBody) -> WorldFromBody) {
        self.estimate.iter_mut().for_each(|pose| *pose = f(pose));
    }

    /// The same pairs with each pose of both streams changed.
    #[must_use]
    pub fn map_both(&self, mut f: impl FnMut(&WorldFromBody) -> WorldFromBody) -> Self {
        Self {
            stamps: self.stamps.clone(),
            reference: self.reference.iter().map(&mut f).collect(),
            estimate: self.estimate.iter().map(&mut f).collect(),
        }
    }
}

/// The error of streams that have nothing in common in time.
fn nothing_matches(reference: &Trajectory, estimate: &Trajectory, t_offset: Span, what: &str) -> DataError {
    let (r0, r1) = (reference.start(), reference.end());
    let (e0, e1) = (estimate.start() + t_offset, estimate.end() + t_offset);
    let offset =
        if t_offset == Span::ZERO { String::new() } else { format!(" with the offset of {t_offset}") };
    let error = DataError::new(format!(
        "{what}: the reference goes from {} s to {} s, the estimate{offset} from {} s to {} s",
        r0.to_seconds_text(),
        r1.to_seconds_text(),
        e0.to_seconds_text(),
        e1.to_seconds_text()
    ));
    if let Some(mixed_up) = suspect_unit((r0, r1), (e0, e1)) {
        return error.hint(format!("the estimate's times look like {mixed_up}"));
    }
    if let Some(offset) = own_start((r0, r1), (e0, e1)) {
        let (own, epoch) = if e0 < r0 { ("estimate", "reference") } else { ("reference", "estimate") };
        return error.hint(format!(
            "the {own}'s stamps count from its own start, the {epoch}'s from 1970: an offset of {} s, as --t-offset takes \
             it, would put both starts together",
            (t_offset + offset).to_seconds_text()
        ));
    }
    if e1 < r0 || r1 < e0 {
        return error.hint("the two do not overlap in time; are their clocks the same?");
    }
    let spacing = |t: &Trajectory| match t.median_spacing() {
        Some(spacing) => format!("every {} s", spacing.to_short_text()),
        None => "once".to_string(),
    };
    let away = estimate.stamps().iter().map(|stamp| {
        let stamp = *stamp + t_offset;
        reference.stamps()[reference.nearest(stamp)].since(stamp).abs()
    });
    error.hint(format!(
        "the two overlap, but their stamps are further apart than that: the reference has a pose {}, the estimate {}, \
         and the nearest two are {} s apart",
        spacing(reference),
        spacing(estimate),
        away.min().map_or_else(String::new, Span::to_short_text)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Rigid;
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn at(nanos: impl IntoIterator<Item = i64>) -> Trajectory {
        Trajectory::from_poses(nanos.into_iter().map(|n| {
            let pose = Rigid::from_parts(Vector3::new(n as f64, 0.0, 0.0), UnitQuaternion::identity());
            (Stamp::from_nanos(n), pose)
        }))
        .unwrap()
    }

    fn pairs(reference: &[i64], estimate: &[i64], max: i64) -> Vec<(usize, usize)> {
        let (r, e) = (at(reference.iter().copied()), at(estimate.iter().copied()));
        let pairs = associate(&r, &e, Span::from_nanos(max), Span::ZERO).unwrap();
        pairs.iter().map(|p| (p.reference, p.estimate)).collect()
    }

    #[test]
    fn each_pose_is_used_once_and_the_nearest_wins() {
        assert_eq!(pairs(&[0, 100], &[-3, 2, 4, 99], 10), [(0, 1), (1, 3)]);
        assert_eq!(pairs(&[0], &[-2, 2], 10), [(0, 0)], "ties go to the earlier");
        assert_eq!(pairs(&[0, 4], &[2], 10), [(0, 0)], "ties go to the earlier");
        assert_eq!(pairs(&[0, 100], &[10, 89], 10), [(0, 0)], "the limit itself still matches");
    }

    proptest! {
        #[test]
        fn matching_in_place_is_matching(
            reference in prop::collection::btree_set(0..300_i64, 1..60),
            estimate in prop::collection::btree_set(0..300_i64, 1..60),
            max in 0..8_i64,
            offset in -5..5_i64,
            interpolate in any::<bool>(),
        ) {
            let (r, e) = (at(reference), at(estimate));
            let max = Span::from_nanos(max);
            let matching = match interpolate {
                true => Matching::Interpolate { max_gap: max },
                false => Matching::Nearest { t_max_diff: max },
            };
            let offset = Span::from_nanos(offset);
            let beside = PosePairs::match_up(&r, &e, matching, offset).map_err(|e| e.to_string());
            let owned = PosePairs::match_up_owned(r, e, matching, offset).map_err(|e| e.to_string());
            prop_assert_eq!(owned, beside);
        }
    }

    #[test]
    fn the_offset_goes_onto_the_estimate() {
        let (r, e) = (at([1000, 2000]), at([0, 1000]));
        let moved = associate(&r, &e, Span::from_nanos(1), Span::from_nanos(1000)).unwrap();
        assert_eq!(moved.len(), 2);
        let interpolated = PosePairs::match_up(
            &r,
            &e,
            Matching::Interpolate { max_gap: Span::from_nanos(1000) },
            Span::from_nanos(500),
        )
        .unwrap();
        assert_eq!(interpolated.stamps(), [Stamp::from_nanos(1500)]);
        assert_eq!(interpolated.reference()[0].translation().x, 1500.0);
        assert_eq!(interpolated.estimate()[0].translation().x, 1000.0);
        let gap = Matching::Interpolate { max_gap: Span::from_nanos(999) };
        assert!(PosePairs::match_up(&r, &e, gap, Span::from_nanos(500)).is_err());
    }

    #[test]
    fn the_wrong_unit_is_suspected() {
        let t0 = 1_403_715_278_000_000_000_i64;
        let reference = at([t0, t0 + 2_000_000_000]);
        let error = |n: &[i64]| {
            let estimate = at(n.iter().copied());
            associate(&reference, &estimate, Span::from_millis(10), Span::ZERO).unwrap_err().to_string()
        };
        let seconds = error(&[1_403_715_278, 1_403_715_280]);
        assert!(seconds.contains("from 1403715278.000000000 s to 1403715280.000000000 s"), "{seconds}");
        assert!(seconds.contains("look like seconds read as nanoseconds"), "{seconds}");
        assert!(error(&[t0 / 1_000_000]).contains("look like milliseconds read as nanoseconds"));
        assert!(error(&[t0 / 1000]).contains("look like microseconds read as nanoseconds"));
        assert!(error(&[t0 + 60_000_000_000]).contains("do not overlap in time"));
        assert!(error(&[t0 + 1_000_000_000]).contains("the two overlap"));
        let sparse = error(&[t0 + 1_000_000_000]);
        assert!(
            sparse.contains(
                "the reference has a pose every 2 s, the estimate once, and the nearest two are 1 s"
            ),
            "{sparse}"
        );
        let own_start = error(&[0, 2_950_000_000]);
        assert!(
            own_start.contains("counts from its own start") || own_start.contains("count from its own start")
        );
        assert!(
            own_start.contains("an offset of 1403715278.000000000 s") && !own_start.contains("seconds read")
        );
        // Times since the start: the range shows it, the epoch does not.
        let (r, e) = (at([100_000_000_000, 200_000_000_000]), at([100, 200]));
        let error = associate(&r, &e, Span::from_millis(10), Span::ZERO).unwrap_err().to_string();
        assert!(error.contains("look like seconds read as nanoseconds"), "{error}");
    }

    #[test]
    fn cropping_to_nothing_says_what_there_is() {
        let t = at([1_000_000_000, 2_000_000_000]);
        assert_eq!(crop(&t, Some(Stamp::from_nanos(1_500_000_000)), None).unwrap().len(), 1);
        let error = crop(&t, Some(Stamp::from_nanos(3_000_000_000)), None).unwrap_err().to_string();
        assert!(error.contains("from 1.000000000 s to 2.000000000 s"), "{error}");
    }

    /// The definition, spelt out: all candidates sorted by difference, then the stamps.
    fn by_definition(r: &Trajectory, e: &Trajectory, max: Span) -> Vec<(usize, usize)> {
        let mut candidates: Vec<_> = e
            .stamps()
            .iter()
            .enumerate()
            .map(|(i, s)| ((*s - r.stamps()[r.nearest(*s)]).abs(), i, r.nearest(*s)))
            .filter(|c| c.0 <= max)
            .collect();
        candidates.sort();
        let mut used = vec![false; r.len()];
        let mut pairs: Vec<_> = candidates
            .into_iter()
            .filter(|c| !std::mem::replace(&mut used[c.2], true))
            .map(|c| (c.2, c.1))
            .collect();
        pairs.sort_unstable();
        pairs
    }

    proptest! {
        #[test]
        fn association_is_one_to_one_and_as_defined(
            r in prop::collection::btree_set(0..400_i64, 1..60),
            e in prop::collection::btree_set(0..400_i64, 1..60),
            max in 0..30_i64,
        ) {
            let (r, e, max) = (at(r), at(e), Span::from_nanos(max));
            let got: Vec<_> = associate(&r, &e, max, Span::ZERO)
                .map(|p| p.iter().map(|p| (p.reference, p.estimate)).collect())
                .unwrap_or_default();
            prop_assert!(got.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 < w[1].1));
            prop_assert_eq!(got, by_definition(&r, &e, max));
        }
    }
}
