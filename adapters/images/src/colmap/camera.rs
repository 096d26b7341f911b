//! COLMAP's cameras as those of the core.

use vice_core::camera::Model;
use vice_core::error::{DataError, DataResult};
use vice_files::calibration::ColmapModel;

use crate::parts::Intrinsics;

/// A camera of a model, as its file has it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ModelCamera {
    pub(crate) model: &'static ColmapModel,
    pub(crate) size: [u32; 2],
    pub(crate) parameters: Vec<f64>,
}

impl ModelCamera {
    /// Checks the numbers as far as they say something by themselves.
    pub(super) fn new(model: &'static ColmapModel, size: [u64; 2], parameters: Vec<f64>) -> DataResult<Self> {
        let (name, count) = (model.name, model.parameters);
        if parameters.len() != count {
            let problem = format!("{name} has {count} parameters, here are {}", parameters.len());
            return Err(DataError::new(problem));
        }
        let side = |side: u64| {
            let found =
                u32::try_from(side).ok().filter(|s| (1..=vice_files::image_file::MAX_SIDE_PX).contains(s));
            found.ok_or_else(|| DataError::new(format!("{side} is no side of an image in pixels")))
        };
        Ok(Self { model, size: [side(size[0])?, side(size[1])?], parameters })
    }

    /// The camera as the core has it.
    ///
    /// # Errors
    /// [`DataError`] for a lens that it does not have, or that cannot be.
    pub(crate) fn intrinsics(&self, from: &str) -> DataResult<Intrinsics> {
        let camera = self.model.camera(self.size, &self.parameters).map_err(|e| {
            e.at(from).hint("undistort the images (colmap image_undistorter), or give --calibration")
        })?;
        let coefficients = camera.distortion.unwrap_or_default();
        let model = Model::from_name(camera.model.as_deref().unwrap_or_default(), &coefficients)
            .map_err(|e| DataError::of(e).at(from))?;
        let pinhole = Intrinsics::pinhole(camera.intrinsics.unwrap_or_default(), from);
        Ok(Intrinsics { size: Some(self.size), model, ..pinhole })
    }
}
