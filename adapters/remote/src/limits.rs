//! How much is staged and how long is waited; from the environment where it says so.

use std::path::PathBuf;
use std::time::Duration;

use vice_core::error::{DataError, DataResult, ErrorKind};

/// The cache folder, in place of the user's.
pub(crate) const CACHE: &str = "VICE_CACHE";
/// The most that is staged for one data set, GiB.
pub(crate) const STAGE_LIMIT: &str = "VICE_STAGE_LIMIT";
/// How long one request may take, seconds.
pub(crate) const TIMEOUT: &str = "VICE_REMOTE_TIMEOUT";
/// How often a request that failed is made again.
pub(crate) const RETRIES: &str = "VICE_REMOTE_RETRIES";

const DEFAULT_STAGE_GIB: f64 = 4.0;
const DEFAULT_TIMEOUT_S: f64 = 30.0;
const DEFAULT_RETRIES: u32 = 5;
const GIB: f64 = 1024.0 * 1024.0 * 1024.0;

/// How much, how long, how often.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    pub(crate) stage_bytes: u64,
    pub(crate) timeout: Duration,
    pub(crate) retries: u32,
}

impl Limits {
    /// Those of the environment, or the defaults.
    pub(crate) fn read() -> DataResult<Self> {
        let gib = number(STAGE_LIMIT, DEFAULT_STAGE_GIB)?;
        let timeout_s = number(TIMEOUT, DEFAULT_TIMEOUT_S)?;
        let timeout = Duration::try_from_secs_f64(timeout_s).map_err(|_| wrong(TIMEOUT, "seconds"))?;
        let retries = match std::env::var(RETRIES) {
            Ok(text) => text.trim().parse().map_err(|_| wrong(RETRIES, "a count"))?,
            Err(_) => DEFAULT_RETRIES,
        };
        Ok(Self { stage_bytes: (gib * GIB) as u64, timeout, retries })
    }
}

fn number(name: &'static str, default: f64) -> DataResult<f64> {
    match std::env::var(name) {
        Ok(text) => {
            let value = text.trim().parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
            value.ok_or_else(|| wrong(name, "a number above zero"))
        }
        Err(_) => Ok(default),
    }
}

fn wrong(name: &'static str, what: &str) -> DataError {
    DataError::of_kind(ErrorKind::Usage, format!("the environment variable {name} is not {what}"))
}

/// Where what was fetched is kept.
pub(crate) fn cache_folder() -> DataResult<PathBuf> {
    if let Some(folder) = std::env::var_os(CACHE).filter(|f| !f.is_empty()) {
        return std::path::absolute(&folder)
            .map_err(|e| DataError::new("the cache folder cannot be used").at(&folder).because(e));
    }
    let user = directories::ProjectDirs::from("", "", "vice").map(|dirs| dirs.cache_dir().join("remote"));
    user.ok_or_else(|| {
        DataError::of_kind(ErrorKind::Missing, "the user has no cache folder")
            .hint(format!("name one in the environment variable {CACHE}"))
    })
}
