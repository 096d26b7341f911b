//! What blocks may claim to hold: each for itself, and all of a file together.

use vice_core::budget::Budget;
use vice_core::error::{DataError, DataResult};

/// Bytes beyond which a block is refused: recorders write blocks of about a megabyte, or of one message.
const MAX_BLOCK_BYTES: u64 = 1 << 30;
/// Bytes that any block may unpack to, however small it is.
pub(super) const FREE_BYTES: u64 = 64 << 20;
/// How many times its size a larger one may unpack to: no robot sees that much of nothing.
const MOST_TIMES: u64 = 64;
/// Bytes that the blocks of any file may unpack to together, and how many times its size those of a larger one may.
const FREE_FILE_BYTES: u64 = 256 << 20;
const MOST_TIMES_OF_FILE: u64 = 256;

/// Why a block of so many bytes is not unpacked to as many as its header says.
pub(super) fn over_budget(size: u64, stored: u64) -> Option<String> {
    let usual = FREE_BYTES.max(stored.saturating_mul(MOST_TIMES)).min(MAX_BLOCK_BYTES);
    let most = Budget::in_use().most(usual);
    let raised = Budget::raised(size.max(stored), usual);
    (size.max(stored) > most)
        .then(|| format!("claims {size} bytes in {stored}, more than the budget of {most} ({raised})"))
}

/// What the blocks of a file unpack to: each may be small enough and all of them together too much.
pub(super) struct Unpacked {
    bytes: u64,
    usual: u64,
}

impl Unpacked {
    pub(super) fn of(file_bytes: u64) -> Self {
        Self { bytes: 0, usual: FREE_FILE_BYTES.max(file_bytes.saturating_mul(MOST_TIMES_OF_FILE)) }
    }

    /// Adds a block that is packed, by the size that it claims.
    pub(super) fn add(&mut self, size: u64) -> DataResult<()> {
        self.bytes = self.bytes.saturating_add(size.min(MAX_BLOCK_BYTES));
        Budget::in_use().check(self.bytes, "bytes", self.usual).map_err(|e| {
            DataError::new(format!("the chunks up to here unpack to too much, the rest is left out: {e}"))
        })
    }
}
