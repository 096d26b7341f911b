//! Comparing a motion in a plane: heights and tilts taken away from both streams.

use std::str::FromStr;

use nalgebra::{UnitQuaternion, Vector3};

use crate::error::{DataError, DataResult};
use crate::frames::{Rigid, WorldFromBody};
use crate::metrics::associate::PosePairs;

/// A coordinate plane of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum Plane {
    /// The horizontal plane: z goes.
    Xy,
    /// y goes.
    Xz,
    /// x goes.
    Yz,
}

impl Plane {
    /// All planes.
    pub const ALL: [Self; 3] = [Self::Xy, Self::Xz, Self::Yz];

    /// The name used in options and results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Xy => "xy",
            Self::Xz => "xz",
            Self::Yz => "yz",
        }
    }

    /// The pose in this plane: the coordinate along its normal becomes zero, and of the rotation only the angle about
    /// the normal stays: roll (x), pitch (y) or yaw (z) of `R = Rz(yaw) Ry(pitch) Rx(roll)`, as evo takes it.
    pub fn project(self, pose: &WorldFromBody) -> WorldFromBody {
        let r = pose.rotation().to_rotation_matrix().into_inner();
        let cos_pitch = r[(0, 0)].hypot(r[(1, 0)]);
        // Looking straight up or down only roll - yaw is defined: yaw is taken as zero.
        let locked = cos_pitch <= 4.0 * f64::EPSILON;
        let mut position = pose.translation();
        let (normal, angle) = match self {
            Self::Xy => (2, if locked { 0.0 } else { r[(1, 0)].atan2(r[(0, 0)]) }),
            Self::Xz => (1, (-r[(2, 0)]).atan2(cos_pitch)),
            Self::Yz if locked => (0, (-r[(1, 2)]).atan2(r[(1, 1)])),
            Self::Yz => (0, r[(2, 1)].atan2(r[(2, 2)])),
        };
        position[normal] = 0.0;
        let mut turn = Vector3::zeros();
        turn[normal] = angle;
        Rigid::from_parts(position, UnitQuaternion::from_scaled_axis(turn))
    }

    /// Both streams in this plane. To be done after alignment, as evo does.
    #[must_use]
    pub fn project_pairs(self, pairs: &PosePairs) -> PosePairs {
        pairs.map_both(|pose| self.project(pose))
    }
}

impl FromStr for Plane {
    type Err = DataError;
    fn from_str(name: &str) -> DataResult<Self> {
        Self::ALL
            .into_iter()
            .find(|p| p.name() == name)
            .ok_or_else(|| DataError::new(format!("`{name}` is no plane")).hint("one of xy, xz, yz"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_pose_keeps_its_place_and_heading() {
        let rotation = UnitQuaternion::from_euler_angles(0.1, -0.2, 2.5);
        let pose = Rigid::from_parts(Vector3::new(1.0, 2.0, 3.0), rotation);
        for (name, place, angle) in
            [("xy", [1.0, 2.0, 0.0], 2.5), ("xz", [1.0, 0.0, 3.0], 0.2), ("yz", [0.0, 2.0, 3.0], 0.1)]
        {
            let plane: Plane = name.parse().unwrap();
            let flat = plane.project(&pose);
            assert_eq!(flat.translation(), Vector3::from(place));
            assert_relative_eq!(
                crate::frames::rotation_angle_rad(&flat.rotation()),
                angle,
                max_relative = 1e-12
            );
        }
        assert!("zz".parse::<Plane>().is_err());
    }
}
