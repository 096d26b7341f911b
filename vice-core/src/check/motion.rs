//! What a pose stream is, where it was read as something else: every convention is tried against a reference's motion.
//!
//! Compared is the motion of the body over half a second, in the body's own frame: neither the worlds nor a drift enter.
//! A world that is turned as a whole (north-east-down) changes nothing of it, and is seen by gravity only.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::Check;
use super::cures::{cures, so_read};
use crate::conventions::{Convention, Given, list_text};
use crate::finding::{Finding, State};
use crate::frames::{Body, Rigid, WorldFromBody, rotation_angle_rad, rotation_vector_rad};
use crate::metrics::align::best_rotation;
use crate::statistics::sorted;
use crate::time::{Span, Stamp};
use crate::trajectory::Trajectory;

/// What this check is.
pub const CHECK: Check = Check {
    name: "motion",
    title: "poses against a reference",
    looks_at: "whether a pose stream moves as the reference does, and which convention, unit or frame would make it",
    threshold: "wrong where more than 30 % of the motion is unexplained and a convention leaves less than half of that; look where nothing explains it, where the body is turned by more than 2 degrees, or where the scale is off by more than 5 %",
    source: "rigid-body motion; the conventions of vice_core::conventions",
};

/// Motion over this long is compared, seconds; sparser streams from pose to pose.
const STEP_S: f64 = 0.5;
const LONGEST_S: f64 = 2.1;
/// The worst of the motions are left out: jumps and glitches are another check's.
const KEPT: f64 = 0.9;
/// Fewer motions say nothing.
const FEWEST: usize = 10;
/// Motions that are compared, at most.
const MOST: usize = 1500;
/// This much of a motion may be unexplained.
const OFF: f64 = 0.3;
/// Each of both parts counts this much at most, so that a wrong unit does not hide a right rotation.
const CAP: f64 = 2.0;
/// A convention must leave this share of what is unexplained.
const SHARE: f64 = 0.5;
/// Conventions within this of the best are told in one breath.
const TIE: f64 = 0.02;
/// Turns between bodies worth a word, radians; they must explain half of what is off.
const TURNED_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Scales off by more are worth a word.
const SCALE: f64 = 0.05;
/// The reference must move and turn: RMS over a step, metres and radians.
const MOVES_M: f64 = 0.02;
const TURNS_RAD: f64 = 0.01;

/// What conventions leave unexplained, as shares of the reference's own motion; `None` where it hardly moves, or turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unexplained {
    /// Of the turns.
    pub turns: Option<f64>,
    /// Of the way.
    pub way: Option<f64>,
}

impl Unexplained {
    fn total(&self) -> f64 {
        let part = |share: Option<f64>| share.unwrap_or(0.0).min(CAP);
        part(self.turns).hypot(part(self.way))
    }
}

/// Motions of the reference, and the estimate's poses at their ends.
struct Motions {
    /// Estimate's poses as read, at their own stamps.
    read: Trajectory,
    /// Pairs of ends, as indices of `read`, and the reference's motion between them.
    steps: Vec<(usize, usize, Rigid<Body, Body>)>,
}

/// Whether an estimate moves as a reference does, and of which point its poses are. `offset`: what is added to the estimate's stamps first, where the clock
/// is known to be off.
pub fn motion(
    reference: (&str, &Trajectory),
    estimate: (&str, &Trajectory),
    offset: Span,
    given: Given<'_>,
) -> Vec<Finding> {
    let about = format!("{} / {}", reference.0, estimate.0);
    let unknown = |says: String| vec![Finding::new(CHECK.name, &about, State::Unknown, says)];
    let Some(motions) = Motions::of(reference.1, estimate.1, offset) else {
        return unknown("the two have too few motions in common".to_string());
    };
    let Some(read) = motions.unexplained(&motions.read) else {
        return unknown("the reference hardly moves or turns".to_string());
    };
    let numbers = |finding: Finding, u: Unexplained, name: &str| {
        finding.number(&format!("{name}-turns"), u.turns.unwrap_or(f64::NAN), "").number(
            &format!("{name}-way"),
            u.way.unwrap_or(f64::NAN),
            "",
        )
    };
    if read.turns.unwrap_or(0.0).max(read.way.unwrap_or(0.0)) <= OFF {
        let mut found = vec![fits(&motions, estimate.0, &about, read, numbers)];
        // Only of bodies that are turned alike, and of one scale.
        if found.iter().all(|f| f.state == State::Ok) {
            let camera = given.body_from_camera.zip(given.first_frame).and_then(|(at, first)| at(first));
            let motions = motions.each(&motions.read);
            found.extend(super::lever::off_reference(estimate.0, reference.0, motions, camera));
        }
        return found;
    }
    let tried = cures(&motions.read, given, TIE, Unexplained::total, |cured| motions.unexplained(cured));
    let best = tried.first().filter(|(_, u)| u.total() < SHARE * read.total() && u.total() < 1.5 * OFF);
    if let Some((list, left)) = best {
        let alike = tried[1..]
            .iter()
            .filter(|(other, u)| u.total() < left.total() + TIE && other.len() <= list.len())
            .map(|(other, _)| other);
        let says = so_read(list, alike, &format!("{} moves as {} does", estimate.0, reference.0));
        let finding = Finding::new(CHECK.name, about, State::Wrong, says);
        let finding = numbers(numbers(finding, read, "unexplained"), *left, "then-left");
        let frame = if list == &[Convention::CameraAsBody] { ", or `estimate-frame` camera" } else { "" };
        return vec![finding.mend(format!("`estimate-as` {}{frame}", list_text(list)))];
    }
    if super::path::is_frozen(&motions.read) && read.turns.is_some() {
        let says = format!("the rotation of {} never changes, and {} turns", estimate.0, reference.0);
        let finding = Finding::new(CHECK.name, about, State::Wrong, says);
        let finding = numbers(finding, read, "unexplained");
        return vec![finding.mend("write the rotations: no option mends this")];
    }
    let says = format!("{} does not move as {} does, and no convention makes it", estimate.0, reference.0);
    let finding = numbers(Finding::new(CHECK.name, about, State::Look, says), read, "unexplained");
    vec![finding.mend("see whether both are of one body and one recording")]
}

/// What is to be said of an estimate that moves as the reference does.
fn fits(
    motions: &Motions,
    estimate: &str,
    about: &str,
    read: Unexplained,
    numbers: impl Fn(Finding, Unexplained, &str) -> Finding,
) -> Finding {
    let finding =
        |state, says: String| numbers(Finding::new(CHECK.name, about, state, says), read, "unexplained");
    if let Some(turn) = motions.body_turn() {
        let angle = rotation_angle_rad(&turn).to_degrees();
        let axis = rotation_vector_rad(&turn).normalize();
        let says = format!(
            "the body of {estimate} is turned by {angle:.2} degrees about [{:.2}, {:.2}, {:.2}]",
            axis.x, axis.y, axis.z
        );
        return finding(State::Look, says).number("turned", angle, "degrees").mend(
            "where its poses are those of another frame, `estimate-frame` FILE says where that lies in the body",
        );
    }
    if let Some(scale) = motions.scale().filter(|s| (s - 1.0).abs() > SCALE) {
        let says = format!(
            "{estimate} moves {scale:.3} times as far as the reference: a monocular odometry has no scale of its own"
        );
        return finding(State::Look, says)
            .number("scale", scale, "")
            .mend("`align` sim3 tells how far it is off beside its scale");
    }
    finding(State::Ok, format!("{estimate} moves as the reference does"))
}

impl Motions {
    fn of(reference: &Trajectory, estimate: &Trajectory, offset: Span) -> Option<Self> {
        let spacing = estimate.median_spacing()?.as_secs_f64();
        let gap = Span::from_secs_f64((2.5 * reference.median_spacing()?.as_secs_f64()).max(0.11)).ok()?;
        let step = STEP_S.max(spacing);
        let mut rows: Vec<(Stamp, WorldFromBody, WorldFromBody)> = Vec::new();
        for (stamp, pose) in estimate.iter() {
            if rows.last().is_some_and(|last| stamp.since(last.0).as_secs_f64() < step - 1e-6) {
                continue;
            }
            if let Ok(at) = reference.pose_at(stamp.saturating_add(offset), gap) {
                rows.push((stamp, pose, at));
            }
        }
        let every = rows.len().div_ceil(MOST).max(1);
        let steps: Vec<_> = (1..rows.len())
            .step_by(every)
            .filter(|i| rows[*i].0.since(rows[i - 1].0).as_secs_f64() <= LONGEST_S.max(2.0 * step))
            .map(|i| (i - 1, i, (rows[i - 1].2.inverse() * rows[i].2)))
            .collect();
        let read = Trajectory::from_poses(rows.into_iter().map(|(s, e, _)| (s, e))).ok()?;
        (steps.len() >= FEWEST).then_some(Self { read, steps })
    }

    /// Motions `(reference, estimate)`.
    fn each<'a>(
        &'a self,
        poses: &'a Trajectory,
    ) -> impl Iterator<Item = (Rigid<Body, Body>, Rigid<Body, Body>)> + 'a {
        let poses = poses.poses();
        self.steps.iter().map(|(a, b, reference)| (*reference, poses[*a].inverse() * poses[*b]))
    }

    fn unexplained(&self, poses: &Trajectory) -> Option<Unexplained> {
        let (mut turn_off, mut turn, mut way_off, mut way) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (reference, estimate) in self.each(poses) {
            turn.push(rotation_angle_rad(&reference.rotation()));
            turn_off.push(rotation_angle_rad(&(reference.rotation().inverse() * estimate.rotation())));
            way.push(reference.translation().norm());
            way_off.push((estimate.translation() - reference.translation()).norm());
        }
        let share = |off: Vec<f64>, all: Vec<f64>, least: f64| {
            let size = kept_rms(all);
            (size > least).then(|| kept_rms(off) / size)
        };
        let found =
            Unexplained { turns: share(turn_off, turn, TURNS_RAD), way: share(way_off, way, MOVES_M) };
        (found.turns.is_some() || found.way.is_some()).then_some(found)
    }

    /// The constant rotation between the bodies, where it is worth a word.
    fn body_turn(&self) -> Option<UnitQuaternion<f64>> {
        let turns: Vec<(Vector3<f64>, Vector3<f64>)> = self
            .each(&self.read)
            .map(|(r, e)| (rotation_vector_rad(&r.rotation()), rotation_vector_rad(&e.rotation())))
            .collect();
        let rms =
            |turn: UnitQuaternion<f64>| kept_rms(turns.iter().map(|(r, e)| (r - turn * e).norm()).collect());
        let mut best = UnitQuaternion::identity();
        // Motions that disagree count less, the second time.
        for _ in 0..2 {
            let limit = 3.0 * rms(best).max(1e-6);
            let near = turns
                .iter()
                .filter(|(r, e)| best == UnitQuaternion::identity() || (r - best * e).norm() < limit);
            let correlation: Matrix3<f64> = near.map(|(r, e)| e * r.transpose()).sum();
            let found = best_rotation(&correlation);
            if found.gap <= 0.02 * found.trace {
                return None;
            }
            best = found.rotation;
        }
        let suspicious =
            rotation_angle_rad(&best) > TURNED_RAD && rms(best) < 0.5 * rms(UnitQuaternion::identity());
        suspicious.then_some(best)
    }

    /// How many times as far the estimate moves, by the middle of the motions that are long enough.
    fn scale(&self) -> Option<f64> {
        let mut shares: Vec<f64> = self
            .each(&self.read)
            .filter(|(r, _)| r.translation().norm() > 2.0 * MOVES_M)
            .map(|(r, e)| e.translation().norm() / r.translation().norm())
            .collect();
        if shares.len() < FEWEST {
            return None;
        }
        crate::statistics::median(&mut shares)
    }
}

/// RMS of all but the largest.
pub(super) fn kept_rms(values: Vec<f64>) -> f64 {
    let kept = ((values.len() as f64 * KEPT).ceil() as usize).max(1);
    let sorted = sorted(values);
    let sum: f64 = sorted.iter().take(kept).map(|v| v * v).sum();
    (sum / kept as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::BodyFromCamera;

    fn flight() -> Trajectory {
        let rows = (0..600).map(|i| {
            let t = f64::from(i) * 0.05;
            let turn =
                UnitQuaternion::from_euler_angles(0.2 * (1.9 * t).sin(), 0.15 * (1.3 * t).cos(), 0.5 * t);
            let at = Vector3::new(2.0 * (0.5 * t).cos(), 1.5 * (0.7 * t).sin(), 1.0 + 0.3 * (0.9 * t).sin());
            (Stamp::from_nanos(i64::from(i) * 50_000_000), Rigid::from_parts(at, turn))
        });
        Trajectory::from_poses(rows.collect::<Vec<_>>()).unwrap()
    }

    fn extrinsics() -> BodyFromCamera {
        Rigid::from_parts(Vector3::new(0.1, -0.03, 0.02), UnitQuaternion::from_euler_angles(-1.9, 0.02, -1.6))
    }

    fn said(misread: impl Fn(WorldFromBody) -> WorldFromBody) -> Finding {
        let reference = flight();
        let world: WorldFromBody =
            Rigid::from_parts(Vector3::new(3.0, 1.0, 0.0), UnitQuaternion::from_euler_angles(0.0, 0.0, 1.2));
        let noisy = reference.map_poses(|stamp, pose| {
            let i = stamp.as_nanos() / 50_000_000;
            let jitter = Vector3::new((i % 3) as f64, (i % 5) as f64, (i % 7) as f64) * 3e-4;
            let moved: WorldFromBody = world * pose.reinterpret::<Body, Body>();
            Rigid::from_parts(
                moved.translation() + jitter,
                moved.rotation() * UnitQuaternion::from_scaled_axis(jitter),
            )
        });
        let at = |_: Stamp| Some(extrinsics());
        let given = Given { body_from_camera: Some(&at), first_frame: None };
        let noisy = noisy.map_poses(|_, p| misread(p));
        motion(("truth", &reference), ("est", &noisy), Span::ZERO, given).remove(0)
    }

    #[test]
    fn what_moves_alike_is_fine() {
        let fine = said(|p| p);
        assert_eq!(fine.state, State::Ok, "{fine:?}");
        let scaled = said(|p| Rigid::from_parts(p.translation() * 1.1, p.rotation()));
        assert!(scaled.state == State::Look && scaled.says.contains("1.1"), "{scaled:?}");
        let turned = said(|p| {
            Rigid::from_parts(
                p.translation(),
                p.rotation() * UnitQuaternion::from_euler_angles(0.0, 0.08, 0.0),
            )
        });
        assert!(turned.state == State::Look && turned.says.contains("turned by 4.5"), "{turned:?}");
    }

    #[test]
    fn each_convention_is_named() {
        let quaternion = |p: WorldFromBody, [w, x, y, z]: [f64; 4]| {
            let q = nalgebra::Quaternion::new(w, x, y, z);
            Rigid::from_parts(p.translation(), UnitQuaternion::from_quaternion(q))
        };
        let named = |finding: Finding, word: &str| {
            assert_eq!(finding.state, State::Wrong, "{word}: {finding:?}");
            assert!(finding.mend.contains(&format!("`estimate-as` {word}")), "{word}: {finding:?}");
        };
        named(said(|p| Rigid::from_parts(p.translation(), p.rotation().inverse())), "conjugate");
        named(said(|p| p.inverse().reinterpret()), "inverse");
        named(
            said(|p| {
                let q = p.rotation().coords;
                quaternion(p, [q.z, q.w, q.x, q.y])
            }),
            "wxyz",
        );
        named(said(|p| p * extrinsics().reinterpret::<Body, Body>()), "camera");
        named(
            said(|p| {
                let t = p.translation();
                Rigid::from_parts(Vector3::new(t.y, t.x, t.z), p.rotation())
            }),
            "yxz",
        );
        named(
            said(|p| {
                let (t, q) = (p.translation(), p.rotation().coords);
                let m = quaternion(p, [q.w, -q.x, -q.y, q.z]);
                Rigid::from_parts(Vector3::new(t.x, t.y, -t.z), m.rotation())
            }),
            "mirror-z",
        );
        named(said(|p| Rigid::from_parts(p.translation() * 1000.0, p.rotation())), "mm");
        let frozen = said(|p| Rigid::from_parts(p.translation(), UnitQuaternion::identity()));
        assert!(frozen.state == State::Wrong && frozen.says.contains("never changes"), "{frozen:?}");
    }
}
