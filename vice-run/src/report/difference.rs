//! A difference with its interval, in words.

use vice_core::statistics::WithInterval;

/// The number with its sign, and its interval.
pub(crate) fn interval(number: &WithInterval, decimals: usize) -> String {
    match number.interval_95 {
        Some([low, high]) => format!("{:+.decimals$} [{low:+.decimals$}, {high:+.decimals$}]", number.value),
        None => format!("{:+.decimals$} [-]", number.value),
    }
}

/// What the interval of B minus A allows to say.
pub(crate) const fn verdict(difference: &WithInterval) -> &'static str {
    match difference.interval_95 {
        Some([low, _]) if low > 0.0 => "B is worse",
        Some([_, high]) if high < 0.0 => "B is better",
        Some(_) => "not told apart",
        None => "too little to tell",
    }
}
