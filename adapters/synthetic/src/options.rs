//! What can be chosen about a synthetic flight.

use nalgebra::Vector3;
use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;

/// Everything a synthetic flight depends on: equal options give equal bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct SyntheticOptions {
    /// Decides the furniture, its textures, the path and the noise.
    pub seed: u64,
    /// Length of the flight in seconds; 10 by default.
    pub duration_s: f64,
    /// Frames a second; 20 by default.
    pub rate_hz: f64,
    /// Columns of the images; 640 by default.
    pub width: u32,
    /// Rows of the images; 480 by default.
    pub height: u32,
    /// Inertial samples and poses a second; 200 by default.
    pub imu_rate_hz: f64,
    /// Constant bias of the gyroscope, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Constant bias of the accelerometer, m/s².
    pub accel_bias_m_s2: Vector3<f64>,
    /// Distance between neighbouring points of the cloud, metres; 0.02 by default.
    pub cloud_spacing_m: f64,
    /// Stamp of the first frame.
    pub start: Stamp,
    /// The flaws put into the estimates.
    pub flaws: Flaws,
}

/// The sizes of the flaws in the estimates and calibrations.
#[derive(Clone, Debug, PartialEq)]
pub struct Flaws {
    /// Constant error of the velocity in the world, m/s: about 2 % of a flight at 1 m/s.
    pub drift_m_s: Vector3<f64>,
    /// Constant error of the yaw rate about the world's vertical, rad/s.
    pub yaw_drift_rad_s: f64,
    /// Added to the stamps of the desynchronised estimate, ns.
    pub clock_offset_ns: i64,
    /// Rotation vector (rad) between the true body or camera and the wrong one.
    pub extrinsic_rotation_rad: Vector3<f64>,
    /// Factor on both focal lengths in the wrong calibration.
    pub focal_scale: f64,
    /// Standard deviation of white noise on each coordinate of the position, metres.
    pub noise_position_m: f64,
    /// Standard deviation of white noise on each component of the rotation vector, radians.
    pub noise_rotation_rad: f64,
}

impl Default for SyntheticOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            duration_s: 10.0,
            rate_hz: 20.0,
            width: 640,
            height: 480,
            imu_rate_hz: 200.0,
            gyro_bias_rad_s: Vector3::new(-0.0022, 0.0208, 0.0758),
            accel_bias_m_s2: Vector3::new(-0.0126, 0.0473, 0.0366),
            cloud_spacing_m: 0.02,
            start: Stamp::from_nanos(1_600_000_000_000_000_000),
            flaws: Flaws::default(),
        }
    }
}

impl Default for Flaws {
    fn default() -> Self {
        Self {
            drift_m_s: Vector3::new(0.016, -0.011, 0.005),
            yaw_drift_rad_s: 0.4_f64.to_radians(),
            clock_offset_ns: 50_000_000,
            // Two degrees, mostly about the optical axis' neighbours: an axis along the optical one would only roll.
            extrinsic_rotation_rad: Vector3::new(0.6, -0.7, 0.387).normalize() * 2.0_f64.to_radians(),
            focal_scale: 1.03,
            noise_position_m: 0.002,
            noise_rotation_rad: 0.1_f64.to_radians(),
        }
    }
}

impl SyntheticOptions {
    /// Number of frames: the first at the start, the last before `duration_s`.
    pub fn frame_count(&self) -> usize {
        (self.duration_s * self.rate_hz - 1e-9).ceil().max(1.0) as usize
    }

    /// Refuses what cannot be flown or would never end.
    ///
    /// # Errors
    /// [`DataError`] that names the option and its range.
    pub fn validate(&self) -> DataResult<()> {
        let ranges = [
            ("the duration in seconds", self.duration_s, 0.1, 3600.0),
            ("the frame rate in Hz", self.rate_hz, 0.5, 500.0),
            ("the width in pixels", f64::from(self.width), 64.0, 4096.0),
            ("the height in pixels", f64::from(self.height), 48.0, 4096.0),
            ("the rate of the inertial samples in Hz", self.imu_rate_hz, 10.0, 2000.0),
            ("the spacing of the cloud in metres", self.cloud_spacing_m, 0.001, 1.0),
            ("the focal scale", self.flaws.focal_scale, 0.1, 10.0),
        ];
        for (name, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return Err(DataError::new(format!("{name} is {value}, not within {low} to {high}")));
            }
        }
        let aspect = f64::from(self.width) / f64::from(self.height);
        if !(0.4..=3.0).contains(&aspect) {
            return Err(DataError::new(format!("the image is {}x{}", self.width, self.height))
                .hint("its sides may differ by a factor of three at most"));
        }
        let vectors = [
            self.gyro_bias_rad_s,
            self.accel_bias_m_s2,
            self.flaws.drift_m_s,
            self.flaws.extrinsic_rotation_rad,
            Vector3::new(
                self.flaws.yaw_drift_rad_s,
                self.flaws.noise_position_m,
                self.flaws.noise_rotation_rad,
            ),
        ];
        if !vectors.iter().flatten().all(|v| v.is_finite()) {
            return Err(DataError::new("a bias or flaw is not finite"));
        }
        if self.flaws.noise_position_m < 0.0 || self.flaws.noise_rotation_rad < 0.0 {
            return Err(DataError::new("a standard deviation is negative"));
        }
        // Room for the flight, the clock offset and a nanosecond count that stays a sensible date.
        const FAR: i64 = 4_000_000_000_000_000_000;
        if self.start.as_nanos() < 1_000_000_000
            || self.start.as_nanos() > FAR
            || self.flaws.clock_offset_ns.abs() > 1_000_000_000
        {
            return Err(DataError::new(
                "the start is before 1 s or beyond the year 2096, or the clock offset over 1 s",
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_flown_is_refused() {
        assert!(SyntheticOptions::default().validate().is_ok());
        assert_eq!(SyntheticOptions::default().frame_count(), 200);
        let bad: [fn(&mut SyntheticOptions); 6] = [
            |o| o.duration_s = f64::NAN,
            |o| o.rate_hz = 0.0,
            |o| (o.width, o.height) = (4000, 100),
            |o| o.cloud_spacing_m = 0.0,
            |o| o.flaws.noise_position_m = -1.0,
            |o| o.start = Stamp::from_nanos(-5),
        ];
        for change in bad {
            let mut options = SyntheticOptions::default();
            change(&mut options);
            assert!(options.validate().is_err(), "{options:?}");
        }
    }
}
