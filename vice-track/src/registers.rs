//! How wide the tracker may work.

use fearless_simd::Level;
use vice_core::instructions::Instructions;

/// The widest registers there are, or fewer where [`Instructions`] says so.
pub(crate) fn level() -> Level {
    match Instructions::in_use() {
        Instructions::Scalar => Level::baseline(),
        #[cfg(target_arch = "x86_64")]
        Instructions::V3 => Level::new().as_avx2().map_or_else(Level::baseline, Level::Avx2),
        _ => Level::new(),
    }
}
