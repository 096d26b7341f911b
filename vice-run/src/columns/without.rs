//! What stands in for Parquet in a build without it.

use std::io;
use std::path::Path;

use vice_core::error::{DataError, DataResult, ErrorKind};

use super::Column;
use crate::error::RunResult;

fn none(path: &Path) -> DataError {
    DataError::of_kind(ErrorKind::Unsupported, "this build has no Parquet")
        .at(path)
        .hint("build VICE with its feature `parquet`")
}

/// Says that nothing can be read.
pub(crate) fn read(path: &Path) -> DataResult<Vec<Column>> {
    Err(none(path))
}

/// Says that nothing can be written.
pub(crate) fn write<T>(
    path: &Path,
    _: &[Column],
    _: impl FnOnce(&mut dyn FnMut(&[Column]) -> io::Result<()>) -> RunResult<T>,
) -> RunResult<T> {
    Err(none(path).into())
}
