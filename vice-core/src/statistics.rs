//! Quantiles, medians and intervals by resampling: the one home of these rules.
//!
//! A quantile that is shown to anyone is interpolated ([`quantile`], NumPy's default rule), and the median is the
//! quantile at one half. Where a threshold needs a value that was really measured, such as a time between two frames,
//! it is [`middle`] that is meant, and its name says so.

use std::cmp::Ordering;

use crate::parallel::*;
use crate::random::SplitMix;

/// A number with the middle 95 % of its resampled values.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WithInterval {
    /// The number.
    pub value: f64,
    /// The ends of the interval, low and high; `None` where there was nothing to resample.
    pub interval_95: Option<[f64; 2]>,
}

impl WithInterval {
    /// A number, and the values that it took when the data was resampled, in any order.
    pub fn of(value: f64, resampled: Vec<f64>) -> Self {
        let sorted = sorted(resampled);
        let ends = quantile(&sorted, 0.025).zip(quantile(&sorted, 0.975));
        Self { value, interval_95: ends.map(|(low, high)| [low, high]) }
    }
}

/// Resamples data and keeps what `draw` makes of each resample; what is `None` is left out. The same seed draws the
/// same on every machine.
pub fn bootstrap<T>(resamples: usize, seed: u64, mut draw: impl FnMut(&mut SplitMix) -> Option<T>) -> Vec<T> {
    let mut random = SplitMix::new(seed);
    (0..resamples).filter_map(|_| draw(&mut random)).collect()
}

/// The value below which a share (0 to 1) of the values lies, linear between the two nearest; `None` of nothing. The
/// values are sorted already.
///
/// ```
/// use vice_core::statistics::quantile;
///
/// assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.75), Some(3.0));
/// assert_eq!(quantile(&[], 0.5), None);
/// ```
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let (low, high) = (place.floor() as usize, place.ceil() as usize);
    Some(sorted[low] + (sorted[high] - sorted[low]) * (place - low as f64))
}

/// The median, between the middle two of an even number; `None` of nothing. In O(n); changes the order.
pub fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let even = values.len().is_multiple_of(2);
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(if even {
        f64::midpoint(below.iter().copied().fold(f64::NEG_INFINITY, f64::max), upper)
    } else {
        upper
    })
}

/// A number whose order its leading bits tell, where it is not negative.
pub(crate) trait Leading: Copy + Into<f64> {
    /// The sixteen first bits of a number that is not negative.
    fn leading(self) -> usize;
}

impl Leading for f32 {
    #[inline]
    fn leading(self) -> usize {
        (self.to_bits() >> 16) as usize
    }
}

impl Leading for f64 {
    #[inline]
    fn leading(self) -> usize {
        (self.to_bits() >> 48) as usize
    }
}

/// How many leading bits tell apart.
const LEADING: usize = 1 << 16;

/// Numbers in several slices, none of which is negative, counted by their leading bits: ranks are found in one more pass and
/// without a copy of them all.
pub(crate) struct Counted<'a, T, W> {
    parts: &'a [&'a [T]],
    wanted: W,
    counts: Vec<u64>,
    /// How many are wanted.
    pub(crate) total: u64,
}

impl<'a, T: Leading + Sync, W: Fn(&T) -> bool + Sync> Counted<'a, T, W> {
    /// Counts those that are wanted.
    pub(crate) fn new(parts: &'a [&'a [T]], wanted: W) -> Self {
        let some = parts.len().div_ceil(current_num_threads()).max(1);
        let chunks: Vec<&[&[T]]> = parts.chunks(some).collect();
        let of_chunk = |chunk: &&[&[T]]| {
            let mut counts = vec![0_u64; LEADING];
            for value in chunk.iter().flat_map(|part| part.iter()).filter(|v| wanted(v)) {
                counts[value.leading()] += 1;
            }
            counts
        };
        let all: Vec<Vec<u64>> = chunks.par_iter().map(of_chunk).collect();
        let mut counts = vec![0_u64; LEADING];
        for of_chunk in all {
            counts.iter_mut().zip(of_chunk).for_each(|(sum, count)| *sum += count);
        }
        let total = counts.iter().sum();
        Self { parts, wanted, counts, total }
    }

    /// The values at some ranks, ascending from 0; ranks ascend and are below the number of values.
    pub(crate) fn at_ranks(&self, ranks: &[u64]) -> Vec<f64> {
        let mut found = Vec::new();
        // The numbers that share their leading bits, which were gathered last.
        let (mut of, mut alike): (usize, Vec<f64>) = (LEADING, Vec::new());
        for rank in ranks {
            let (mut bucket, mut before) = (0, 0);
            while bucket + 1 < LEADING && before + self.counts[bucket] <= *rank {
                before += self.counts[bucket];
                bucket += 1;
            }
            if bucket != of {
                of = bucket;
                alike = self.with_leading(bucket);
            }
            let at = usize::try_from(rank - before).unwrap_or(usize::MAX);
            if at < alike.len() {
                found.push(*alike.select_nth_unstable_by(at, f64::total_cmp).1);
            }
        }
        found
    }

    fn with_leading(&self, bucket: usize) -> Vec<f64> {
        let of_part = |part: &&[T]| -> Vec<f64> {
            let alike = part.iter().filter(|v| v.leading() == bucket && (self.wanted)(v));
            alike.map(|v| (*v).into()).collect()
        };
        let all: Vec<Vec<f64>> = self.parts.par_iter().map(of_part).collect();
        all.concat()
    }

    /// Their [`median`].
    pub(crate) fn median(&self) -> Option<f64> {
        let middle = self.total / 2;
        match (self.total, self.total.is_multiple_of(2)) {
            (0, _) => None,
            (_, false) => self.at_ranks(&[middle]).first().copied(),
            (_, true) => match self.at_ranks(&[middle - 1, middle])[..] {
                [lower, upper] => Some(f64::midpoint(lower, upper)),
                _ => None,
            },
        }
    }
}

/// The value in the middle, the upper one of the middle two: one of the values itself. `None` of nothing. In O(n);
/// changes the order.
pub fn middle<T: Copy>(values: &mut [T], compare: impl FnMut(&T, &T) -> Ordering) -> Option<T> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, compare).1)
}

/// Values in ascending order.
pub fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn quantiles_are_those_of_numpy() {
        // numpy.quantile([7.4, 9.8, 11.5, 12.1, 13.5, 28.9, 34.3, 73.4], [0.05, 0.25, 0.5, 0.95])
        let values = [7.4, 9.8, 11.5, 12.1, 13.5, 28.9, 34.3, 73.4];
        for (share, expected) in [(0.05, 8.24), (0.25, 11.075), (0.5, 12.8), (0.95, 59.715)] {
            assert!((quantile(&values, share).unwrap() - expected).abs() < 1e-12, "{share}");
        }
        assert_eq!((quantile(&[], 0.5), quantile(&[3.0], 0.9)), (None, Some(3.0)));
    }

    #[test]
    fn an_interval_needs_something_to_draw_from() {
        assert_eq!(WithInterval::of(1.0, vec![]).interval_95, None);
        let drawn = bootstrap(1000, 1, |random| Some(random.below(1001) as f64));
        let [low, high] = WithInterval::of(500.0, drawn).interval_95.unwrap();
        assert!(low < 60.0 && high > 940.0, "{low} {high}");
    }

    proptest! {
        #[test]
        fn the_median_is_the_quantile_at_one_half(values in prop::collection::vec(-1e3..1e3_f64, 0..30)) {
            let sorted = sorted(values.clone());
            let (median, quantile) = (median(&mut values.clone()), quantile(&sorted, 0.5));
            prop_assert_eq!(median.is_some(), quantile.is_some());
            prop_assert!((median.unwrap_or(0.0) - quantile.unwrap_or(0.0)).abs() < 1e-9);
            prop_assert_eq!(middle(&mut values.clone(), f64::total_cmp), sorted.get(sorted.len() / 2).copied());
        }

        #[test]
        fn in_parts_it_is_the_same(values in prop::collection::vec(prop::sample::select(vec![0.0, 1e-300, 0.5, 0.50001, 1.0, 7.25, 1e9]), 0..40), cut in 0_usize..40) {
            let cut = cut.min(values.len());
            let parts = [&values[..cut], &values[cut..]];
            prop_assert_eq!(Counted::new(&parts, |_| true).median(), median(&mut values.clone()));
            let above: Vec<f64> = values.iter().copied().filter(|v| *v > 0.0).collect();
            let counted = Counted::new(&parts, |v| *v > 0.0);
            prop_assert_eq!((counted.total, counted.median()), (above.len() as u64, median(&mut above.clone())));
            let sorted = sorted(values.clone());
            let ranks: Vec<u64> = (0..values.len() as u64).collect();
            prop_assert_eq!(Counted::new(&parts, |_| true).at_ranks(&ranks), sorted);
            let floats: Vec<f32> = values.iter().map(|v| *v as f32).collect();
            let mut wide: Vec<f64> = floats.iter().map(|v| f64::from(*v)).collect();
            prop_assert_eq!(Counted::new(&[&floats[..]], |_| true).median(), median(&mut wide));
        }
    }
}
