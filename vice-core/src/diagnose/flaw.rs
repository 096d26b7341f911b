//! The flaws that are looked for, and the numbers that describe them.
//!
//! Every number is the error of what is in use, so that its correction is the same with the sign turned.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Number of parameters of all flaws together.
pub const PARAMETER_COUNT: usize = 17;

/// What may be wrong with an estimate or a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Flaw {
    /// The estimate's stamps are too late by a constant.
    ClockOffset,
    /// The camera's rotation in the body is off: used = true · Exp(rotation vector in the camera frame).
    ExtrinsicRotation,
    /// The camera's place in the body is off: used = true + vector in the body frame.
    ExtrinsicTranslation,
    /// Both focal lengths are too long by a share.
    FocalLength,
    /// The principal point is off.
    PrincipalPoint,
    /// The start state of an inertial estimate is tilted: used = Exp(vector in the world) · true.
    InitialTilt,
    /// The estimate's translations are too long by a share.
    Scale,
    /// The estimate drifts at a constant rate: velocity in its world, and yaw rate about its z axis.
    Drift,
}

/// One number of a flaw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Its name in documents, with the unit.
    pub name: &'static str,
    /// A size that is worth finding, in that unit: what observability is measured by.
    pub typical: f64,
    /// Half the step of its central difference, in that unit.
    pub step: f64,
    /// Beyond this it is no plausible flaw, in that unit: the fit is held by a weak pull to zero of this width.
    pub plausible: f64,
}

const fn parameter(name: &'static str, typical: f64, step: f64, plausible: f64) -> ParameterInfo {
    ParameterInfo { name, typical, step, plausible }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// The parameters in the order of a [`super::Theta`].
pub const PARAMETERS: [ParameterInfo; PARAMETER_COUNT] = [
    parameter("offset_s", 0.01, 0.002, 1.0),
    parameter("rotation_x_rad", DEGREE, 5e-4, 0.6),
    parameter("rotation_y_rad", DEGREE, 5e-4, 0.6),
    parameter("rotation_z_rad", DEGREE, 5e-4, 0.6),
    parameter("translation_x_m", 0.01, 1e-3, 1.0),
    parameter("translation_y_m", 0.01, 1e-3, 1.0),
    parameter("translation_z_m", 0.01, 1e-3, 1.0),
    parameter("focal_share", 0.01, 5e-4, 0.5),
    parameter("principal_u_px", 5.0, 0.25, 200.0),
    parameter("principal_v_px", 5.0, 0.25, 200.0),
    parameter("tilt_x_rad", 0.5 * DEGREE, 1e-5, 0.6),
    parameter("tilt_y_rad", 0.5 * DEGREE, 1e-5, 0.6),
    parameter("scale_share", 0.02, 5e-4, 0.8),
    parameter("drift_x_m_s", 0.02, 5e-4, 2.0),
    parameter("drift_y_m_s", 0.02, 5e-4, 2.0),
    parameter("drift_z_m_s", 0.02, 5e-4, 2.0),
    parameter("yaw_drift_rad_s", 0.2 * DEGREE, 5e-5, 0.5),
];

impl Flaw {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::ClockOffset,
        Self::ExtrinsicRotation,
        Self::ExtrinsicTranslation,
        Self::FocalLength,
        Self::PrincipalPoint,
        Self::InitialTilt,
        Self::Scale,
        Self::Drift,
    ];

    /// The name in documents and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ClockOffset => "clock-offset",
            Self::ExtrinsicRotation => "extrinsic-rotation",
            Self::ExtrinsicTranslation => "extrinsic-translation",
            Self::FocalLength => "focal-length",
            Self::PrincipalPoint => "principal-point",
            Self::InitialTilt => "initial-tilt",
            Self::Scale => "scale",
            Self::Drift => "drift",
        }
    }

    /// The name in a sentence.
    pub const fn words(self) -> &'static str {
        match self {
            Self::ClockOffset => "clock offset",
            Self::ExtrinsicRotation => "extrinsic rotation",
            Self::ExtrinsicTranslation => "extrinsic translation",
            Self::FocalLength => "focal length",
            Self::PrincipalPoint => "principal point",
            Self::InitialTilt => "initial tilt",
            Self::Scale => "scale",
            Self::Drift => "drift",
        }
    }

    /// Where its parameters stand in a [`super::Theta`] and in [`PARAMETERS`].
    pub const fn parameters(self) -> Range<usize> {
        match self {
            Self::ClockOffset => 0..1,
            Self::ExtrinsicRotation => 1..4,
            Self::ExtrinsicTranslation => 4..7,
            Self::FocalLength => 7..8,
            Self::PrincipalPoint => 8..10,
            Self::InitialTilt => 10..12,
            Self::Scale => 12..13,
            Self::Drift => 13..17,
        }
    }

    /// Labels that would show it, or tell it from others.
    pub const fn labels_that_help(self) -> &'static str {
        match self {
            Self::ClockOffset => "frames where the camera's speed or turn rate changes",
            Self::ExtrinsicRotation => {
                "segments over which the camera turns by tens of degrees, about more than one axis"
            }
            Self::ExtrinsicTranslation => "near points, followed while the camera turns",
            Self::FocalLength => "points that move between the middle and the rim of the image",
            Self::PrincipalPoint => "points followed while the camera rolls about its optical axis",
            Self::InitialTilt => "longer segments, well after the start of the integration",
            Self::Scale => "near points, followed while the camera moves by metres",
            Self::Drift => "longer segments, and some later in the run",
        }
    }
}

impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())
    }
}

impl FromStr for Flaw {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|f| f.name() == text).ok_or_else(|| {
            let known: Vec<&str> = Self::ALL.iter().map(|f| f.name()).collect();
            format!("unknown flaw `{text}`; known: {}", known.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_belongs_to_one_flaw() {
        let all: Vec<usize> = Flaw::ALL.into_iter().flat_map(Flaw::parameters).collect();
        assert_eq!(all, (0..PARAMETER_COUNT).collect::<Vec<_>>());
        for flaw in Flaw::ALL {
            assert_eq!(flaw.name().parse::<Flaw>(), Ok(flaw));
        }
        assert!("fov".parse::<Flaw>().is_err());
    }
}
