//! RMSE_2D, and its mean and spread over subsets of the points.
//!
//! Squared pixel errors of all scored samples of a set of points are pooled, then averaged, then the root is taken.
//! The paper labels four points and reports sets of 1, 2 and 3 as mean ± standard deviation over all subsets of that
//! size without replacement: that is why its means grow a little and its deviations shrink with the size. The
//! deviation is the population's.

use std::collections::BTreeMap;

use crate::random::SplitMix;

/// Above this many subsets a seeded sample of [`SAMPLED_SUBSETS`] of them is taken.
pub const MAX_SUBSETS: u64 = 1_000_000;
/// How many subsets are sampled where there are more than [`MAX_SUBSETS`].
pub const SAMPLED_SUBSETS: u64 = 100_000;

/// Squared errors of one point, summed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SquaredErrors {
    /// Sum of squared errors, px².
    pub sum_px2: f64,
    /// Number of samples.
    pub count: u64,
}

/// RMSE_2D over the subsets of one size.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SubsetRmse {
    /// Mean over the subsets, pixels.
    pub mean: f64,
    /// Population standard deviation over the subsets, pixels.
    pub std: f64,
    /// How many subsets there are, or were sampled.
    pub subsets: u64,
    /// Whether the subsets are a seeded sample of all.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "std::ops::Not::not"))]
    pub sampled: bool,
}

impl SquaredErrors {
    /// Adds one error.
    #[inline]
    pub fn add(&mut self, error_px: f64) {
        self.sum_px2 += error_px * error_px;
        self.count += 1;
    }
}

/// RMSE_2D of all points together; `None` where nothing was scored.
pub fn pooled_rmse_px(points: &[SquaredErrors]) -> Option<f64> {
    rmse_px(points.iter())
}

fn rmse_px<'a>(points: impl Iterator<Item = &'a SquaredErrors>) -> Option<f64> {
    let (sum, count) = points.fold((0.0, 0), |(s, n), p| (s + p.sum_px2, n + p.count));
    (count > 0).then(|| (sum / count as f64).sqrt())
}

/// RMSE_2D over subsets of each size; `None` where there are fewer scored points than that.
///
/// Points without a scored sample take part in no subset.
pub fn subset_rmse_px(points: &[SquaredErrors], sizes: &[usize]) -> BTreeMap<usize, Option<SubsetRmse>> {
    let scored: Vec<SquaredErrors> = points.iter().copied().filter(|p| p.count > 0).collect();
    sizes.iter().map(|size| (*size, subsets_of_size(&scored, *size))).collect()
}

fn subsets_of_size(points: &[SquaredErrors], size: usize) -> Option<SubsetRmse> {
    if size == 0 || size > points.len() {
        return None;
    }
    let total = binomial(points.len() as u64, size as u64);
    let mut sums = Moments::default();
    let sampled = total > MAX_SUBSETS;
    if sampled {
        let mut random = SplitMix::new(size as u64);
        let mut order: Vec<usize> = (0..points.len()).collect();
        for _ in 0..SAMPLED_SUBSETS {
            // The first `size` places of a partial Fisher-Yates shuffle are a uniform subset.
            for i in 0..size {
                let j = i + random.below((points.len() - i) as u64) as usize;
                order.swap(i, j);
            }
            sums.add(rmse_px(order[..size].iter().map(|i| &points[*i]))?);
        }
    } else {
        let mut chosen: Vec<usize> = (0..size).collect();
        loop {
            sums.add(rmse_px(chosen.iter().map(|i| &points[*i]))?);
            // The next combination in lexical order: advance the last place that still can.
            let Some(place) = (0..size).rev().find(|i| chosen[*i] < points.len() - size + *i) else { break };
            chosen[place] += 1;
            for later in place + 1..size {
                chosen[later] = chosen[later - 1] + 1;
            }
        }
    }
    Some(SubsetRmse { mean: sums.mean, std: sums.std(), subsets: sums.count, sampled })
}

/// `n` over `k`, held at the largest value.
fn binomial(n: u64, k: u64) -> u64 {
    let k = k.min(n - k.min(n));
    let mut value: u128 = 1;
    for i in 0..u128::from(k) {
        value = value * (u128::from(n) - i) / (i + 1);
        if value > u128::from(u64::MAX) {
            return u64::MAX;
        }
    }
    value as u64
}

/// Running mean and sum of squared deviations (Welford), which stays exact where all values are alike.
#[derive(Default)]
struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Moments {
    fn add(&mut self, value: f64) {
        self.count += 1;
        let delta = value - self.mean;
        self.mean += delta / self.count as f64;
        self.squares += delta * (value - self.mean);
    }

    fn std(&self) -> f64 {
        (self.squares / self.count as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn points(errors: &[&[f64]]) -> Vec<SquaredErrors> {
        let one = |errors: &&[f64]| {
            let mut p = SquaredErrors::default();
            errors.iter().for_each(|e| p.add(*e));
            p
        };
        errors.iter().map(one).collect()
    }

    #[test]
    fn subsets_by_hand() {
        let p = points(&[&[3.0, 4.0], &[0.0], &[1.0, 1.0, 1.0], &[]]);
        let rmse = subset_rmse_px(&p, &[1, 2, 3, 4]);
        let one = rmse[&1].unwrap();
        let values = [12.5_f64.sqrt(), 0.0, 1.0];
        let mean = values.iter().sum::<f64>() / 3.0;
        let std = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 3.0).sqrt();
        assert_eq!(one.subsets, 3, "the point without samples takes no part");
        assert_relative_eq!(one.mean, mean, epsilon = 1e-14);
        assert_relative_eq!(one.std, std, epsilon = 1e-14);
        let pairs = [(25.0_f64 / 3.0).sqrt(), (28.0_f64 / 5.0).sqrt(), (3.0_f64 / 4.0).sqrt()];
        assert_relative_eq!(rmse[&2].unwrap().mean, pairs.iter().sum::<f64>() / 3.0, epsilon = 1e-14);
        let all = rmse[&3].unwrap();
        assert_eq!((all.subsets, all.std), (1, 0.0));
        assert_relative_eq!(all.mean, pooled_rmse_px(&p).unwrap(), epsilon = 1e-14);
        assert_eq!(rmse[&4], None);
        assert_eq!(pooled_rmse_px(&points(&[&[], &[]])), None);
    }

    #[test]
    fn many_subsets_are_sampled_and_the_same_on_every_run() {
        let p: Vec<SquaredErrors> =
            (0..400).map(|i| SquaredErrors { sum_px2: f64::from(i % 7), count: 1 + i as u64 % 3 }).collect();
        let (a, b) = (subset_rmse_px(&p, &[3])[&3].unwrap(), subset_rmse_px(&p, &[3])[&3].unwrap());
        assert!(a.sampled && a.subsets == SAMPLED_SUBSETS && a == b);
        assert_eq!(binomial(400, 3), 10_586_800);
        assert_eq!(binomial(1000, 500), u64::MAX);
        assert_eq!(binomial(4, 4), 1);
        let exact = subset_rmse_px(&p[..100], &[3])[&3].unwrap();
        assert!(!exact.sampled && exact.subsets == 161_700);
    }

    proptest! {
        #[test]
        fn all_points_together_are_the_pooled_value(errors in prop::collection::vec(prop::collection::vec(0.0..50.0_f64, 1..5), 1..6)) {
            let refs: Vec<&[f64]> = errors.iter().map(Vec::as_slice).collect();
            let p = points(&refs);
            let all = subset_rmse_px(&p, &[p.len()])[&p.len()].unwrap();
            prop_assert!((all.mean - pooled_rmse_px(&p).unwrap()).abs() < 1e-9);
        }
    }
}
