//! A calibration in options: the size of the images, a lens, and the camera's place in the body.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use vice_core::camera::{Camera, Model};
use vice_core::frames::BodyFromCamera;
use vice_files::calibration::CameraOverride;

use super::DatasetSpec;
use crate::error::{RunError, RunResult};

/// Columns and rows of the images, such as `752x480`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ImageSize {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// A lens by its model and coefficients, such as `radtan:-0.28,0.07,0.0002,0.00002`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct LensSpec {
    /// The lens.
    pub model: Model,
}

impl FromStr for ImageSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = text.split_once(['x', 'X', ',']);
        let sides = sides.and_then(|(w, h)| Some((w.trim().parse().ok()?, h.trim().parse().ok()?)));
        match sides {
            Some((width, height)) if width > 0 && height > 0 => Ok(Self { width, height }),
            _ => Err(format!("`{text}` is no size of images; expected WIDTHxHEIGHT, such as 752x480")),
        }
    }
}

impl FromStr for LensSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, numbers) = text.split_once(':').unwrap_or((text, ""));
        let parts = numbers.split(',').map(str::trim).filter(|part| !part.is_empty());
        let coefficients: Vec<f64> = parts
            .map(|part| part.parse().map_err(|_| format!("the coefficient `{part}` of {name} is no number")))
            .collect::<Result<_, _>>()?;
        Ok(Self { model: Model::from_name(name, &coefficients).map_err(|e| e.to_string())? })
    }
}

impl fmt::Display for ImageSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl fmt::Display for LensSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers: Vec<String> = self.model.coefficients().iter().map(f64::to_string).collect();
        let colon = if numbers.is_empty() { "" } else { ":" };
        write!(f, "{}{colon}{}", self.model.name(), numbers.join(","))
    }
}

macro_rules! as_text {
    ($($name:ident),*) => {$(
        impl TryFrom<String> for $name {
            type Error = String;

            fn try_from(text: String) -> Result<Self, String> {
                text.parse()
            }
        }

        impl From<$name> for String {
            fn from(value: $name) -> Self {
                value.to_string()
            }
        }
    )*};
}
as_text!(ImageSize, LensSpec);

impl DatasetSpec {
    /// What the options say of the camera, where they say anything; `base` is the camera that is known without them.
    ///
    /// # Errors
    /// [`RunError`] of the kind usage if the camera's place is none.
    pub(crate) fn plain_camera(&self, base: Option<&Camera>) -> RunResult<Option<CameraOverride>> {
        let mut found = CameraOverride {
            resolution: self.image_size.map(|size| [size.width, size.height]),
            intrinsics: self.intrinsics,
            body_from_camera: self.body_from_camera.as_deref().map(place).transpose()?,
            ..CameraOverride::default()
        };
        if let Some(LensSpec { model }) = &self.distortion {
            found.model = Some(model.name().to_string());
            found.distortion = Some(model.coefficients());
        } else if base.is_none() && self.intrinsics.is_some() {
            found.model = Some(Model::Pinhole.name().to_string());
        }
        Ok((found != CameraOverride::default()).then_some(found))
    }
}

/// A pose as x, y, z and the quaternion x, y, z, w, or as a matrix row by row.
fn place(numbers: &[f64]) -> RunResult<BodyFromCamera> {
    let wrong = |e: String| RunError::usage("body-from-camera", e);
    match *numbers {
        [x, y, z, qx, qy, qz, qw] => {
            BodyFromCamera::try_from_parts([x, y, z], [qw, qx, qy, qz]).map_err(|e| wrong(e.to_string()))
        }
        _ => match <[f64; 16]>::try_from(numbers) {
            Ok(matrix) => BodyFromCamera::try_from_row_major(&matrix).map_err(|e| wrong(e.to_string())),
            Err(_) => Err(wrong(format!(
                "{} numbers are no pose: expected x,y,z,qx,qy,qz,qw, or the 16 of a matrix row by row",
                numbers.len()
            ))),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        for text in ["radtan:-0.28,0.07,0.0002,0.00002,0", "ds:-0.2,0.6", "pinhole", "fov:0.9"] {
            let lens: LensSpec = text.parse().unwrap();
            assert_eq!(lens.to_string(), text);
            let json = serde_json::to_string(&lens).unwrap();
            assert_eq!(serde_json::from_str::<LensSpec>(&json).unwrap(), lens);
        }
        assert_eq!("752x480".parse::<ImageSize>().unwrap().to_string(), "752x480");
        for (text, expected) in [
            ("radtan:1", "radtan takes 4 or 5"),
            ("radtan:1,b", "the coefficient `b` of radtan is no number"),
            ("fishbowl:1", "unknown camera model `fishbowl`"),
        ] {
            assert!(text.parse::<LensSpec>().unwrap_err().contains(expected), "{text}");
        }
        for text in ["752", "0x480", "752x", "-1x2", "752x480x3"] {
            assert!(text.parse::<ImageSize>().unwrap_err().contains("expected WIDTHxHEIGHT"), "{text}");
        }
    }

    #[test]
    fn a_place_is_a_pose_or_a_matrix() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let pose = place(&[1.0, 2.0, 3.0, 0.0, 0.0, half, half]).unwrap();
        let matrix =
            place(&[0.0, -1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0])
                .unwrap();
        let off = pose.inverse() * matrix;
        assert!(off.translation().norm() < 1e-12 && off.rotation().angle() < 1e-12);
        assert!(place(&[1.0]).unwrap_err().to_string().contains("1 numbers are no pose"));
        assert!(place(&[0.0; 7]).is_err() && place(&[0.0; 16]).is_err());
    }
}
