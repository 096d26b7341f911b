//! A camera: its calibration and its frames.

use std::path::PathBuf;
use std::sync::OnceLock;

use vice_core::dataset::Image;
use vice_core::error::DataResult;
use vice_files::image_file;

use crate::listing::Listing;
use crate::sensor::{self, Calibration};

/// A camera's folder, read as far as it was asked for.
#[derive(Debug)]
pub(crate) struct EurocCamera {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
    calibration: OnceLock<Calibration>,
    listing: OnceLock<Listing>,
}

impl EurocCamera {
    pub(crate) fn new(name: String, folder: PathBuf) -> Self {
        Self { name, folder, calibration: OnceLock::new(), listing: OnceLock::new() }
    }

    pub(crate) fn calibration(&self) -> DataResult<&Calibration> {
        cached(&self.calibration, || sensor::calibration(&self.folder))
    }

    pub(crate) fn listing(&self) -> DataResult<&Listing> {
        cached(&self.listing, || Listing::read(&self.folder))
    }

    pub(crate) fn image(&self, index: usize) -> DataResult<Image> {
        image_file::read(self.listing()?.path(index)?)
    }

    pub(crate) fn image_file(&self, index: usize) -> DataResult<Vec<u8>> {
        image_file::read_bytes(self.listing()?.path(index)?)
    }
}

/// Gives what is there or reads it; two threads that read at once keep the first result. Errors are not kept, since
/// they cannot be given out twice, and reading again finds them again.
pub(crate) fn cached<T>(cell: &OnceLock<T>, read: impl FnOnce() -> DataResult<T>) -> DataResult<&T> {
    if let Some(value) = cell.get() {
        return Ok(value);
    }
    let value = read()?;
    Ok(cell.get_or_init(|| value))
}
