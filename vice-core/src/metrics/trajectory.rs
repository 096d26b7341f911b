//! The absolute errors of an estimate against a reference, pose by pose, and what sums them up.
//!
//! Everything here takes the pairs as they are: align the estimate first ([`crate::metrics::align`]).

use crate::error::{DataError, DataResult};
use crate::frames::{WorldFromBody, rotation_angle_rad};
use crate::metrics::associate::PosePairs;
use crate::statistics::median;

/// What a list of errors amounts to, in the unit of the errors (`sse` in its square).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Statistics {
    /// Root of the mean square.
    pub rmse: f64,
    /// Mean.
    pub mean: f64,
    /// Median; the mean of the middle two of an even number.
    pub median: f64,
    /// Population standard deviation.
    pub std: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// Sum of squares.
    pub sse: f64,
}

impl Statistics {
    /// The statistics of a list of errors, in O(n).
    ///
    /// # Errors
    /// [`DataError`] if there are none, or they are not finite or too large for their squares to be summed.
    pub fn of(errors: &[f64]) -> DataResult<Self> {
        if errors.is_empty() {
            return Err(DataError::new("no errors to sum up"));
        }
        let n = errors.len() as f64;
        let sse: f64 = errors.iter().map(|e| e * e).sum();
        let mean = errors.iter().sum::<f64>() / n;
        if !(sse.is_finite() && mean.is_finite()) {
            return Err(DataError::new("the errors are not finite or too large to be squared"));
        }
        let variance = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n;
        let median = median(&mut errors.to_vec()).unwrap_or(mean);
        Ok(Self {
            rmse: (sse / n).sqrt(),
            mean,
            median,
            std: variance.sqrt(),
            min: errors.iter().copied().fold(f64::INFINITY, f64::min),
            max: errors.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            sse,
        })
    }
}

/// The absolute pose error (APE) at each pair: what is left of `T_ref⁻¹ T_est`.
#[derive(Clone, Debug, PartialEq)]
pub struct ApeErrors {
    /// Distance of the positions, metres.
    pub translation_m: Vec<f64>,
    /// Angle between the orientations, radians in `[0, π]`.
    pub rotation_rad: Vec<f64>,
    /// Frobenius norm of `T_ref⁻¹ T_est - I`, metres and no unit mixed.
    pub full: Vec<f64>,
}

/// Statistics of the absolute pose error.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ape {
    /// Of the distances, metres.
    pub translation_m: Statistics,
    /// Of the angles, radians.
    pub rotation_rad: Statistics,
    /// Of the Frobenius norms.
    pub full: Statistics,
}

impl ApeErrors {
    /// The errors of each pair.
    pub fn of(pairs: &PosePairs) -> Self {
        let n = pairs.len();
        let mut errors = Self {
            translation_m: Vec::with_capacity(n),
            rotation_rad: Vec::with_capacity(n),
            full: Vec::with_capacity(n),
        };
        for (reference, estimate) in pairs.iter() {
            // Rotating the difference into the reference's body does not change its length.
            let translation = (estimate.translation() - reference.translation()).norm();
            let rotation = reference.rotation().inverse() * estimate.rotation();
            // |R - I|² = 2 (3 - trace R) = 8 sin²(angle / 2), and the quaternion has that sine without cancellation.
            let sine = rotation.imag().norm();
            errors.translation_m.push(translation);
            errors.rotation_rad.push(rotation_angle_rad(&rotation));
            errors.full.push(translation.hypot(8.0_f64.sqrt() * sine));
        }
        errors
    }

    /// The statistics of each kind of error.
    ///
    /// # Errors
    /// [`DataError`] if positions are so far apart that their squares do not fit a double.
    pub fn statistics(&self) -> DataResult<Ape> {
        Ok(Ape {
            translation_m: Statistics::of(&self.translation_m)?,
            rotation_rad: Statistics::of(&self.rotation_rad)?,
            full: Statistics::of(&self.full)?,
        })
    }
}

/// The paper's three numbers of an estimate against a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Summary {
    /// RMSE_3D: root mean square of the position difference, metres.
    pub rmse_3d_m: f64,
    /// AOE: root mean square of `|Log(RᵀR̂)|`, radians.
    pub aoe_rad: f64,
    /// ROE: mean over consecutive pairs of `|Log(δRᵀδR̂)|`, radians; `None` for a single pose.
    pub roe_rad: Option<f64>,
}

impl Summary {
    /// The paper's numbers.
    ///
    /// # Errors
    /// [`DataError`] as [`ApeErrors::statistics`].
    pub fn of(pairs: &PosePairs) -> DataResult<Self> {
        let errors = ApeErrors::of(pairs);
        let roe_rad = (pairs.len() > 1).then(|| {
            let sum: f64 =
                (1..pairs.len()).map(|i| rotation_angle_rad(&relative_error(pairs, i - 1, i).rotation)).sum();
            sum / (pairs.len() - 1) as f64
        });
        Ok(Self {
            rmse_3d_m: Statistics::of(&errors.translation_m)?.rmse,
            aoe_rad: Statistics::of(&errors.rotation_rad)?.rmse,
            roe_rad,
        })
    }
}

/// By how much the estimate's motion between two pairs is off.
pub(super) struct RelativeError {
    /// Distance between where the two motions lead to, metres.
    pub(super) translation_m: f64,
    /// `δRᵀ δR̂`.
    pub(super) rotation: nalgebra::UnitQuaternion<f64>,
}

/// The error of the estimate's motion from pair `i` to pair `j`: what is left of `δT_ref⁻¹ δT_est`.
pub(super) fn relative_error(pairs: &PosePairs, i: usize, j: usize) -> RelativeError {
    let motion = |poses: &[WorldFromBody]| poses[i].inverse() * poses[j];
    let (reference, estimate) = (motion(pairs.reference()), motion(pairs.estimate()));
    RelativeError {
        translation_m: (estimate.translation() - reference.translation()).norm(),
        rotation: reference.rotation().inverse() * estimate.rotation(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Rigid;
    use crate::time::Stamp;
    use approx::assert_relative_eq;
    use nalgebra::{Matrix4, UnitQuaternion, Vector3};

    #[test]
    fn statistics_of_known_lists() {
        let s = Statistics::of(&[4.0, 1.0, 3.0, 2.0]).unwrap();
        assert_eq!((s.mean, s.median, s.min, s.max, s.sse), (2.5, 2.5, 1.0, 4.0, 30.0));
        assert_relative_eq!(s.rmse, 7.5_f64.sqrt());
        assert_relative_eq!(s.std, 1.25_f64.sqrt());
        assert_eq!(Statistics::of(&[3.0, 1.0, 2.0]).unwrap().median, 2.0);
        assert_eq!(Statistics::of(&[5.0]).unwrap().median, 5.0);
        assert!(Statistics::of(&[]).is_err());
        assert!(Statistics::of(&[1e200]).is_err());
        assert!(Statistics::of(&[f64::NAN]).is_err());
    }

    #[test]
    fn the_full_error_is_the_frobenius_norm() {
        let pose = |t: [f64; 3], r: [f64; 3]| {
            WorldFromBody::from_parts(t.into(), UnitQuaternion::from_scaled_axis(Vector3::from(r)))
        };
        for turn in [[0.3, -0.2, 0.9], [3.0, 0.5, 0.0], [0.0; 3]] {
            let (reference, estimate) =
                (pose([1.0, 2.0, 3.0], [0.1, 0.2, 0.3]), pose([1.5, 1.0, 3.25], turn));
            let left = (reference.inverse() * estimate).isometry().to_homogeneous();
            let pairs = PosePairs::new([(Stamp::from_nanos(0), reference, estimate)]).unwrap();
            let errors = ApeErrors::of(&pairs);
            assert_relative_eq!(errors.full[0], (left - Matrix4::identity()).norm(), max_relative = 1e-12);
        }
    }

    #[test]
    fn a_single_pose_has_no_relative_error() {
        let pairs = PosePairs::new([(Stamp::from_nanos(0), Rigid::identity(), Rigid::identity())]).unwrap();
        let summary = Summary::of(&pairs).unwrap();
        assert_eq!(summary, Summary { rmse_3d_m: 0.0, aoe_rad: 0.0, roe_rad: None });
    }
}
