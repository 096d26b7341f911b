//! Time as integer nanoseconds.
//!
//! A double holds today's epoch to about 238 ns only, which is why stamps are never kept as one:
//! seconds exist at the edges (text, options, reports) and are read as decimal text, digit by digit.

use std::fmt;
use std::ops::{Add, Neg, Sub};

const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// A point in time: nanoseconds since the epoch of the data set's clock.
///
/// ```
/// use vice_core::time::{Span, Stamp};
///
/// // Read digit by digit: a double would be off by more than 100 ns here.
/// let stamp = Stamp::parse_seconds("1403715273.262142976")?;
/// assert_eq!(stamp.as_nanos(), 1_403_715_273_262_142_976);
/// let later = stamp + Span::from_millis(50);
/// assert_eq!(later.since(stamp), Span::from_nanos(50_000_000));
/// # Ok::<(), vice_core::time::TimeError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(transparent))]
pub struct Stamp(i64);

/// A signed length of time in nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(transparent))]
pub struct Span(i64);

/// Why a text or number is no time.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TimeError {
    /// The text is not a decimal number.
    #[error("`{0}` is not a decimal number of seconds")]
    NotDecimal(String),
    /// The value does not fit 64 bits of nanoseconds (about 292 years).
    #[error("`{0}` does not fit 64 bits of nanoseconds")]
    OutOfRange(String),
}

impl Stamp {
    /// The earliest representable stamp.
    pub const MIN: Self = Self(i64::MIN);
    /// The latest representable stamp.
    pub const MAX: Self = Self(i64::MAX);

    /// A stamp from nanoseconds since the epoch.
    #[inline]
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// Nanoseconds since the epoch.
    #[inline]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// Seconds since the epoch, for display and plots only: a double cannot hold a nanosecond of today.
    #[inline]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / NANOS_PER_SECOND as f64
    }

    /// Reads decimal seconds (`1403715278.76214`, `1.4037e9`) exactly, rounding beyond the ninth decimal.
    ///
    /// # Errors
    /// [`TimeError`] if the text is no decimal number or the value does not fit.
    pub fn parse_seconds(text: &str) -> Result<Self, TimeError> {
        parse_scaled(text, 9).map(Self)
    }

    /// Reads decimal milliseconds exactly, rounding beyond the sixth decimal.
    ///
    /// # Errors
    /// [`TimeError`] if the text is no decimal number or the value does not fit.
    pub fn parse_millis(text: &str) -> Result<Self, TimeError> {
        parse_scaled(text, 6).map(Self)
    }

    /// Reads decimal microseconds exactly, rounding beyond the third decimal.
    ///
    /// # Errors
    /// [`TimeError`] if the text is no decimal number or the value does not fit.
    pub fn parse_micros(text: &str) -> Result<Self, TimeError> {
        parse_scaled(text, 3).map(Self)
    }

    /// Reads nanoseconds; an integer, or a decimal such as some tools write (`1.403715e18`).
    ///
    /// # Errors
    /// [`TimeError`] if the text is no decimal number or the value does not fit.
    pub fn parse_nanos(text: &str) -> Result<Self, TimeError> {
        parse_scaled(text, 0).map(Self)
    }

    /// `self + span`, or `None` on overflow.
    pub fn checked_add(self, span: Span) -> Option<Self> {
        self.0.checked_add(span.0).map(Self)
    }

    /// `self + span`, held at the ends of the range.
    pub fn saturating_add(self, span: Span) -> Self {
        Self(self.0.saturating_add(span.0))
    }

    /// The span from `earlier` to `self`, held at the ends of the range.
    #[inline]
    pub fn since(self, earlier: Self) -> Span {
        Span(self.0.saturating_sub(earlier.0))
    }

    /// The text form in seconds with nine decimals, exact.
    pub fn to_seconds_text(self) -> String {
        seconds_text(self.0)
    }
}

impl Span {
    /// No time at all.
    pub const ZERO: Self = Self(0);
    /// The longest representable span.
    pub const MAX: Self = Self(i64::MAX);

    /// A span from nanoseconds.
    #[inline]
    pub const fn from_nanos(nanos: i64) -> Self {
        Self(nanos)
    }

    /// A span from whole milliseconds.
    pub const fn from_millis(millis: i64) -> Self {
        Self(millis * 1_000_000)
    }

    /// Nanoseconds.
    #[inline]
    pub const fn as_nanos(self) -> i64 {
        self.0
    }

    /// A span from seconds, rounded to the nearest nanosecond.
    ///
    /// # Errors
    /// [`TimeError::OutOfRange`] for NaN, infinities and values beyond about 292 years.
    pub fn from_secs_f64(seconds: f64) -> Result<Self, TimeError> {
        let nanos = (seconds * NANOS_PER_SECOND as f64).round();
        if nanos.is_finite() && nanos.abs() < i64::MAX as f64 {
            Ok(Self(nanos as i64))
        } else {
            Err(TimeError::OutOfRange(seconds.to_string()))
        }
    }

    /// Reads decimal seconds exactly.
    ///
    /// # Errors
    /// [`TimeError`] if the text is no decimal number or the value does not fit.
    pub fn parse_seconds(text: &str) -> Result<Self, TimeError> {
        parse_scaled(text, 9).map(Self)
    }

    /// Seconds as a double.
    #[inline]
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / NANOS_PER_SECOND as f64
    }

    /// The length without its sign, held at the end of the range.
    pub fn abs(self) -> Self {
        Self(self.0.saturating_abs())
    }

    /// Seconds with as many digits as a person wants to see in a message.
    pub fn to_short_text(self) -> String {
        let seconds = self.as_secs_f64();
        let text = if seconds.abs() < 0.1 { format!("{seconds:.4}") } else { format!("{seconds:.2}") };
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    }

    /// The text form in seconds with nine decimals, exact.
    pub fn to_seconds_text(self) -> String {
        seconds_text(self.0)
    }
}

impl Add<Span> for Stamp {
    type Output = Self;
    /// Saturates, so that no input can make a release build wrap around.
    fn add(self, span: Span) -> Self {
        self.saturating_add(span)
    }
}

impl Sub<Span> for Stamp {
    type Output = Self;
    fn sub(self, span: Span) -> Self {
        Self(self.0.saturating_sub(span.0))
    }
}

impl Sub for Stamp {
    type Output = Span;
    fn sub(self, earlier: Self) -> Span {
        self.since(earlier)
    }
}

impl Add for Span {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }
}

impl Sub for Span {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }
}

impl Neg for Span {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

impl fmt::Display for Stamp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

impl fmt::Display for Span {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} s", self.as_secs_f64())
    }
}

fn seconds_text(nanos: i64) -> String {
    let sign = if nanos < 0 { "-" } else { "" };
    let magnitude = nanos.unsigned_abs();
    let per_second = NANOS_PER_SECOND as u64;
    format!("{sign}{}.{:09}", magnitude / per_second, magnitude % per_second)
}

/// The value of decimal `text` times ten to the `scale`, rounded half away from zero, without a double.
fn parse_scaled(text: &str, scale: i32) -> Result<i64, TimeError> {
    let trimmed = text.trim();
    let not_decimal = || TimeError::NotDecimal(trimmed.to_string());
    let out_of_range = || TimeError::OutOfRange(trimmed.to_string());
    let (negative, unsigned) = match trimmed.as_bytes().first() {
        Some(b'-') => (true, &trimmed[1..]),
        Some(b'+') => (false, &trimmed[1..]),
        _ => (false, trimmed),
    };
    let (mantissa, exponent) = match unsigned.find(['e', 'E']) {
        Some(at) => {
            let exponent: i32 = unsigned[at + 1..].parse().map_err(|_| not_decimal())?;
            (&unsigned[..at], exponent)
        }
        None => (unsigned, 0),
    };
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = || whole.bytes().chain(fraction.bytes());
    if whole.len() + fraction.len() == 0 || !digits().all(|b| b.is_ascii_digit()) {
        return Err(not_decimal());
    }
    // Digits before this place count as whole units of the scaled value, the next one decides the rounding.
    let point =
        i64::try_from(whole.len()).map_err(|_| out_of_range())? + i64::from(exponent) + i64::from(scale);
    let mut value: i64 = 0;
    let mut round_up = false;
    for (place, byte) in (0_i64..).zip(digits()) {
        let digit = i64::from(byte - b'0');
        if place < point {
            value = value.checked_mul(10).and_then(|v| v.checked_add(digit)).ok_or_else(out_of_range)?;
        } else {
            if place == point {
                round_up = digit >= 5;
            }
            break;
        }
    }
    let missing = point - (whole.len() + fraction.len()) as i64;
    if value != 0 {
        for _ in 0..missing.max(0) {
            value = value.checked_mul(10).ok_or_else(out_of_range)?;
        }
    }
    if round_up {
        value = value.checked_add(1).ok_or_else(out_of_range)?;
    }
    Ok(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn decimal_seconds_keep_every_nanosecond() {
        assert_eq!(Stamp::parse_seconds("1403715280.562142976").unwrap().as_nanos(), 1403715280562142976);
        assert_eq!(Stamp::parse_seconds("1403715278.76214").unwrap().as_nanos(), 1403715278762140000);
        assert_eq!(Stamp::parse_seconds("1.403715280562142976e+09").unwrap().as_nanos(), 1403715280562142976);
        assert!(matches!(Stamp::parse_seconds("1.403715280562142976e+18"), Err(TimeError::OutOfRange(_))));
        assert_eq!(Stamp::parse_nanos("1.403715280562142976e+18").unwrap().as_nanos(), 1403715280562142976);
        assert_eq!(Stamp::parse_micros("1526182346402317.4").unwrap().as_nanos(), 1526182346402317400);
        assert_eq!(Stamp::parse_seconds("-0.0000000015").unwrap().as_nanos(), -2);
        assert_eq!(Stamp::parse_seconds(".5").unwrap().as_nanos(), 500_000_000);
        assert_eq!(Stamp::parse_seconds("1e-12").unwrap().as_nanos(), 0);
        assert_eq!(Stamp::parse_seconds("0e999999999").unwrap().as_nanos(), 0);
    }

    #[test]
    fn what_is_no_number_is_refused() {
        for text in ["", "nan", "inf", "1,5", "1.2.3", "--1", "1e", "e5", ".", "0x10", "1 2"] {
            assert!(matches!(Stamp::parse_seconds(text), Err(TimeError::NotDecimal(_))), "{text}");
        }
        assert!(matches!(Stamp::parse_seconds("1e300"), Err(TimeError::OutOfRange(_))));
        assert!(Span::from_secs_f64(f64::NAN).is_err());
        assert!(Span::from_secs_f64(1e300).is_err());
    }

    proptest! {
        #[test]
        fn text_round_trip(nanos in (i64::MIN + 1)..i64::MAX) {
            let stamp = Stamp::from_nanos(nanos);
            prop_assert_eq!(Stamp::parse_seconds(&stamp.to_seconds_text()).unwrap(), stamp);
        }
    }
}
