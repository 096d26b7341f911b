//! COLMAP's camera models as those of the core.

use vice_core::camera::Model;
use vice_core::error::{DataError, DataResult, ErrorKind};

use crate::parts::Intrinsics;

/// The models by their number: name, and how many parameters each has.
const MODELS: [(&str, usize); 11] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
];

/// A camera of a model, as its file has it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ModelCamera {
    pub(crate) model: &'static str,
    pub(crate) size: [u32; 2],
    pub(crate) parameters: Vec<f64>,
}

/// A model by its number: name and number of parameters.
pub(super) fn by_number(number: u32) -> DataResult<(&'static str, usize)> {
    let found = usize::try_from(number).ok().and_then(|n| MODELS.get(n));
    found.copied().ok_or_else(|| {
        DataError::of_kind(
            ErrorKind::Unsupported,
            format!("there is no camera model with the number {number}"),
        )
    })
}

/// A model by its name.
pub(super) fn by_name(name: &str) -> DataResult<(&'static str, usize)> {
    MODELS.iter().find(|(known, _)| *known == name).copied().ok_or_else(|| {
        let known: Vec<&str> = MODELS.iter().map(|(name, _)| *name).collect();
        DataError::of_kind(ErrorKind::Unsupported, format!("unknown camera model `{name}`"))
            .hint(format!("known: {}", known.join(", ")))
    })
}

impl ModelCamera {
    /// Checks the numbers as far as they say something by themselves.
    pub(super) fn new(
        model: (&'static str, usize),
        size: [u64; 2],
        parameters: Vec<f64>,
    ) -> DataResult<Self> {
        let (model, count) = model;
        if parameters.len() != count {
            return Err(DataError::new(format!(
                "{model} has {count} parameters, here are {}",
                parameters.len()
            )));
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
        let p = &self.parameters;
        let one_focal = |rest: usize| ([p[0], p[0], p[1], p[2]], &p[3..3 + rest]);
        let two_focals = || ([p[0], p[1], p[2], p[3]], &p[4..]);
        let (fx_fy_cx_cy, lens, coefficients): ([f64; 4], &str, Vec<f64>) = match self.model {
            "SIMPLE_PINHOLE" => (one_focal(0).0, "pinhole", vec![]),
            "PINHOLE" => (two_focals().0, "pinhole", vec![]),
            "SIMPLE_RADIAL" => (one_focal(1).0, "radtan", vec![p[3], 0.0, 0.0, 0.0]),
            "RADIAL" => (one_focal(2).0, "radtan", vec![p[3], p[4], 0.0, 0.0]),
            "OPENCV" => (two_focals().0, "radtan", two_focals().1.to_vec()),
            "OPENCV_FISHEYE" => (two_focals().0, "equidistant", two_focals().1.to_vec()),
            "FULL_OPENCV" => (two_focals().0, "rational", two_focals().1.to_vec()),
            "SIMPLE_RADIAL_FISHEYE" => (one_focal(1).0, "equidistant", vec![p[3], 0.0, 0.0, 0.0]),
            "RADIAL_FISHEYE" => (one_focal(2).0, "equidistant", vec![p[3], p[4], 0.0, 0.0]),
            "FOV" => (two_focals().0, "fov", two_focals().1.to_vec()),
            other => {
                return Err(DataError::of_kind(
                    ErrorKind::Unsupported,
                    format!("the camera model {other} of COLMAP is not among the models that are projected"),
                )
                .at(from)
                .hint("undistort the images (colmap image_undistorter), or give --calibration"));
            }
        };
        let model = Model::from_name(lens, &coefficients).map_err(|e| DataError::of(e).at(from))?;
        let [fx, fy, cx, cy] = fx_fy_cx_cy;
        let pinhole = Intrinsics::pinhole([fx, fy, cx - 0.5, cy - 0.5], from);
        Ok(Intrinsics { size: Some(self.size), model, ..pinhole })
    }
}
