//! Whether another convention would make an estimate fit its reference far better.
//!
//! Only what cannot come from a bad estimate counts: the rotations (or positions) are far off as they are, and nearly
//! right by another convention. Rotations are compared by their motion from pose to pose, which no alignment and no
//! world frame changes; positions after the best rigid alignment.

use nalgebra::UnitQuaternion;

use super::{Convention, Given};
use crate::frames::{WorldFromBody, rotation_angle_rad};
use crate::metrics::align::{Alignment, align};
use crate::metrics::associate::PosePairs;
use crate::trajectory::Trajectory;

/// Rotations this far off need an explanation, radians.
const OFF_RAD: f64 = 0.2;
/// A convention must leave at most this share of the error.
const SHARE: f64 = 0.2;
/// Fewer poses say nothing.
const FEWEST: usize = 5;
/// Poses that are looked at, at most.
const MOST: usize = 400;
/// The reference must turn at least so far, radians.
const TURNS_RAD: f64 = 0.05;

/// A convention that fits far better than what was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suspected {
    /// The convention.
    pub convention: Convention,
    /// Whether the rotations say so (else the positions, or both in one for poses that are inverted).
    pub by_rotations: bool,
    /// RMS error as it was read: radians of the motions between poses, or metres after alignment.
    pub as_read: f64,
    /// The same with the convention.
    pub cured: f64,
}

impl Suspected {
    /// A line: `the rotations fit far better in the order wxyz (0.001 rad instead of 2.4 rad): --estimate-as wxyz`.
    pub fn line(&self) -> String {
        let Self { convention, as_read, cured, .. } = self;
        let (what, unit) = if self.by_rotations { ("rotations", "rad") } else { ("positions", "m") };
        let as_what = match convention {
            Convention::WFirst => "in the order w x y z (wxyz)".to_string(),
            Convention::WLast => "in the order x y z w (xyzw)".to_string(),
            other => format!("if {}", other.words()),
        };
        format!(
            "the {what} fit far better {as_what}: {cured:.4} {unit} instead of {as_read:.4} {unit}; --estimate-as {convention} reads them so"
        )
    }
}

/// The convention that makes rotations or positions of the estimate fit the reference far better than they do as they
/// were read; `None` where they fit, or where nothing does. `given` is needed for `camera` and `body` only.
///
/// Cost: one pass over at most some hundred pairs for each convention.
pub fn suspect(pairs: &PosePairs, given: Given<'_>) -> Option<Suspected> {
    let every = pairs.len().div_ceil(MOST).max(1);
    let kept = (0..pairs.len()).step_by(every);
    let pick = |poses: &[WorldFromBody]| -> Vec<WorldFromBody> { kept.clone().map(|i| poses[i]).collect() };
    let (reference, estimate) = (pick(pairs.reference()), pick(pairs.estimate()));
    let stamps: Vec<_> = kept.clone().map(|i| pairs.stamps()[i]).collect();
    if reference.len() < FEWEST {
        return None;
    }
    let read = Trajectory::from_poses(stamps.iter().copied().zip(estimate.iter().copied())).ok()?;
    let cured = |convention: Convention| -> Option<Vec<WorldFromBody>> {
        Some(convention.cured(&read, given).ok()?.poses().to_vec())
    };
    let tried: Vec<(Convention, Vec<WorldFromBody>)> =
        Convention::TRIED.into_iter().filter_map(|c| Some((c, cured(c)?))).collect();
    by_rotations(&reference, &estimate, &tried)
        .or_else(|| by_positions(&stamps, &reference, &estimate, &tried))
}

fn by_rotations(
    reference: &[WorldFromBody],
    estimate: &[WorldFromBody],
    tried: &[(Convention, Vec<WorldFromBody>)],
) -> Option<Suspected> {
    let as_read = motion_error_rad(reference, estimate)?;
    if as_read < OFF_RAD {
        return None;
    }
    let rotations_only = tried.iter().filter(|(c, _)| {
        !matches!(
            c,
            Convention::AxisOrder(_)
                | Convention::Millimetres
                | Convention::Centimetres
                | Convention::Feet
                | Convention::Inches
        )
    });
    let best = rotations_only
        .filter_map(|(c, poses)| Some((*c, motion_error_rad(reference, poses)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.1 < SHARE * as_read && best.1 < OFF_RAD).then(|| {
        // The conjugate of a rotation alone and an inverted pose turn alike: the positions decide.
        let convention = match best.0 {
            Convention::ConjugateQuaternion if inverted(reference, estimate) => Convention::InversePose,
            Convention::InversePose if !inverted(reference, estimate) => Convention::ConjugateQuaternion,
            other => other,
        };
        Suspected { convention, by_rotations: true, as_read, cured: best.1 }
    })
}

/// Whether positions fit better by the inverse of the poses.
fn inverted(reference: &[WorldFromBody], estimate: &[WorldFromBody]) -> bool {
    let spread = |poses: &[WorldFromBody]| -> Vec<f64> {
        poses.windows(2).map(|w| (w[1].translation() - w[0].translation()).norm()).collect()
    };
    let inverse: Vec<WorldFromBody> = estimate.iter().map(|p| p.inverse().reinterpret()).collect();
    let off = |poses: &[WorldFromBody]| -> f64 {
        spread(poses).iter().zip(spread(reference)).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
    };
    off(&inverse) < off(estimate)
}

fn by_positions(
    stamps: &[crate::time::Stamp],
    reference: &[WorldFromBody],
    estimate: &[WorldFromBody],
    tried: &[(Convention, Vec<WorldFromBody>)],
) -> Option<Suspected> {
    let error = |poses: &[WorldFromBody]| -> Option<f64> {
        let pairs = stamps.iter().zip(reference).zip(poses).map(|((s, r), e)| (*s, *r, *e));
        let pairs = PosePairs::new(pairs).ok()?;
        let aligned = align(&pairs, Alignment::Se3, None).ok()?.apply_to(&pairs);
        let sum: f64 = aligned.iter().map(|(r, e)| (r.translation() - e.translation()).norm_squared()).sum();
        Some((sum / aligned.len() as f64).sqrt())
    };
    let middle = reference.iter().map(WorldFromBody::translation).sum::<nalgebra::Vector3<f64>>()
        / reference.len() as f64;
    let spread = (reference.iter().map(|p| (p.translation() - middle).norm_squared()).sum::<f64>()
        / reference.len() as f64)
        .sqrt();
    let as_read = error(estimate)?;
    // What does not even keep the size of the path.
    if as_read < 0.5 * spread {
        return None;
    }
    let best =
        tried.iter().filter_map(|(c, poses)| Some((*c, error(poses)?))).min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.1 < SHARE * as_read && best.1 < 0.1 * spread).then_some(Suspected {
        convention: best.0,
        by_rotations: false,
        as_read,
        cured: best.1,
    })
}

/// RMS angle between the turns of both streams over a quarter of the run; `None` where the reference hardly turns, so that
/// nothing can be said.
fn motion_error_rad(reference: &[WorldFromBody], estimate: &[WorldFromBody]) -> Option<f64> {
    let step = (reference.len() / 4).max(1);
    let (mut sum, mut turned, mut count) = (0.0_f64, 0.0_f64, 0_i32);
    for i in (0..reference.len() - step).step_by((step / 8).max(1)) {
        let turn = |poses: &[WorldFromBody]| -> UnitQuaternion<f64> {
            poses[i].rotation().inverse() * poses[i + step].rotation()
        };
        let (r, e) = (turn(reference), turn(estimate));
        sum += rotation_angle_rad(&(r.inverse() * e)).powi(2);
        turned = turned.max(rotation_angle_rad(&r));
        count += 1;
    }
    (count >= FEWEST as i32 && turned > TURNS_RAD).then(|| (sum / f64::from(count)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Rigid;
    use crate::time::Stamp;
    use nalgebra::Vector3;

    fn pairs(misread: impl Fn(WorldFromBody) -> WorldFromBody) -> PosePairs {
        let pose = |i: i32| -> WorldFromBody {
            let t = 0.05 * f64::from(i);
            let turn = UnitQuaternion::from_euler_angles(0.3 * t.sin(), 0.2 * (1.3 * t).cos(), 0.7 * t);
            Rigid::from_parts(Vector3::new(2.0 * t.cos(), t.sin(), 1.0 + 0.3 * (0.7 * t).sin()), turn)
        };
        let noise = |i: i32| UnitQuaternion::from_euler_angles(0.002 * f64::from(i % 3), 0.0, 0.0);
        let rows = (0..200).map(|i| {
            let at = pose(i);
            let off = Rigid::from_parts(at.translation(), at.rotation() * noise(i));
            (Stamp::from_nanos(i64::from(i) * 50_000_000), at, misread(off))
        });
        PosePairs::new(rows).unwrap()
    }

    #[test]
    fn what_fits_is_not_suspected() {
        assert_eq!(suspect(&pairs(|p| p), Given::default()), None);
        // A poor estimate is no other convention.
        let poor = pairs(|p| {
            let wobble = UnitQuaternion::from_euler_angles(0.0, 0.3 * (7.0 * p.translation().x).sin(), 0.0);
            Rigid::from_parts(p.translation() * 1.1, p.rotation() * wobble)
        });
        assert_eq!(suspect(&poor, Given::default()), None);
    }

    #[test]
    fn another_convention_is_noticed() {
        let turned = |p: WorldFromBody, [w, x, y, z]: [f64; 4]| {
            let q = nalgebra::Quaternion::new(w, x, y, z);
            Rigid::from_parts(p.translation(), UnitQuaternion::from_quaternion(q))
        };
        let found = |pairs: PosePairs| suspect(&pairs, Given::default()).map(|s| s.convention);
        let wxyz = pairs(|p| {
            let q = p.rotation().coords;
            turned(p, [q.z, q.w, q.x, q.y])
        });
        assert_eq!(found(wxyz.clone()), Some(Convention::WFirst));
        assert!(suspect(&wxyz, Given::default()).unwrap().line().contains("w x y z"));
        assert_eq!(
            found(pairs(|p| Rigid::from_parts(p.translation(), p.rotation().inverse()))),
            Some(Convention::ConjugateQuaternion)
        );
        assert_eq!(found(pairs(|p| p.inverse().reinterpret())), Some(Convention::InversePose));
        assert_eq!(
            found(pairs(|p| Rigid::from_parts(p.translation() * 1000.0, p.rotation()))),
            Some(Convention::Millimetres)
        );
    }
}
