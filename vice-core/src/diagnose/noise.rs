//! What is noise and no flaw: of labels, and of an odometry that wanders.
//!
//! Sizes are known to a factor before anything is seen, and estimated from the labels from there.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Number of sizes.
pub(super) const SIZES: usize = 6;
/// Position of each among them.
pub(super) const WHITE: usize = 0;
pub(super) const WALK: usize = 1;
pub(super) const POSITION: usize = 2;
pub(super) const YAW: usize = 3;
pub(super) const LEAN: usize = 4;
pub(super) const JITTER: usize = 5;

/// A label's noise, one coordinate, pixels.
const LABEL_PX: f64 = 0.6;
/// A label's slow walk after its key frame, pixels a root second.
const LABEL_WALK_PX: f64 = 0.2;
/// How well each size is known: one deviation of its logarithm.
const DEVIATIONS: [f64; SIZES] = [0.5, 0.7, 0.5, 0.5, 0.5, 0.6];
/// Roll and pitch lean by this times the yaw's walk, jitter of rotation and position by these.
const LEAN_TO_YAW: f64 = 2.0;
const JITTER_TO_YAW: f64 = 0.42;
const JITTER_TO_POSITION: f64 = 0.24;
/// Noise of a consumer's IMU: m/s² and rad/s a root hertz.
/// An integration by Euler's method makes as much again.
const ACCEL: f64 = 4e-3;
const GYRO: f64 = 3e-4;

/// How much an odometry may wander and still be healthy.
///
/// `4mm,0.05deg` (a root second), or `wheel`, `vio`, `mocap`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometryNoise {
    /// Walk of the position, one axis, metres a root second.
    pub position_m: f64,
    /// Walk of the yaw, radians a root second.
    pub yaw_rad: f64,
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

impl OdometryNoise {
    /// Wheel encoders and a gyroscope.
    pub const WHEEL: Self = Self { position_m: 0.01, yaw_rad: 0.12 * DEGREE };
    /// A good visual-inertial odometry: the default.
    pub const VIO: Self = Self { position_m: 0.005, yaw_rad: 0.06 * DEGREE };
    /// A motion-capture system or a total station with an IMU.
    pub const MOCAP: Self = Self { position_m: 0.001, yaw_rad: 0.02 * DEGREE };
}

impl Default for OdometryNoise {
    fn default() -> Self {
        Self::VIO
    }
}

impl fmt::Display for OdometryNoise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3}mm,{:.4}deg", self.position_m * 1e3, self.yaw_rad / DEGREE)
    }
}

impl FromStr for OdometryNoise {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "wheel" => return Ok(Self::WHEEL),
            "vio" => return Ok(Self::VIO),
            "mocap" => return Ok(Self::MOCAP),
            _ => {}
        }
        let wrong = || {
            format!(
                "`{text}` is no odometry noise: expected wheel, vio, mocap or as 4mm,0.05deg (a root second)"
            )
        };
        let (position, yaw) = text.split_once(',').ok_or_else(wrong)?;
        let number = |text: &str, units: [(&str, f64); 3]| -> Option<f64> {
            let (value, times) =
                units.iter().find_map(|(unit, times)| Some((text.trim().strip_suffix(unit)?, *times)))?;
            let value = value.trim().parse::<f64>().ok()? * times;
            (value > 0.0 && value.is_finite()).then_some(value)
        };
        let position_m = number(position, [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)]).ok_or_else(wrong)?;
        let yaw_rad = number(yaw, [("deg", DEGREE), ("mrad", 1e-3), ("rad", 1.0)]).ok_or_else(wrong)?;
        if position_m > 10.0 || yaw_rad > 1.0 {
            return Err(format!("`{text}` is more than an odometry wanders"));
        }
        Ok(Self { position_m, yaw_rad })
    }
}

/// Logarithms of the sizes over their defaults.
pub(super) type Logs = [f64; SIZES];

/// The model of the noise: defaults, and which of them are free.
#[derive(Clone, Copy, Debug)]
pub(super) struct NoiseModel {
    pub(super) odometry: OdometryNoise,
    /// An integrated IMU wanders by its sensors: position and yaw stand for accelerometer and gyroscope.
    pub(super) inertial: bool,
}

/// Sizes in use.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    /// Label, one coordinate, pixels.
    pub(super) white_px: f64,
    /// Pixels a root second.
    pub(super) walk_px: f64,
    /// Metres a root second.
    pub(super) position_m: f64,
    /// Radians a root second.
    pub(super) yaw_rad: f64,
    /// Deviation of roll and pitch, radians.
    pub(super) lean_rad: f64,
    /// From frame to frame, metres and radians.
    pub(super) jitter_m: f64,
    pub(super) jitter_rad: f64,
    /// m/s² a root hertz, zero unless inertial.
    pub(super) accel: f64,
    /// rad/s a root hertz, zero unless inertial.
    pub(super) gyro: f64,
}

impl NoiseModel {
    pub(super) fn sizes(&self, logs: &Logs) -> Sizes {
        let times = logs.map(f64::exp);
        let OdometryNoise { position_m, yaw_rad } = self.odometry;
        let white_px = LABEL_PX * times[WHITE];
        let walk_px = LABEL_WALK_PX * times[WALK];
        if self.inertial {
            return Sizes {
                white_px,
                walk_px,
                // Euler's method is late by half a sample: millimetres as the speed changes.
                position_m: 2e-3,
                yaw_rad: 1e-5,
                lean_rad: 0.0,
                jitter_m: 1e-3,
                jitter_rad: 1e-4,
                accel: ACCEL * times[POSITION],
                gyro: GYRO * times[YAW],
            };
        }
        Sizes {
            white_px,
            walk_px,
            position_m: position_m * times[POSITION],
            yaw_rad: yaw_rad * times[YAW],
            lean_rad: LEAN_TO_YAW * yaw_rad * times[LEAN],
            jitter_m: JITTER_TO_POSITION * position_m * times[JITTER],
            jitter_rad: JITTER_TO_YAW * yaw_rad * times[JITTER],
            accel: 0.0,
            gyro: 0.0,
        }
    }

    /// Which sizes are estimated.
    pub(super) fn free(&self) -> &'static [usize] {
        if self.inertial {
            &[WHITE, WALK, POSITION, YAW]
        } else {
            &[WHITE, WALK, POSITION, YAW, LEAN, JITTER]
        }
    }

    /// How likely sizes are before anything is seen, as a logarithm without its constant.
    pub(super) fn prior(&self, logs: &Logs) -> f64 {
        self.free().iter().map(|i| -0.5 * (logs[*i] / DEVIATIONS[*i]).powi(2)).sum()
    }

    pub(super) fn deviation(size: usize) -> f64 {
        DEVIATIONS[size]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odometry_noise_is_read_with_its_units() {
        let read: OdometryNoise = "4mm,0.05deg".parse().unwrap();
        assert!((read.position_m - 0.004).abs() < 1e-12 && (read.yaw_rad - 0.05 * DEGREE).abs() < 1e-12);
        assert_eq!("wheel".parse(), Ok(OdometryNoise::WHEEL));
        assert_eq!("1cm, 2mrad".parse(), Ok(OdometryNoise { position_m: 0.01, yaw_rad: 0.002 }));
        for wrong in ["4,0.05", "4mm", "-4mm,1deg", "nanmm,1deg", "20m,1deg", "good"] {
            assert!(wrong.parse::<OdometryNoise>().is_err(), "{wrong}");
        }
    }
}
