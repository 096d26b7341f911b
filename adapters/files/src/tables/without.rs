//! What stands in for Parquet in a build without it.

use std::io;
use std::path::Path;

use vice_core::error::{DataError, DataResult, ErrorKind};

use super::Column;

/// The error of a build without Parquet.
pub(crate) fn unavailable() -> DataError {
    DataError::of_kind(ErrorKind::Unsupported, "this build has no Parquet")
        .hint("build VICE with its feature `parquet`")
}

/// Says that nothing can be read.
///
/// # Errors
/// Always.
pub fn read(path: &Path) -> DataResult<Vec<Column>> {
    Err(unavailable().at(path))
}

/// Says that nothing can be written.
///
/// # Errors
/// Always.
pub fn write<T, E: From<DataError>>(
    path: &Path,
    _: &[Column],
    _: impl FnOnce(&mut dyn FnMut(&[Column]) -> io::Result<()>) -> Result<T, E>,
) -> Result<T, E> {
    Err(unavailable().at(path).into())
}
