//! Moving an estimate into the reference's world before the two are compared.
//!
//! Least squares over positions after Umeyama (IEEE PAMI 13(4), 1991). The rotation is found as the eigenvector of
//! Horn's 4x4 matrix (J. Opt. Soc. Am. A 4(4), 1987): the same minimum, never a reflection, and exact to rounding for
//! flat and nearly straight paths too, where products of the covariance with itself would lose half the digits.

use std::str::FromStr;

use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3};

use crate::error::{DataError, DataResult};
use crate::frames::{Rigid, WorldFromBody};
use crate::metrics::associate::PosePairs;

/// What may be moved before trajectories are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Alignment {
    /// Nothing: the two already share a world frame.
    None,
    /// The first pose of the estimate is put onto the reference's.
    FirstPose,
    /// Rotation about the world's z axis, and translation (four degrees of freedom: what an IMU cannot observe).
    Yaw,
    /// Rotation and translation.
    #[default]
    Se3,
    /// Rotation, translation and scale.
    Sim3,
}

impl Alignment {
    /// All alignments.
    pub const ALL: [Self; 5] = [Self::None, Self::FirstPose, Self::Yaw, Self::Se3, Self::Sim3];

    /// The name used in options and results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::FirstPose => "first-pose",
            Self::Yaw => "yaw",
            Self::Se3 => "se3",
            Self::Sim3 => "sim3",
        }
    }
}

impl FromStr for Alignment {
    type Err = DataError;
    fn from_str(name: &str) -> DataResult<Self> {
        Self::ALL.into_iter().find(|a| a.name() == name).ok_or_else(|| {
            DataError::new(format!("`{name}` is no alignment"))
                .hint("one of none, first-pose, yaw, se3, sim3")
        })
    }
}

/// Takes the estimate's world to the reference's: `p_reference = scale * rotation * p_estimate + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceFromEstimate {
    /// The rotation.
    pub rotation: UnitQuaternion<f64>,
    /// The translation, metres of the reference.
    pub translation_m: Vector3<f64>,
    /// Metres of the reference for one of the estimate; 1 except for [`Alignment::Sim3`].
    pub scale: f64,
}

impl ReferenceFromEstimate {
    /// Changes nothing.
    pub fn identity() -> Self {
        Self { rotation: UnitQuaternion::identity(), translation_m: Vector3::zeros(), scale: 1.0 }
    }

    /// A pose of the estimate in the reference's world; its orientation is turned, not scaled.
    pub fn apply(&self, pose: &WorldFromBody) -> WorldFromBody {
        let position = self.scale * (self.rotation * pose.translation()) + self.translation_m;
        Rigid::from_parts(position, self.rotation * pose.rotation())
    }

    /// The pairs with the estimate in the reference's world.
    #[must_use]
    pub fn apply_to(&self, pairs: &PosePairs) -> PosePairs {
        pairs.map_estimate(|pose| self.apply(pose))
    }

    /// Puts the estimate of pairs into the reference's world.
    pub fn apply_in_place(&self, pairs: &mut PosePairs) {
        pairs.change_estimate(|pose| self.apply(pose));
    }
}

/// The transform that aligns an estimate with its reference, from the first `n_to_align` pairs (`None`: all of them,
/// as does a number above what there is).
///
/// # Errors
/// [`DataError`] if the positions do not determine it: fewer than three poses for SE3 and Sim3, two for yaw, positions
/// that coincide or lie on a line; or if they are too large to be summed up.
pub fn align(
    pairs: &PosePairs,
    alignment: Alignment,
    n_to_align: Option<usize>,
) -> DataResult<ReferenceFromEstimate> {
    let n = n_to_align.map_or(pairs.len(), |n| n.min(pairs.len()));
    if n == 0 {
        return Err(DataError::new("alignment on no pose at all").hint("align on at least three"));
    }
    match alignment {
        Alignment::None => Ok(ReferenceFromEstimate::identity()),
        Alignment::FirstPose => {
            let to = pairs.reference()[0] * pairs.estimate()[0].inverse();
            Ok(ReferenceFromEstimate { rotation: to.rotation(), translation_m: to.translation(), scale: 1.0 })
        }
        Alignment::Yaw => {
            let moments = Moments::of(pairs, n, alignment)?;
            let c = moments.correlation;
            // Only x and y can tell the angle: maximise sum of r · Rz e.
            let (sine, cosine) = (c[(0, 1)] - c[(1, 0)], c[(0, 0)] + c[(1, 1)]);
            if sine.hypot(cosine) <= undetermined_below(&moments) {
                return Err(undetermined(alignment, n, "the positions do not move in the horizontal plane"));
            }
            let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), sine.atan2(cosine));
            Ok(moments.with_rotation(rotation, 1.0))
        }
        Alignment::Se3 | Alignment::Sim3 => {
            if n < 3 {
                return Err(undetermined(alignment, n, "fewer than three poses"));
            }
            let moments = Moments::of(pairs, n, alignment)?;
            let best = best_rotation(&moments.correlation);
            if best.gap <= undetermined_below(&moments) {
                return Err(undetermined(alignment, n, "the positions coincide or lie on a line"));
            }
            let scale = if alignment == Alignment::Sim3 { best.trace / moments.estimate_spread } else { 1.0 };
            Ok(moments.with_rotation(best.rotation, scale))
        }
    }
}

fn undetermined(alignment: Alignment, n: usize, why: &str) -> DataError {
    DataError::new(format!("{} alignment on {n} poses is not determined: {why}", alignment.name()))
        .hint("align with first-pose or none, or on more poses")
}

/// Below this the angle is rounding: a path is taken as a line where its width is below a millionth of its length,
/// or (as evo does) below the square root of the machine epsilon in metres.
fn undetermined_below(moments: &Moments) -> f64 {
    let size = (moments.estimate_spread * moments.reference_spread).sqrt();
    (1e-12 * size).max(f64::EPSILON)
}

/// Means and mean products of the centred positions, in m and m².
struct Moments {
    mean_estimate: Vector3<f64>,
    mean_reference: Vector3<f64>,
    /// Mean of `e rᵀ`.
    correlation: Matrix3<f64>,
    estimate_spread: f64,
    reference_spread: f64,
}

impl Moments {
    fn of(pairs: &PosePairs, n: usize, alignment: Alignment) -> DataResult<Self> {
        // Relative to the first pose, so that coordinates far from the origin (a map's) keep their digits.
        let (r0, e0) = (pairs.reference()[0].translation(), pairs.estimate()[0].translation());
        let positions =
            || pairs.iter().take(n).map(move |(r, e)| (r.translation() - r0, e.translation() - e0));
        let (mut mean_r, mut mean_e) = (Vector3::zeros(), Vector3::zeros());
        for (r, e) in positions() {
            mean_r += r;
            mean_e += e;
        }
        let count = n as f64;
        mean_r /= count;
        mean_e /= count;
        let mut correlation = Matrix3::zeros();
        let (mut spread_r, mut spread_e) = (0.0, 0.0);
        for (r, e) in positions() {
            let (r, e) = (r - mean_r, e - mean_e);
            correlation += e * r.transpose();
            spread_r += r.norm_squared();
            spread_e += e.norm_squared();
        }
        let moments = Self {
            mean_estimate: mean_e + e0,
            mean_reference: mean_r + r0,
            correlation: correlation / count,
            estimate_spread: spread_e / count,
            reference_spread: spread_r / count,
        };
        // The spreads bound the correlation; their product must stay in range too.
        if (moments.estimate_spread * moments.reference_spread).is_finite() {
            Ok(moments)
        } else {
            Err(DataError::new(format!("{} alignment: the positions are too large", alignment.name())))
        }
    }

    fn with_rotation(&self, rotation: UnitQuaternion<f64>, scale: f64) -> ReferenceFromEstimate {
        let translation_m = self.mean_reference - scale * (rotation * self.mean_estimate);
        ReferenceFromEstimate { rotation, translation_m, scale }
    }
}

/// The rotation that turns one set of vectors onto another.
pub(crate) struct BestRotation {
    /// Takes vectors of the first set to those of the second.
    pub(crate) rotation: UnitQuaternion<f64>,
    /// `trace(R * correlation)`, the largest there is: Umeyama's `trace(D S)`.
    pub(crate) trace: f64,
    /// By how much the next best is worse; at zero the rotation is arbitrary.
    pub(crate) gap: f64,
}

/// Maximises `sum of b · R a` for a correlation `sum of a bᵀ`, which must be finite.
pub(crate) fn best_rotation(correlation: &Matrix3<f64>) -> BestRotation {
    let s = |a: usize, b: usize| correlation[(a, b)];
    let (x, y, z) = (s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0));
    let (xy, xz, yz) = (s(0, 1) + s(1, 0), s(0, 2) + s(2, 0), s(1, 2) + s(2, 1));
    let (xx, yy, zz) = (s(0, 0), s(1, 1), s(2, 2));
    #[rustfmt::skip]
    let horn = Matrix4::new(
        xx + yy + zz, x,            y,            z,
        x,            xx - yy - zz, xy,           xz,
        y,            xy,           yy - xx - zz, yz,
        z,            xz,           yz,           zz - xx - yy,
    );
    let eigen = horn.symmetric_eigen();
    let values = &eigen.eigenvalues;
    let best = values.imax();
    let next = (0..4).filter(|i| *i != best).map(|i| values[i]).fold(f64::NEG_INFINITY, f64::max);
    let q = eigen.eigenvectors.column(best);
    BestRotation {
        rotation: UnitQuaternion::new_normalize(Quaternion::new(q[0], q[1], q[2], q[3])),
        trace: values[best],
        gap: values[best] - next,
    }
}

#[cfg(test)]
#[path = "align_tests.rs"]
mod tests;
