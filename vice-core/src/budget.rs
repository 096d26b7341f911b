//! How much of what a file claims is believed, and what to set where a file is right to claim more.
//!
//! Every count, length, size and dimension that comes from a file is held against what is there before memory or time is
//! spent on it. Where what is there cannot tell, because the file is packed or has holes, each reader knows what files of
//! its kind need at most, in bytes or in elements. The variable [`BUDGET`] raises all of these by a factor.
//!
//! Time is bounded through them, not by a clock: a file that one machine reads is not refused by a slower one, and a run
//! gives the same on a busy day.

use std::sync::LazyLock;

use crate::error::{DataError, DataResult};

/// Name of the environment variable.
pub const BUDGET: &str = "VICE_BUDGET";

/// How many times the usual a file may claim.
///
/// ```
/// use vice_core::budget::Budget;
///
/// let usual = Budget::default();
/// assert!(usual.check(900, "frames", 1000).is_ok());
/// let error = usual.check(2500, "frames", 1000).unwrap_err().to_string();
/// assert_eq!(error, "2500 frames are above the budget of 1000 (where the file is right, VICE_BUDGET=3 reads it)");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    times: f64,
}

impl Default for Budget {
    fn default() -> Self {
        Self { times: 1.0 }
    }
}

impl Budget {
    /// From the variable's value: a factor, such as `4`; 0.1 is a tenth of the usual.
    ///
    /// # Errors
    /// One line that says what the value should be.
    pub fn parse(value: &str) -> Result<Self, String> {
        match value.trim().parse::<f64>() {
            Ok(times) if times.is_finite() && times > 0.0 => Ok(Self { times }),
            _ if value.trim().is_empty() => Ok(Self::default()),
            _ => Err(format!("{BUDGET}: `{value}` is no factor, such as 4")),
        }
    }

    /// What the variable says; the usual where it is not set.
    ///
    /// # Errors
    /// As [`Budget::parse`].
    pub fn from_environment() -> Result<Self, String> {
        std::env::var_os(BUDGET).map_or_else(|| Ok(Self::default()), |v| Self::parse(&v.to_string_lossy()))
    }

    /// The budget of this process. A value that is none is for the program to refuse; here it changes nothing.
    pub fn in_use() -> Self {
        static FOUND: LazyLock<Budget> = LazyLock::new(|| Budget::from_environment().unwrap_or_default());
        *FOUND
    }

    /// The most of what is usually at most `usual`.
    pub fn most(self, usual: u64) -> u64 {
        // Exact where nobody changed it.
        if self.times == 1.0 { usual } else { (usual as f64 * self.times) as u64 }
    }

    /// Whether so many of `what` may be read, of which files usually have at most `usual`.
    ///
    /// # Errors
    /// [`DataError`] that names the budget, and the value of the variable that would allow it.
    pub fn check(self, claimed: u64, what: &str, usual: u64) -> DataResult<()> {
        let most = self.most(usual);
        if claimed <= most {
            return Ok(());
        }
        Err(DataError::new(format!("{claimed} {what} are above the budget of {most}"))
            .hint(format!("where the file is right, {}", Self::raised(claimed, usual))))
    }

    /// What to say of a way out: the value of the variable by which so much would be read.
    pub fn raised(claimed: u64, usual: u64) -> String {
        format!("{BUDGET}={} reads it", claimed.div_ceil(usual.max(1)).max(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_raises_and_lowers() {
        assert_eq!(Budget::parse("").unwrap(), Budget::default());
        assert_eq!(Budget::parse(" 4 ").unwrap().most(1000), 4000);
        assert_eq!(Budget::parse("0.5").unwrap().most(1000), 500);
        assert_eq!(Budget::parse("1e300").unwrap().most(u64::MAX), u64::MAX);
        assert_eq!(Budget::default().most(u64::MAX), u64::MAX);
        for wrong in ["0", "-1", "nan", "inf", "much"] {
            assert!(Budget::parse(wrong).unwrap_err().contains("VICE_BUDGET"), "{wrong}");
        }
    }

    #[test]
    fn the_value_that_is_named_is_enough() {
        for (claimed, usual) in
            [(1001, 1000), (2000, 1000), (2001, 1000), (u64::MAX, 3), (1 << 60, (1 << 20) + 1)]
        {
            let error = Budget::default().check(claimed, "bytes", usual).unwrap_err();
            let hint = error.hint_text().unwrap();
            let value = hint.split_once("VICE_BUDGET=").unwrap().1.split(' ').next().unwrap();
            assert!(
                Budget::parse(value).unwrap().check(claimed, "bytes", usual).is_ok(),
                "{claimed} of {usual}"
            );
        }
    }
}
