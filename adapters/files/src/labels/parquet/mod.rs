//! Labels as Parquet: a row a label, in columns that pandas, polars and DuckDB read as they are. Nothing is lost.
//!
//! | column | type | |
//! | --- | --- | --- |
//! | `point`, `source` | text | |
//! | `timestamp_ns` | whole number | or a column of time stamps in any unit |
//! | `u_px`, `v_px` | double | NaN or nothing: no label, as in CSV |
//! | `keyframe`, `occluded`, `uncertain` | yes or no | |
//! | `camera` | text | read; written is the file's own metadata |
//! | `confidence`, `tracker_version`, `seeded` | | only where a tracker says so |
//!
//! Columns are found by their names as those of CSV are, and may be missing from `source` on. The file's own metadata holds
//! `vice.schema` (that of JSON), `vice.dataset` and `vice.camera`.
//!
//! Written for reading: pixels lie there as they are in memory, since their last bytes do not compress, and a point of
//! many labels has row groups of its own, so that its name is read once.

#[cfg(feature = "parquet")]
mod columns;
#[cfg(feature = "parquet")]
mod read;
#[cfg(feature = "parquet")]
mod source;
#[cfg(feature = "parquet")]
mod write;

#[cfg(test)]
#[cfg(feature = "parquet")]
mod tests;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use vice_core::error::DataResult;

#[cfg(feature = "parquet")]
pub(super) use read::{read_parquet, read_parquet_bytes};
#[cfg(feature = "parquet")]
pub(super) use write::write_parquet;

use crate::{elsewhere, tables};

/// Keys of the file's own metadata.
#[cfg(feature = "parquet")]
const SCHEMA: &str = "vice.schema";
#[cfg(feature = "parquet")]
const DATASET: &str = "vice.dataset";
#[cfg(feature = "parquet")]
const CAMERA: &str = "vice.camera";

/// The first bytes of every Parquet file.
const MAGIC: [u8; 4] = *b"PAR1";

/// Whether a file is Parquet, by its first bytes or by its name.
pub(super) fn is_parquet(path: &Path) -> DataResult<bool> {
    if tables::is_parquet(path) {
        return Ok(true);
    }
    let mut start = [0; 4];
    let is_there = match elsewhere::find(path)? {
        Some(file) => file.size_bytes() >= 4 && file.read_at(0, &mut start).is_ok(),
        // What cannot be read twice is read once.
        None if !path.metadata().is_ok_and(|m| m.is_file()) => false,
        None => File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok(),
    };
    Ok(is_there && start == MAGIC)
}

#[cfg(not(feature = "parquet"))]
pub(super) fn read_parquet(path: &Path, _: Option<&[String]>) -> DataResult<super::LabelFile> {
    Err(tables::unavailable().at(path))
}

#[cfg(not(feature = "parquet"))]
pub(super) fn read_parquet_bytes(_: &[u8]) -> DataResult<super::LabelFile> {
    Err(tables::unavailable())
}

#[cfg(not(feature = "parquet"))]
pub(super) fn write_parquet(
    path: &Path,
    _: &vice_core::label::LabelSet,
    _: crate::atomic::Overwrite,
) -> DataResult<()> {
    Err(tables::unavailable().at(path))
}
