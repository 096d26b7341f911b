//! The flaws that are looked for, and the numbers that describe them.
//!
//! Every number is the error of what is in use, so that its correction is the same with the sign turned.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Number of parameters of all flaws together.
pub const PARAMETER_COUNT: usize = 26;

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
    /// Coefficients of the lens are off or were left out: used = true + error. Of an equidistant lens `k1` and `k2` are
    /// those of the angle, and there is no tangential part. Of a double sphere, an extended unified or a field-of-view
    /// lens it is not looked for.
    Distortion,
    /// fx alone is too long by a share, against fy.
    Aspect,
    /// The estimate's clock runs fast by a share, counted from the camera's first frame.
    ClockRate,
    /// The estimate's stamps are later by a constant from some time on.
    ClockStep,
    /// Rows are exposed one after the other, over this time from first to last; the stamp is that of the middle row.
    RollingShutter,
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
    /// Beyond this it is no plausible flaw, in that unit: never named.
    pub plausible: f64,
    /// The width of what is expected of it before anything is seen, in that unit: one deviation.
    pub expected: f64,
    /// The unit that people read it in.
    pub unit: Unit,
}

/// A unit that a number is shown in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Its sign, empty for a plain number.
    pub sign: &'static str,
    /// How many of it the parameter's own unit is.
    pub each: f64,
}

const fn parameter(
    name: &'static str,
    typical: f64,
    step: f64,
    plausible: f64,
    expected: f64,
    (sign, each): (&'static str, f64),
) -> ParameterInfo {
    ParameterInfo { name, typical, step, plausible, expected, unit: Unit { sign, each } }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const MS: (&str, f64) = ("ms", 1e3);
const S: (&str, f64) = ("s", 1.0);
const DEG: (&str, f64) = ("°", 1.0 / DEGREE);
const DEG_S: (&str, f64) = ("°/s", 1.0 / DEGREE);
const MM: (&str, f64) = ("mm", 1e3);
const MM_S: (&str, f64) = ("mm/s", 1e3);
const PERCENT: (&str, f64) = ("%", 1e2);
const PPM: (&str, f64) = ("ppm", 1e6);
const PX: (&str, f64) = ("px", 1.0);
const PLAIN: (&str, f64) = ("", 1.0);

/// The parameters in the order of a [`super::Theta`].
pub const PARAMETERS: [ParameterInfo; PARAMETER_COUNT] = [
    parameter("offset_s", 0.01, 0.002, 1.5, 0.03, MS),
    parameter("rotation_x_rad", DEGREE, 5e-4, 0.35, 1.2 * DEGREE, DEG),
    parameter("rotation_y_rad", DEGREE, 5e-4, 0.35, 1.2 * DEGREE, DEG),
    parameter("rotation_z_rad", DEGREE, 5e-4, 0.35, 1.2 * DEGREE, DEG),
    parameter("translation_x_m", 0.01, 1e-3, 0.5, 0.04, MM),
    parameter("translation_y_m", 0.01, 1e-3, 0.5, 0.04, MM),
    parameter("translation_z_m", 0.01, 1e-3, 0.5, 0.04, MM),
    parameter("focal_share", 0.01, 5e-4, 0.3, 0.025, PERCENT),
    parameter("principal_u_px", 5.0, 0.25, 80.0, 7.0, PX),
    parameter("principal_v_px", 5.0, 0.25, 80.0, 7.0, PX),
    parameter("tilt_x_rad", 0.5 * DEGREE, 1e-5, 0.2, 0.6 * DEGREE, DEG),
    parameter("tilt_y_rad", 0.5 * DEGREE, 1e-5, 0.2, 0.6 * DEGREE, DEG),
    parameter("scale_share", 0.02, 5e-4, 0.6, 0.04, PERCENT),
    parameter("drift_x_m_s", 0.02, 5e-4, 0.5, 0.03, MM_S),
    parameter("drift_y_m_s", 0.02, 5e-4, 0.5, 0.03, MM_S),
    parameter("drift_z_m_s", 0.02, 5e-4, 0.5, 0.03, MM_S),
    parameter("yaw_drift_rad_s", 0.2 * DEGREE, 5e-5, 0.1, 0.25 * DEGREE, DEG_S),
    parameter("k1", 0.02, 1e-3, 3.0, 0.08, PLAIN),
    parameter("k2", 0.02, 1e-3, 6.0, 0.06, PLAIN),
    parameter("p1", 0.001, 1e-4, 0.05, 0.002, PLAIN),
    parameter("p2", 0.001, 1e-4, 0.05, 0.002, PLAIN),
    parameter("aspect_share", 0.01, 5e-4, 0.3, 0.02, PERCENT),
    parameter("rate_share", 5e-4, 5e-5, 0.7, 0.002, PPM),
    parameter("step_s", 0.05, 0.002, 1.5, 0.08, MS),
    parameter("step_at_s", 1.0, 0.02, 1e9, 1e9, S),
    parameter("readout_s", 0.01, 5e-4, 0.2, 0.015, MS),
];

impl Flaw {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::ClockOffset,
        Self::ExtrinsicRotation,
        Self::ExtrinsicTranslation,
        Self::FocalLength,
        Self::PrincipalPoint,
        Self::InitialTilt,
        Self::Scale,
        Self::Drift,
        Self::Distortion,
        Self::Aspect,
        Self::ClockRate,
        Self::ClockStep,
        Self::RollingShutter,
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
            Self::Distortion => "distortion",
            Self::Aspect => "aspect",
            Self::ClockRate => "clock-rate",
            Self::ClockStep => "clock-step",
            Self::RollingShutter => "rolling-shutter",
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
            Self::Distortion => "distortion",
            Self::Aspect => "aspect (fx against fy)",
            Self::ClockRate => "clock rate",
            Self::ClockStep => "clock step",
            Self::RollingShutter => "rolling shutter",
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
            Self::Distortion => 17..21,
            Self::Aspect => 21..22,
            Self::ClockRate => 22..23,
            Self::ClockStep => 23..25,
            Self::RollingShutter => 25..26,
        }
    }

    /// Those of its parameters that are solved for: the time of a clock step is searched for instead.
    pub const fn solved(self) -> Range<usize> {
        match self {
            Self::ClockStep => 23..24,
            other => other.parameters(),
        }
    }

    /// Whether people meet it often: rarer ones are less likely before anything is seen.
    pub(super) const fn is_common(self) -> bool {
        !matches!(
            self,
            Self::Distortion | Self::Aspect | Self::ClockRate | Self::ClockStep | Self::RollingShutter
        )
    }

    /// Whether it is a flaw of the camera's calibration, on which the depth of key frames may depend.
    pub(super) const fn of_the_camera(self) -> bool {
        matches!(
            self,
            Self::ExtrinsicRotation
                | Self::ExtrinsicTranslation
                | Self::FocalLength
                | Self::PrincipalPoint
                | Self::Distortion
                | Self::Aspect
        )
    }

    /// Whether it moves the poses of the stream.
    pub(super) const fn of_the_motion(self) -> bool {
        !self.of_the_camera() && !matches!(self, Self::RollingShutter)
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
            Self::Distortion => "points that move between the middle and the corners of the image",
            Self::Aspect => "points that move across the image both ways, and a camera that rolls",
            Self::ClockRate => "labels over a longer part of the run",
            Self::ClockStep => "labels on both sides of the step, where the camera's speed changes",
            Self::RollingShutter => "fast motion, with points near the top and the bottom of the image",
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
