//! A 95 % interval of an RMSE from the sums of its segments: Student's t on the logarithm.
//!
//! A segment, one point's run from one key frame, is the unit: what happens at a key frame stays in all of its samples,
//! so that samples are no independent draws, and points carry nothing of their own that their segments do not.
//! With `S` and `N` the sum of squares and the count of each of `G` segments of `P` points:
//! `theta = ΣS / ΣN`, `u = (S - theta N) / ΣS`, `U` the sum of a point's `u`,
//! `v = max(G/(G-1) Σu², P/(P-1) ΣU², 1/G)` and `nu = 3 (Σu²)² / Σu⁴ - 1` within [2, G-1] (Satterthwaite: few segments that
//! carry most leave few degrees of freedom). Half the width of the interval, on the logarithm, is `t(0.975, nu) √v / 2`.
//! Measured on generated flights it covers 96 %; see docs/evaluate.md.

use std::collections::BTreeMap;

use super::student::quantile_975;

/// Fewer segments than this have no interval.
pub const FEWEST_SEGMENTS: usize = 5;

/// The squared errors of one segment, in the square of the RMSE's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentSum {
    /// Which point it is of; equal numbers are the same point.
    pub point: usize,
    /// Sum of the squared errors.
    pub squares: f64,
    /// Number of samples; a segment without any takes no part.
    pub count: u64,
}

/// An RMSE, and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimated {
    /// Root of the mean square of all samples.
    pub rmse: f64,
    /// Half the width of the 95 % interval on the logarithm; `None` where there are too few segments for one, or where
    /// nothing is off at all.
    pub half_width_log: Option<f64>,
    /// Degrees of freedom that it was taken with.
    pub degrees_of_freedom: Option<f64>,
    /// Segments with a sample.
    pub segments: usize,
    /// Points with a sample.
    pub points: usize,
    /// Samples.
    pub samples: u64,
    /// Share of the squared error that the heaviest segment carries.
    pub heaviest_share: f64,
}

impl Estimated {
    /// The value and its interval; `None` where no segment has a sample, or a sum is no number.
    pub fn of(segments: &[SegmentSum]) -> Option<Self> {
        let used: Vec<SegmentSum> = segments.iter().copied().filter(|s| s.count > 0).collect();
        let samples: u64 = used.iter().map(|s| s.count).sum();
        let squares: f64 = used.iter().map(|s| s.squares).sum();
        if samples == 0 || !squares.is_finite() {
            return None;
        }
        let theta = squares / samples as f64;
        let mut by_point: BTreeMap<usize, f64> = BTreeMap::new();
        let (mut second, mut fourth, mut heaviest) = (0.0, 0.0, 0.0_f64);
        for segment in used.iter().filter(|_| squares > 0.0) {
            let u = (segment.squares - theta * segment.count as f64) / squares;
            second += u * u;
            fourth += u * u * u * u;
            *by_point.entry(segment.point).or_default() += u;
            heaviest = heaviest.max(segment.squares / squares);
        }
        let points = used.iter().map(|s| s.point).collect::<std::collections::BTreeSet<_>>().len();
        let mut found = Self {
            rmse: theta.sqrt(),
            half_width_log: None,
            degrees_of_freedom: None,
            segments: used.len(),
            points,
            samples,
            heaviest_share: heaviest,
        };
        if used.len() < FEWEST_SEGMENTS || squares <= 0.0 {
            return Some(found);
        }
        let (g, p) = (used.len() as f64, points as f64);
        let of_points = by_point.values().map(|u| u * u).sum::<f64>();
        let mut variance = (g / (g - 1.0) * second).max(1.0 / g);
        if points > 1 {
            variance = variance.max(p / (p - 1.0) * of_points);
        }
        // Where all segments say the same there is nothing to be uncertain of the spread of.
        let degrees =
            if fourth > 0.0 { (3.0 * second * second / fourth - 1.0).clamp(2.0, g - 1.0) } else { g - 1.0 };
        found.half_width_log = quantile_975(degrees).map(|t| 0.5 * t * variance.sqrt());
        found.degrees_of_freedom = Some(degrees);
        Some(found)
    }

    /// The ends of the 95 % interval, in the unit of the RMSE.
    pub fn interval_95(&self) -> Option<[f64; 2]> {
        self.half_width_log.map(|h| [self.rmse * (-h).exp(), self.rmse * h.exp()])
    }

    /// About how many segments would bring the half width on the logarithm down to `wanted`.
    pub fn segments_for(&self, wanted: f64) -> Option<usize> {
        self.half_width_log.map(|h| (self.segments as f64 * (h / wanted).powi(2)).ceil() as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn sum(point: usize, squares: f64, count: u64) -> SegmentSum {
        SegmentSum { point, squares, count }
    }

    #[test]
    fn five_segments_by_hand() {
        let list = [sum(0, 40.0, 10), sum(0, 10.0, 10), sum(1, 5.0, 5), sum(1, 30.0, 15), sum(2, 15.0, 10)];
        let found = Estimated::of(&list).unwrap();
        // theta = 100 / 50; u = .2, -.1, -.05, 0, -.05; U = .1, -.05, -.05.
        assert_relative_eq!(found.rmse, 2.0_f64.sqrt(), epsilon = 1e-15);
        let (second, fourth) = (0.055_f64, 0.001_712_5_f64);
        let variance = (1.25 * second).max(1.5 * 0.015).max(0.2);
        let degrees = (3.0 * second * second / fourth - 1.0).clamp(2.0, 4.0);
        assert_relative_eq!(found.degrees_of_freedom.unwrap(), degrees, epsilon = 1e-12);
        let h = 0.5 * quantile_975(degrees).unwrap() * variance.sqrt();
        assert_relative_eq!(found.half_width_log.unwrap(), h, epsilon = 1e-12);
        let [low, high] = found.interval_95().unwrap();
        assert_relative_eq!(low * high, 2.0, epsilon = 1e-12);
        assert_eq!((found.segments, found.points, found.samples), (5, 3, 50));
        assert_relative_eq!(found.heaviest_share, 0.4, epsilon = 1e-15);
        assert_eq!(found.segments_for(h), Some(5));
        assert_eq!(found.segments_for(0.5 * h), Some(20));
    }

    #[test]
    fn few_segments_have_a_value_and_no_interval() {
        let four = Estimated::of(&[sum(0, 4.0, 1); 4]).unwrap();
        assert_eq!((four.rmse, four.interval_95()), (2.0, None));
        assert_eq!(Estimated::of(&[sum(0, 0.0, 0)]), None);
        assert_eq!(Estimated::of(&[sum(0, f64::INFINITY, 1)]), None);
        let exact = Estimated::of(&[sum(0, 0.0, 3); 9]).unwrap();
        assert_eq!((exact.rmse, exact.interval_95()), (0.0, None));
        // A segment without samples is none.
        let mut list = vec![sum(0, 4.0, 1); 4];
        list.push(sum(1, 0.0, 0));
        assert_eq!(Estimated::of(&list).unwrap().segments, 4);
    }

    proptest! {
        #[test]
        fn the_interval_scales_with_the_unit_and_holds_the_value(
            list in prop::collection::vec((0_usize..4, 0.01..100.0_f64, 1_u64..50), 5..40), unit in 0.01..100.0_f64,
        ) {
            let of = |scale: f64| -> Vec<SegmentSum> {
                list.iter().map(|(p, s, n)| sum(*p, scale * scale * s, *n)).collect()
            };
            let (a, b) = (Estimated::of(&of(1.0)).unwrap(), Estimated::of(&of(unit)).unwrap());
            let ([low, high], [low_b, high_b]) = (a.interval_95().unwrap(), b.interval_95().unwrap());
            prop_assert!(low < a.rmse && a.rmse < high);
            prop_assert!((low_b / low / unit - 1.0).abs() < 1e-9 && (high_b / high / unit - 1.0).abs() < 1e-9);
        }
    }
}
