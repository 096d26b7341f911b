//! Which instructions batches may use at most, for whoever wants to see that the results do not depend on it.
//!
//! By itself each machine uses the widest registers that it has, and the results have the same bits on all of them. The
//! variable [`INSTRUCTIONS`] holds a machine to fewer: `scalar` (the least that its kind of processor has), `v3` (AVX2 and
//! FMA), or `widest`.

use std::sync::LazyLock;

/// Name of the environment variable.
pub const INSTRUCTIONS: &str = "VICE_INSTRUCTIONS";

/// The most that batches may use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Instructions {
    /// What every processor of the kind has.
    Scalar,
    /// AVX2 and FMA, where the processor has them.
    V3,
    /// Whatever there is.
    Widest,
}

impl Instructions {
    /// From the variable's value.
    ///
    /// # Errors
    /// One line that names the values there are.
    pub fn parse(value: &str) -> Result<Self, String> {
        match value {
            "scalar" => Ok(Self::Scalar),
            "v3" => Ok(Self::V3),
            "widest" | "" => Ok(Self::Widest),
            other => Err(format!("{INSTRUCTIONS}: `{other}` is not one of scalar, v3, widest")),
        }
    }

    /// What the variable says; everything where it is not set.
    ///
    /// # Errors
    /// As [`Instructions::parse`].
    pub fn from_environment() -> Result<Self, String> {
        std::env::var_os(INSTRUCTIONS).map_or(Ok(Self::Widest), |value| Self::parse(&value.to_string_lossy()))
    }

    /// What batches of this process keep to. A value that is none is for the program to refuse; here it changes nothing.
    pub fn in_use() -> Self {
        static FOUND: LazyLock<Instructions> =
            LazyLock::new(|| Instructions::from_environment().unwrap_or(Instructions::Widest));
        *FOUND
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_few_and_named() {
        assert_eq!(Instructions::parse("scalar"), Ok(Instructions::Scalar));
        assert_eq!(Instructions::parse("v3"), Ok(Instructions::V3));
        assert_eq!(Instructions::parse(""), Ok(Instructions::Widest));
        assert!(Instructions::parse("AVX").unwrap_err().contains("scalar, v3, widest"));
    }
}
