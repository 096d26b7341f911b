//! Whether the path that trajectory errors rest on determines what they say.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use crate::frames::WorldFromBody;
use crate::metrics::align::Alignment;
use crate::suspicion::Suspicion;
use crate::time::Stamp;

/// Fewer poses than this are too few to trust their errors.
const FEWEST_POSES: usize = 10;
/// A robot whose positions spread by less than this stands, metres (RMS of the distance from their mean).
const STANDING_M: f64 = 0.05;
/// A path whose spread across is less than this share of that along it is nearly straight.
const STRAIGHT: f64 = 0.05;

/// What makes RMSE_3D, AOE and ROE doubtful: few poses; and where the alignment's rotation comes from the positions, a
/// robot that stands or goes nearly straight on.
pub(super) fn path_doubts(
    estimate: &str,
    pairs: &[(Stamp, WorldFromBody, WorldFromBody)],
    alignment: Alignment,
) -> Vec<Suspicion> {
    let mut doubts = Vec::new();
    let n = pairs.len();
    if n == 0 {
        return doubts;
    }
    if n < FEWEST_POSES {
        doubts.push(
            Suspicion::new("few-poses", estimate, "RMSE_3D, AOE and ROE rest on few poses")
                .evidence(format!("{n}, where {FEWEST_POSES} are the least to trust"))
                .advice("label more frames, or compare the whole trajectories with `vice trajectory`"),
        );
    }
    let turns_by_positions = matches!(alignment, Alignment::Yaw | Alignment::Se3 | Alignment::Sim3);
    if n < 2 || !turns_by_positions {
        return doubts;
    }
    let [along, across] = spread_m(pairs.iter().map(|(_, reference, _)| reference.translation()), alignment);
    let advice = "align by the first pose (`align` first-pose), which takes the orientation from the poses";
    let doubt = |code: &str, message: &str| {
        Suspicion::new(code, estimate, message)
            .evidence(format!(
                "the positions spread by {along:.3} m along the path and by {across:.3} m across"
            ))
            .advice(advice)
    };
    if along.hypot(across) < STANDING_M {
        doubts.push(doubt(
            "standing-robot",
            "the robot hardly moves, so that positions do not tell how the worlds are turned: RMSE_3D and AOE after alignment mean little",
        ));
    } else if alignment != Alignment::Yaw && across < STRAIGHT * along {
        doubts.push(doubt(
            "straight-path",
            "the path is nearly straight, so that positions do not tell how the worlds are turned about it: AOE after alignment means little",
        ));
    }
    doubts
}

/// RMS distances from the mean along the widest direction and across it; for a turn about z only in the plane.
fn spread_m(positions: impl Iterator<Item = Vector3<f64>> + Clone, alignment: Alignment) -> [f64; 2] {
    let n = positions.clone().count().max(1) as f64;
    let mean = positions.clone().sum::<Vector3<f64>>() / n;
    let moments: Matrix3<f64> = positions
        .map(|p| {
            let mut off = p - mean;
            if alignment == Alignment::Yaw {
                off.z = 0.0;
            }
            off * off.transpose()
        })
        .sum::<Matrix3<f64>>()
        / n;
    let found = SymmetricEigen::new(moments).eigenvalues;
    let along = found.max().max(0.0);
    [along.sqrt(), (found.sum() - along).max(0.0).sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Rigid;
    use nalgebra::UnitQuaternion;

    fn codes(alignment: Alignment, n: i64, place: impl Fn(f64) -> [f64; 3]) -> Vec<String> {
        let pairs: Vec<_> = (0..n)
            .map(|i| {
                let pose = Rigid::from_parts(place(i as f64).into(), UnitQuaternion::identity());
                (Stamp::from_nanos(i), pose, pose)
            })
            .collect();
        path_doubts("e", &pairs, alignment).into_iter().map(|s| s.code).collect()
    }

    #[test]
    fn what_the_path_does_not_tell_is_said() {
        let round = |i: f64| [i.cos(), i.sin(), 0.0];
        assert!(codes(Alignment::Se3, 50, round).is_empty());
        assert_eq!(codes(Alignment::Se3, 9, round), ["few-poses"]);
        assert_eq!(codes(Alignment::FirstPose, 3, |_| [0.0; 3]), ["few-poses"]);
        let straight = |i: f64| [0.1 * i, 0.002 * i.sin(), 0.0];
        assert_eq!(codes(Alignment::Se3, 50, straight), ["straight-path"]);
        assert!(codes(Alignment::Yaw, 50, straight).is_empty(), "a turn about z is known");
        assert!(codes(Alignment::FirstPose, 50, straight).is_empty());
        let stands = |i: f64| [1e-3 * i.sin(), 1e-3 * i.cos(), 0.0];
        assert_eq!(codes(Alignment::Sim3, 50, stands), ["standing-robot"]);
        // A lift goes up and down: nothing tells a turn about z.
        assert_eq!(codes(Alignment::Yaw, 50, |i| [0.0, 0.0, i]), ["standing-robot"]);
        assert!(codes(Alignment::Se3, 0, round).is_empty());
    }
}
