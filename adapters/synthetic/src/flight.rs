//! The flight: an analytic curve, so that velocity, acceleration and angular rate are exact.
//!
//! The robot circles the furniture in the middle of the room at about 1 m/s, looks at it from about 1.5 m above the
//! floor, pitched down by some 31 degrees, and sways: each coordinate is a sum of sines, carried with its first two
//! derivatives ([`Jet`]).

use std::f64::consts::{PI, TAU};
use std::ops::{Add, Mul};

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use vice_core::frames::{BodyFromCamera, Rigid, WorldFromBody};
use vice_core::imu::GRAVITY_Z_UP_M_S2;
use vice_core::random::SplitMix;

/// A number and its first two derivatives by time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Jet {
    value: f64,
    rate: f64,
    rate2: f64,
}

impl Jet {
    const fn constant(value: f64) -> Self {
        Self { value, rate: 0.0, rate2: 0.0 }
    }

    /// `f(self)` from `f`, `f'` and `f''` there.
    fn chain(self, f: f64, f1: f64, f2: f64) -> Self {
        Self { value: f, rate: f1 * self.rate, rate2: f2 * self.rate * self.rate + f1 * self.rate2 }
    }

    fn sin(self) -> Self {
        let (s, c) = self.value.sin_cos();
        self.chain(s, c, -s)
    }

    fn cos(self) -> Self {
        let (s, c) = self.value.sin_cos();
        self.chain(c, -s, -c)
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, rate: self.rate + o.rate, rate2: self.rate2 + o.rate2 }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            value: self.value * o.value,
            rate: self.rate * o.value + self.value * o.rate,
            rate2: self.rate2 * o.value + 2.0 * self.rate * o.rate + self.value * o.rate2,
        }
    }
}

/// `base + slope t + Σ amplitude sin(frequency t + phase)`.
#[derive(Clone, Debug)]
struct Wave {
    base: f64,
    slope: f64,
    terms: [(f64, f64, f64); 2],
}

impl Wave {
    fn new(base: f64, slope: f64, terms: [(f64, f64); 2], rng: &mut SplitMix) -> Self {
        Self { base, slope, terms: terms.map(|(a, w)| (a, w, rng.uniform(0.0, TAU))) }
    }

    fn at(&self, t_s: f64) -> Jet {
        let line = Jet { value: self.base + self.slope * t_s, rate: self.slope, rate2: 0.0 };
        self.terms.iter().fold(line, |sum, (amplitude, frequency, phase)| {
            let angle = Jet { value: frequency * t_s + phase, rate: *frequency, rate2: 0.0 };
            sum + Jet::constant(*amplitude) * angle.sin()
        })
    }
}

/// The state of the body at an instant, all of it exact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Pose of the body; z of the world is up, the floor z = 0.
    pub world_from_body: WorldFromBody,
    /// Velocity in the world, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Acceleration in the world, without gravity, m/s².
    pub acceleration_m_s2: Vector3<f64>,
    /// Angular rate in the body frame, rad/s.
    pub angular_rate_rad_s: Vector3<f64>,
}

impl State {
    /// What an ideal accelerometer measures: `Rᵀ (a - g)`, m/s² in the body frame.
    pub fn specific_force_m_s2(&self) -> Vector3<f64> {
        self.world_from_body.inverse().rotate(&(self.acceleration_m_s2 - GRAVITY_Z_UP_M_S2))
    }
}

/// The path of the body through the room, as a function of time for all times.
#[derive(Clone, Debug)]
pub struct Flight {
    radius_m: Wave,
    bearing_rad: Wave,
    height_m: Wave,
    yaw_offset_rad: Wave,
    pitch_rad: Wave,
    roll_rad: Wave,
    levelled_from_body: UnitQuaternion<f64>,
}

/// Euler angles z-y-x of the levelled body (x forward, y left, z up) in the world.
struct Attitude {
    yaw: Jet,
    pitch: Jet,
    roll: Jet,
}

impl Attitude {
    fn rotation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_euler_angles(self.roll.value, self.pitch.value, self.yaw.value)
    }

    /// Angular rate in the levelled body frame (any book on Euler angles; checked against differences in the tests).
    fn angular_rate_rad_s(&self) -> Vector3<f64> {
        let (sin_roll, cos_roll) = self.roll.value.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch.value.sin_cos();
        Vector3::new(
            self.roll.rate - self.yaw.rate * sin_pitch,
            self.pitch.rate * cos_roll + self.yaw.rate * cos_pitch * sin_roll,
            -self.pitch.rate * sin_roll + self.yaw.rate * cos_pitch * cos_roll,
        )
    }
}

impl Flight {
    /// The flight of a seed.
    pub fn new(seed: u64) -> Self {
        let mut rng = SplitMix::for_purpose(seed, 2);
        let sense = if rng.uniform(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
        let degrees = |a: f64| a.to_radians();
        Self {
            radius_m: Wave::new(2.35, 0.0, [(0.22, 0.55), (0.08, 1.3)], &mut rng),
            bearing_rad: Wave::new(
                rng.uniform(0.0, TAU),
                sense * rng.uniform(0.38, 0.44),
                [(0.12, 0.7), (0.02, 1.9)],
                &mut rng,
            ),
            height_m: Wave::new(1.5, 0.0, [(0.18, 0.6), (0.06, 1.7)], &mut rng),
            yaw_offset_rad: Wave::new(PI, 0.0, [(0.13, 0.5), (0.03, 2.1)], &mut rng),
            pitch_rad: Wave::new(degrees(31.0), 0.0, [(degrees(4.0), 0.8), (degrees(1.3), 2.3)], &mut rng),
            roll_rad: Wave::new(0.0, 0.0, [(degrees(3.5), 0.9), (degrees(1.3), 2.2)], &mut rng),
            levelled_from_body: levelled_from_body(),
        }
    }

    /// The state `t_s` seconds after the first frame; negative times are before it.
    pub fn at(&self, t_s: f64) -> State {
        let (radius, bearing, height) =
            (self.radius_m.at(t_s), self.bearing_rad.at(t_s), self.height_m.at(t_s));
        let (x, y) = (radius * bearing.cos(), radius * bearing.sin());
        let attitude = Attitude {
            yaw: bearing + self.yaw_offset_rad.at(t_s),
            pitch: self.pitch_rad.at(t_s),
            roll: self.roll_rad.at(t_s),
        };
        let rotation = attitude.rotation() * self.levelled_from_body;
        State {
            world_from_body: Rigid::from_parts(Vector3::new(x.value, y.value, height.value), rotation),
            velocity_m_s: Vector3::new(x.rate, y.rate, height.rate),
            acceleration_m_s2: Vector3::new(x.rate2, y.rate2, height.rate2),
            angular_rate_rad_s: self.levelled_from_body.inverse() * attitude.angular_rate_rad_s(),
        }
    }
}

/// The body is mounted as EuRoC's is: x up, y to the right, z forward.
fn levelled_from_body() -> UnitQuaternion<f64> {
    let columns = Matrix3::from_columns(&[Vector3::z(), -Vector3::y(), Vector3::x()]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}

/// The extrinsics: a quarter turn about the optical axis, a degree or two of mounting error, and some centimetres.
pub(crate) fn body_from_camera() -> BodyFromCamera {
    // Camera x is body y, camera y is minus body x.
    let quarter =
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[Vector3::y(), -Vector3::x(), Vector3::z()]));
    let mounting =
        UnitQuaternion::from_euler_angles(0.9_f64.to_radians(), -1.4_f64.to_radians(), 0.6_f64.to_radians());
    let rotation = UnitQuaternion::from_rotation_matrix(&quarter) * mounting;
    Rigid::from_parts(Vector3::new(-0.0216, -0.0647, 0.0098), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use vice_core::frames::rotation_vector_rad;

    #[test]
    fn derivatives_are_those_of_the_curve() {
        let h = 1e-4;
        for seed in 0..5 {
            let flight = Flight::new(seed);
            for t in [-0.2, 0.0, 0.73, 4.1, 9.9] {
                let (before, now, after) = (flight.at(t - h), flight.at(t), flight.at(t + h));
                let p = |s: &State| s.world_from_body.translation();
                assert_relative_eq!((p(&after) - p(&before)) / (2.0 * h), now.velocity_m_s, epsilon = 1e-6);
                let dv = (after.velocity_m_s - before.velocity_m_s) / (2.0 * h);
                assert_relative_eq!(dv, now.acceleration_m_s2, epsilon = 1e-6);
                let turn = before.world_from_body.rotation().inverse() * after.world_from_body.rotation();
                let rate = rotation_vector_rad(&turn) / (2.0 * h);
                assert_relative_eq!(rate, now.angular_rate_rad_s, epsilon = 1e-6);
            }
        }
    }

    #[test]
    fn it_flies_at_walking_pace_and_looks_down_at_the_middle() {
        for seed in 0..20 {
            let flight = Flight::new(seed);
            for step in 0..200 {
                let state = flight.at(f64::from(step) * 0.05);
                let speed = state.velocity_m_s.norm();
                assert!((0.5..1.6).contains(&speed), "seed {seed}: {speed} m/s");
                let world_from_camera = state.world_from_body * body_from_camera();
                let down = -world_from_camera.rotate(&Vector3::z()).z;
                assert!((24.0..40.0).contains(&down.asin().to_degrees()), "seed {seed}: {down}");
                let p = world_from_camera.translation();
                let ahead = world_from_camera.rotate(&Vector3::z());
                let inward = -(p.x * ahead.x + p.y * ahead.y) / (p.xy().norm() * ahead.xy().norm());
                assert!(inward > 20.0_f64.to_radians().cos(), "seed {seed}: looks away from the middle");
            }
        }
    }
}
