//! What is read when it is first asked for, and kept.

use std::sync::OnceLock;

use vice_core::error::DataResult;

/// Gives what is there or reads it; two threads that read at once keep the first result. Errors are not kept, since
/// they cannot be given out twice, and reading again finds them again.
///
/// # Errors
/// That of `read`.
pub fn cached<T>(cell: &OnceLock<T>, read: impl FnOnce() -> DataResult<T>) -> DataResult<&T> {
    if let Some(value) = cell.get() {
        return Ok(value);
    }
    let value = read()?;
    Ok(cell.get_or_init(|| value))
}
