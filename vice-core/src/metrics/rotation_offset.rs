//! Is there a constant rotation between the body frames of estimate and reference?
//!
//! A wrong extrinsic calibration, or poses of a camera taken for those of the body, turn every motion of the estimate:
//! `δR_ref = X δR_est Xᵀ`, so the rotation vectors are related by `Log(δR_ref) = X Log(δR_est)`. Neither the world
//! frames nor an alignment enter. What is found is only reported, never applied.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::frames::{rotation_angle_rad, rotation_vector_rad};
use crate::metrics::align::best_rotation;
use crate::metrics::associate::PosePairs;

/// A motion is used once one of the streams has turned this far: enough to stand out of noise, radians.
const TURN_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Beyond this a rotation vector may flip its sign, radians.
const LARGEST_TURN_RAD: f64 = 150.0 * std::f64::consts::PI / 180.0;
/// Fewer motions than this tell nothing.
const FEWEST_MOTIONS: usize = 5;
/// The share of the rotation that is not about the main axis must reach this, or `X` about that axis is noise.
const SECOND_AXIS_SHARE: f64 = 0.01;
/// Smaller angles are as good as any calibration, radians.
const SUSPICIOUS_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// How much of the residual the rotation must explain to be believed.
const SUSPICIOUS_RESIDUAL: f64 = 0.5;

/// The constant rotation that explains the motions of an estimate best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationOffset {
    /// Takes directions in the estimate's body to directions in the reference's body.
    pub reference_body_from_estimate_body: UnitQuaternion<f64>,
    /// RMS of `Log(δR_ref) - X Log(δR_est)` over the motions, radians.
    pub residual_rad: f64,
    /// The same with the identity for `X`, radians.
    pub identity_residual_rad: f64,
    /// How many motions it was found from.
    pub motions: usize,
}

impl RotationOffset {
    /// The rotation between the body frames that fits best, in O(n).
    ///
    /// `None` where the motions do not determine it: fewer than five turns of 10 degrees, or all about one axis, as
    /// those of a robot on a flat floor.
    pub fn find(pairs: &PosePairs) -> Option<Self> {
        let turns = turns(pairs);
        if turns.len() < FEWEST_MOTIONS {
            return None;
        }
        let correlation: Matrix3<f64> =
            turns.iter().map(|(reference, estimate)| estimate * reference.transpose()).sum();
        let best = best_rotation(&correlation);
        // The gap is twice what the axes other than the main one contribute to the trace.
        if best.gap <= 2.0 * SECOND_AXIS_SHARE * best.trace {
            return None;
        }
        let x = best.rotation;
        let rms = |turn: UnitQuaternion<f64>| {
            let sum: f64 =
                turns.iter().map(|(reference, estimate)| (reference - turn * estimate).norm_squared()).sum();
            (sum / turns.len() as f64).sqrt()
        };
        Some(Self {
            reference_body_from_estimate_body: x,
            residual_rad: rms(x),
            identity_residual_rad: rms(UnitQuaternion::identity()),
            motions: turns.len(),
        })
    }

    /// Its angle in `[0, π]`, radians.
    pub fn angle_rad(&self) -> f64 {
        rotation_angle_rad(&self.reference_body_from_estimate_body)
    }

    /// Its axis, a unit vector that is the same in both body frames; `None` for no rotation.
    pub fn axis(&self) -> Option<Vector3<f64>> {
        rotation_vector_rad(&self.reference_body_from_estimate_body).try_normalize(0.0)
    }

    /// Whether it is worth a word: above 2 degrees, and it explains at least half of the residual.
    pub fn is_suspicious(&self) -> bool {
        self.angle_rad() > SUSPICIOUS_RAD
            && self.residual_rad < SUSPICIOUS_RESIDUAL * self.identity_residual_rad
    }
}

/// Rotation vectors `(reference, estimate)` of motions one after the other, each of at least [`TURN_RAD`].
fn turns(pairs: &PosePairs) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let (reference, estimate) = (pairs.reference(), pairs.estimate());
    let mut turns = Vec::new();
    let mut start = 0;
    for i in 1..pairs.len() {
        let turn = |poses: &[crate::frames::WorldFromBody]| {
            rotation_vector_rad(&(poses[start].rotation().inverse() * poses[i].rotation()))
        };
        let (r, e) = (turn(reference), turn(estimate));
        let largest = r.norm().max(e.norm());
        if largest < TURN_RAD {
            continue;
        }
        if largest < LARGEST_TURN_RAD {
            turns.push((r, e));
        }
        start = i;
    }
    turns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Rigid, WorldFromBody};
    use crate::time::Stamp;

    /// A wobbling flight; the estimate's body is turned by `offset`, its world is another one.
    fn flight(offset: Vector3<f64>, tilt: f64, noise: f64) -> PosePairs {
        let body_from_estimate = UnitQuaternion::from_scaled_axis(offset);
        let world = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.0, 2.0));
        PosePairs::new((0..400).map(|i| {
            let t = f64::from(i) * 0.05;
            let r = UnitQuaternion::from_euler_angles(tilt * t.sin(), tilt * (1.3 * t).cos(), t);
            let jitter = UnitQuaternion::from_scaled_axis(
                Vector3::new((91.0 * t).sin(), (77.0 * t).sin(), (83.0 * t).sin()) * noise,
            );
            let pose = |r| WorldFromBody::from_parts(Vector3::zeros(), r);
            (Stamp::from_nanos(i64::from(i)), pose(r), pose(world * r * jitter * body_from_estimate))
        }))
        .unwrap()
    }

    #[test]
    fn a_turned_body_is_found_whatever_the_world() {
        let offset = Vector3::new(0.1, -0.05, 0.2);
        let found = RotationOffset::find(&flight(offset, 0.5, 0.0)).unwrap();
        assert!((found.angle_rad() - offset.norm()).abs() < 1e-9);
        assert!((found.axis().unwrap() - offset.normalize()).norm() < 1e-9);
        assert!(found.residual_rad < 1e-12 && found.motions > 50);
        assert!(found.is_suspicious());
        let noisy = RotationOffset::find(&flight(offset, 0.5, 0.005)).unwrap();
        assert!((noisy.angle_rad() - offset.norm()).abs() < 0.01 && noisy.is_suspicious());
    }

    #[test]
    fn a_good_estimate_is_not_suspected() {
        let exact = RotationOffset::find(&flight(Vector3::zeros(), 0.5, 0.0)).unwrap();
        assert!(exact.angle_rad() < 1e-9 && !exact.is_suspicious());
        let noisy = RotationOffset::find(&flight(Vector3::zeros(), 0.5, 0.02)).unwrap();
        assert!(!noisy.is_suspicious(), "{noisy:?}");
    }

    #[test]
    fn turns_about_one_axis_tell_nothing() {
        assert_eq!(RotationOffset::find(&flight(Vector3::new(0.0, 0.0, 0.3), 0.0, 0.002)), None);
        let still = (0..9).map(|i| (Stamp::from_nanos(i), Rigid::identity(), Rigid::identity()));
        assert_eq!(RotationOffset::find(&PosePairs::new(still).unwrap()), None);
    }
}
