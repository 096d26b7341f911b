//! The range of an axis, where its marks stand, and what they say. Takes any numbers: documents come from anywhere.

/// Values beyond this are held at it, so that no sum or difference of them overflows.
const LARGEST: f64 = 1e150;

/// A range with round marks in it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    ticks: Vec<f64>,
    decimals: usize,
    exponent: bool,
}

impl Axis {
    /// A range that covers the finite ones of the values, with about `wanted` round marks, its ends on marks.
    pub(crate) fn covering(values: impl IntoIterator<Item = f64>, wanted: usize) -> Self {
        let (low, high) = limits(values);
        let step = round_step((high - low) / wanted.max(1) as f64);
        Self::stepped((low / step).floor() * step, (high / step).ceil() * step, step)
    }

    /// As [`Axis::covering`], but from zero on.
    pub(crate) fn from_zero(values: impl IntoIterator<Item = f64>, wanted: usize) -> Self {
        Self::covering(values.into_iter().filter(|v| *v >= 0.0).chain([0.0]), wanted)
    }

    /// Exactly the range of the values, round marks inside.
    pub(crate) fn exactly(values: impl IntoIterator<Item = f64>, wanted: usize) -> Self {
        let (low, high) = limits(values);
        Self::stepped(low, high, round_step((high - low) / wanted.max(1) as f64))
    }

    fn stepped(low: f64, high: f64, step: f64) -> Self {
        let slack = step * 1e-6;
        let first = ((low - slack) / step).ceil();
        let ticks: Vec<f64> =
            (0..64).map(|i| (first + f64::from(i)) * step).take_while(|t| *t <= high + slack).collect();
        let magnitude = step.log10().floor();
        let exponent = !(-5.0..6.0).contains(&magnitude) || low.abs().max(high.abs()) >= 1e7;
        let decimals = if exponent { 1 } else { (-magnitude).max(0.0) as usize };
        Self { low, high, ticks, decimals, exponent }
    }

    /// Where a value lies: 0 at the low end, 1 at the high end, held within.
    pub(crate) fn place(&self, value: f64) -> f64 {
        let place = (value.clamp(-LARGEST, LARGEST) - self.low) / (self.high - self.low);
        if place.is_finite() { place.clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Its ends.
    pub(crate) const fn ends(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// Length of the range.
    pub(crate) fn span(&self) -> f64 {
        self.high - self.low
    }

    /// The middle of the range.
    pub(crate) fn middle(&self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// The marks and what they say.
    pub(crate) fn ticks(&self) -> impl Iterator<Item = (f64, String)> + '_ {
        self.ticks.iter().map(|t| (*t, self.label(*t)))
    }

    fn label(&self, value: f64) -> String {
        if self.exponent {
            return format!("{value:.1e}");
        }
        let text = format!("{value:.*}", self.decimals);
        // Minus zero is zero.
        if text.trim_start_matches('-').trim_matches(['0', '.']).is_empty() {
            text.trim_start_matches('-').to_string()
        } else {
            text.replace('-', "−")
        }
    }
}

/// Lowest and highest finite value, made apart where they are the same.
fn limits(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = values.into_iter().filter(|v| v.is_finite()).map(|v| v.clamp(-LARGEST, LARGEST));
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return (0.0, 1.0);
    }
    // Closer than their own rounding is the same.
    let least = 1e-9 * low.abs().max(high.abs()).max(1e-9);
    if high - low >= least {
        return (low, high);
    }
    if low == 0.0 { (0.0, 1.0) } else { (low - 0.5 * low.abs(), high + 0.5 * high.abs()) }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below.
fn round_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|f| f * power).find(|s| *s >= least * (1.0 - 1e-9));
    step.filter(|s| s.is_normal()).unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn marks_are_round() {
        let labels = |a: Axis| a.ticks().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(labels(Axis::from_zero([97.0], 5)), ["0", "20", "40", "60", "80", "100"]);
        assert_eq!(
            labels(Axis::covering([-0.03, 0.02], 5)),
            ["−0.03", "−0.02", "−0.01", "0.00", "0.01", "0.02"]
        );
        assert_eq!(labels(Axis::exactly([0.4, 2.1], 4)), ["0.5", "1.0", "1.5", "2.0"]);
        assert_eq!(labels(Axis::from_zero([], 2)), ["0.0", "0.5", "1.0"]);
        assert_eq!(labels(Axis::covering([7.0], 2)), ["0", "5", "10", "15"]);
    }

    proptest! {
        #[test]
        fn any_numbers_make_an_axis(values in prop::collection::vec(any::<f64>(), 0..5), wanted in 1..8_usize) {
            for axis in [Axis::covering(values.clone(), wanted), Axis::exactly(values.clone(), wanted), Axis::from_zero(values.clone(), wanted)] {
                prop_assert!(axis.ticks().count() <= 64);
                prop_assert!(axis.span() > 0.0 && axis.span().is_finite());
                for value in &values {
                    prop_assert!((0.0..=1.0).contains(&axis.place(*value)));
                }
            }
        }
    }
}
