//! A camera: its calibration and its frames.

use std::path::PathBuf;
use std::sync::OnceLock;

use vice_core::camera::Camera;
use vice_core::dataset::Image;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::suspicion::Suspicion;
use vice_files::image_file;
use vice_files::once::cached;

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

    /// The intrinsics, where the pictures have the size they are for. Of these only the header of the first is read;
    /// where none is there, or none can be read, there is nothing to compare.
    pub(crate) fn intrinsics(&self) -> DataResult<Camera> {
        let camera = self.calibration()?.camera;
        let (width, height) = (camera.width(), camera.height());
        let picture = self.listing().ok().and_then(Listing::first_picture);
        match picture.filter(|(_, size)| *size != (width, height)) {
            None => Ok(camera),
            Some((path, (w, h))) => Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!("the calibration is of {width}x{height} images, but {} has {w}x{h} pixels", path.display()),
            )
            .at(self.folder.join(sensor::SENSOR_FILE))
            .hint("were the images made smaller? Then resolution and intrinsics are smaller too: here, or in a --calibration")),
        }
    }

    /// What looks wrong in what was read so far.
    pub(crate) fn suspicions(&self) -> Vec<Suspicion> {
        let keys = self.calibration.get().into_iter().flat_map(|c| c.suspicions.iter().cloned());
        let pictures = self.listing.get().and_then(|l| l.suspicion.clone());
        keys.chain(pictures).collect()
    }

    pub(crate) fn image(&self, index: usize) -> DataResult<Image> {
        image_file::read(self.listing()?.path(index)?)
    }

    pub(crate) fn image_file(&self, index: usize) -> DataResult<Vec<u8>> {
        image_file::read_bytes(self.listing()?.path(index)?)
    }
}
