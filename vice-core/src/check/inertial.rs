//! What a pose stream is, by the robot's own gyroscope and accelerometer: no reference is needed.
//!
//! Over stretches of 0.4 s the gyroscope says how the body turned. The accelerometer, turned along by the gyroscope and
//! weighted by a triangle over two stretches, says exactly what the second difference of the positions is, less gravity:
//! `p(t+w) - 2 p(t) + p(t-w) = w² · mean(R f) + w² g`. Gravity (in the stream's world) and the accelerometer's bias are
//! fitted, so that no world has to be level; where it points is told by itself.

use nalgebra::{Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

use super::Check;
use super::cures::{cures, so_read};
use super::lever::Swing;
use super::motion::kept_rms;
use super::turning::Turning;
use crate::conventions::{Convention, Given, list_text};
use crate::finding::{Finding, State};
use crate::frames::rotation_vector_rad;
use crate::imu::ImuSample;
use crate::statistics::median;
use crate::time::{Span, Stamp};
use crate::trajectory::Trajectory;

/// What the check of conventions is.
pub const CHECK: Check = Check {
    name: "inertial",
    title: "poses against the IMU",
    looks_at: "whether a pose stream turns and accelerates as gyroscope and accelerometer say, and which convention, unit or frame would make it; units of the IMU",
    threshold: "wrong where a convention leaves less than half of what is unexplained of turns (above 30 %) or accelerations (above 0.1 m/s²); look where nothing explains it",
    source: "strap-down kinematics; the conventions of vice_core::conventions",
};

/// What the check of gravity is.
pub const GRAVITY: Check = Check {
    name: "gravity",
    title: "gravity",
    looks_at: "where the accelerometer says that up is, against the z axis of a stream's world",
    threshold: "look above 3 degrees, wrong above 20 for the ground truth of a data set (whose world must be z up); look where gravity is off 9.81 m/s² by more than 3 %",
    source: "what floors and maps of depth assume",
};

/// Length of a stretch, seconds.
const STEP_S: f64 = 0.4;
/// Streams sparser than this tell no acceleration, seconds.
const DENSE_S: f64 = 0.11;
/// Fewer stretches say nothing.
const FEWEST: usize = 10;
/// Stretches that are compared, at most.
const MOST: usize = 1500;
/// A gyroscope's bias is at most this, rad/s.
const BIAS_RAD_S: f64 = 0.1;
/// An accelerometer's bias is about this, m/s², against residuals of about 0.1.
const BIAS_M_S2: f64 = 0.3;
/// What good poses leave unexplained: a share of the turns, and m/s².
const USUAL_TURNS: f64 = 0.03;
const USUAL_M_S2: f64 = 0.04;
/// More than this needs an explanation.
const OFF_TURNS: f64 = 0.3;
const OFF_M_S2: f64 = 0.1;
/// A convention must leave this share.
const SHARE: f64 = 0.5;
/// A unit of length must leave this share of what positions that never move leave: a smaller unit also makes noise smaller.
const OF_NO_MOTION: f64 = 0.7;
/// ... and not more than this.
const LEFT_TURNS: f64 = 0.35;
const LEFT_M_S2: f64 = 1.5;
/// Scores within this are a tie (logarithms).
const TIE: f64 = 0.1;
/// The body must turn by this, RMS of a stretch, radians.
const TURNS_RAD: f64 = 0.004;
/// Up may be off z by this, degrees.
const LOOK_DEG: f64 = 3.0;
const WRONG_DEG: f64 = 20.0;
/// Gravity, and how far it may be off.
const G_M_S2: f64 = 9.81;
const G_OFF: f64 = 0.03;

/// How a stretch begins, and what the IMU says of it.
struct Stretch {
    /// Indices of the poses before, at and after it.
    poses: [usize; 3],
    /// Turn from the middle to the end, radians.
    turn: Vector3<f64>,
    /// Mean specific force in the body of the middle, m/s².
    force: Vector3<f64>,
    /// Mean size of the gyroscope's rates over it, rad/s: it does not wrap.
    speed: f64,
}

struct Stretches {
    read: Trajectory,
    list: Vec<Stretch>,
    step_s: f64,
    /// Whether the stream is dense enough for accelerations.
    dense: bool,
}

/// What is left unexplained, and the gravity that fits.
#[derive(Clone, Copy, Debug)]
struct Left {
    turns: f64,
    m_s2: Option<f64>,
    gravity: Option<Vector3<f64>>,
}

impl Left {
    fn score(&self) -> f64 {
        self.turns.max(USUAL_TURNS).ln() + self.m_s2.map_or(0.0, |a| a.max(USUAL_M_S2).ln())
    }
}

/// What IMU and a pose stream say of each other. `offset` is added to the stream's stamps first, where its clock is known to
/// be off; `is_truth` where the world of the stream is the one in which floor and cloud lie.
pub fn inertial(
    imu: &[ImuSample],
    stream: (&str, &Trajectory),
    offset: Span,
    is_truth: bool,
    given: Given<'_>,
) -> Vec<Finding> {
    let (name, trajectory) = stream;
    let about = format!("imu / {name}");
    let unknown = |says: &str| vec![Finding::new(CHECK.name, &about, State::Unknown, says)];
    let Some(stretches) = Stretches::of(imu, trajectory, offset) else {
        return unknown("IMU and poses have too little in common");
    };
    let Some(read) = stretches.left(&stretches.read) else {
        return unknown("the body hardly turns");
    };
    if let Some(unit) = units(&stretches, &about) {
        return vec![unit];
    }
    let numbers = |finding: Finding, left: &Left, name: &str| {
        finding.number(&format!("{name}-turns"), left.turns, "").number(
            &format!("{name}-acceleration"),
            left.m_s2.unwrap_or(f64::NAN),
            "m/s²",
        )
    };
    let is_off = read.turns > OFF_TURNS || read.m_s2.is_some_and(|a| a > OFF_M_S2);
    if is_off {
        let tried = cures(&stretches.read, given, TIE, Left::score, |cured| stretches.left(cured));
        let still = stretches.left(
            &stretches
                .read
                .map_poses(|_, pose| crate::frames::Rigid::from_parts(Vector3::zeros(), pose.rotation())),
        );
        let moves = |list: &[Convention], left: &Left| {
            let still = still.as_ref().and_then(|s| s.m_s2);
            list.iter().all(|c| c.unit_m().is_none())
                || left.m_s2.zip(still).is_some_and(|(a, still)| a < OF_NO_MOTION * still)
        };
        let fits = |left: &Left| {
            left.score() < read.score() + SHARE.ln()
                && left.turns < LEFT_TURNS
                && left.m_s2.is_none_or(|a| a < LEFT_M_S2)
        };
        let best = tried.iter().find(|(list, left)| moves(list, left)).filter(|(_, left)| fits(left));
        if let Some((list, left)) = best {
            let alike = tried
                .iter()
                .filter(|(other, l)| {
                    other != list
                        && moves(other, l)
                        && l.score() < left.score() + TIE
                        && other.len() <= list.len()
                })
                .map(|(other, _)| other);
            let says = so_read(list, alike, &format!("{name} moves as the IMU does"));
            let finding = Finding::new(CHECK.name, about, State::Wrong, says);
            let finding = numbers(numbers(finding, &read, "unexplained"), left, "then-left");
            return vec![finding.mend(format!("`estimate-as` {}", list_text(list)))];
        }
    }
    let mut found = Vec::new();
    if read.turns > OFF_TURNS {
        let frozen = super::path::is_frozen(&stretches.read);
        let (state, says) = match frozen {
            true => (State::Wrong, format!("the rotation of {name} never changes, and the gyroscope turns")),
            false => (
                State::Look,
                format!("{name} does not turn as the gyroscope does, and no convention makes it"),
            ),
        };
        let mend = if frozen {
            "write the rotations: no option mends this"
        } else {
            "see whether IMU and poses are of one body: `estimate-frame` FILE says where another frame lies in it"
        };
        found.push(numbers(Finding::new(CHECK.name, about, state, says), &read, "unexplained").mend(mend));
        return found;
    }
    let says = match read.m_s2 {
        Some(_) => format!("{name} turns and accelerates as the IMU does"),
        None => format!("{name} turns as the gyroscope does"),
    };
    found.push(numbers(Finding::new(CHECK.name, about, State::Ok, says), &read, "unexplained"));
    found.extend(gravity(name, &read, is_truth));
    let camera = given.body_from_camera.zip(given.first_frame).and_then(|(at, first)| at(first));
    found.extend(super::lever::off_imu(name, &stretches.swings(), stretches.step_s, camera));
    found
}

/// Where up is.
fn gravity(name: &str, left: &Left, is_truth: bool) -> Option<Finding> {
    let (gravity, rest) = (left.gravity?, left.m_s2?);
    if rest > 2.0 * LEFT_M_S2 {
        return None;
    }
    let (size, tilt) = (gravity.norm(), (-gravity).angle(&Vector3::z()).to_degrees());
    let off_size = (size / G_M_S2 - 1.0).abs() > G_OFF;
    let (state, says, mend) = if tilt > LOOK_DEG {
        let state = if tilt > WRONG_DEG && is_truth { State::Wrong } else { State::Look };
        (
            state,
            format!("up is {tilt:.1} degrees off the z axis of the world of {name}"),
            "floor and Z-map depth take z for up where this stream places the camera: `initial-pose` places it, `estimate-as` ned, z-down, y-up or y-down turns its world, `floor-plane` gives the floor",
        )
    } else if off_size {
        (
            State::Look,
            format!("gravity is {size:.2} m/s²: the scale of the accelerometer, or of {name}, is off"),
            "imu-euler cannot be trusted; see the calibration of the IMU",
        )
    } else {
        (State::Ok, format!("up is {tilt:.2} degrees off the z axis of the world of {name}"), "")
    };
    let finding = Finding::new(GRAVITY.name, format!("imu / {name}"), state, says)
        .number("off-z", tilt, "degrees")
        .number("gravity", size, "m/s²");
    Some(finding.mend(mend))
}

/// Gyroscopes in degrees and accelerometers in g.
fn units(stretches: &Stretches, about: &str) -> Option<Finding> {
    let poses = stretches.read.poses();
    let (mut own, mut other) = (0.0, 0.0);
    for s in &stretches.list {
        let turn =
            rotation_vector_rad(&(poses[s.poses[1]].rotation().inverse() * poses[s.poses[2]].rotation()))
                .norm();
        own += turn * turn;
        other += turn * s.speed * stretches.step_s;
    }
    let times = other / own.max(1e-12);
    let mut forces: Vec<f64> = stretches.list.iter().map(|s| s.force.norm()).collect();
    let force = median(&mut forces)?;
    if own > 0.0 && times > 15.0 && times < 120.0 {
        let says =
            "the gyroscope turns tens of times as much as the poses: it seems to be in degrees a second";
        return Some(
            Finding::new(CHECK.name, about, State::Wrong, says)
                .number("times", times, "")
                .mend("convert the samples to rad/s"),
        );
    }
    if (0.8..1.2).contains(&force) {
        let says = "the accelerometer seems to be in g, not in m/s²";
        return Some(
            Finding::new(CHECK.name, about, State::Wrong, says)
                .number("specific-force", force, "m/s²")
                .mend("convert the samples to m/s²"),
        );
    }
    None
}

impl Stretches {
    fn of(imu: &[ImuSample], trajectory: &Trajectory, offset: Span) -> Option<Self> {
        let gyro = Turning::of_gyro(imu)?;
        let spacing = trajectory.median_spacing()?.as_secs_f64();
        let step_s = STEP_S.max((1.05 * spacing).min(1.2));
        if spacing > 1.2 {
            return None;
        }
        let gap = Span::from_secs_f64((2.5 * spacing).max(0.11)).ok()?;
        let origin = imu[0].stamp;
        let at = |t: f64| origin.saturating_add(Span::from_secs_f64(t).unwrap_or(Span::ZERO));
        let own = |stamp: Stamp| Stamp::from_nanos(stamp.as_nanos().saturating_sub(offset.as_nanos()));
        let first = trajectory.start().saturating_add(offset).since(origin).as_secs_f64().max(0.0);
        let last = trajectory.end().saturating_add(offset).since(origin).as_secs_f64();
        let last = last.min(imu[imu.len() - 1].stamp.since(origin).as_secs_f64());
        let count = ((last - first) / step_s).floor();
        if !(count.is_finite() && count >= FEWEST as f64) {
            return None;
        }
        let moments: Vec<f64> = (0..count as usize).map(|k| first + k as f64 * step_s).collect();
        let turned = gyro.at(moments.iter().copied());
        let mut rows = Vec::new();
        let mut index = vec![None; moments.len()];
        for (k, t) in moments.iter().enumerate() {
            if let (Ok(pose), Some(_)) = (trajectory.pose_at(own(at(*t)), gap), &turned[k]) {
                index[k] = Some(rows.len());
                rows.push((own(at(*t)), pose));
            }
        }
        let every = (moments.len() / MOST).max(1);
        let mut list = Vec::new();
        for k in (1..moments.len().saturating_sub(1)).step_by(every) {
            let (Some(a), Some(b), Some(c)) = (index[k - 1], index[k], index[k + 1]) else { continue };
            let ends = (moments[k - 1], moments[k], moments[k + 1]);
            let rate = Turning::rate(&turned[k], &turned[k + 1], 1.0);
            let force = force(imu, &gyro, &turned[k], ends);
            let (Some(turn), Some((force, speed))) = (rate, force) else { continue };
            list.push(Stretch { poses: [a, b, c], turn, force, speed });
        }
        let read = Trajectory::from_poses(rows).ok()?;
        (list.len() >= FEWEST).then_some(Self { read, list, step_s, dense: spacing <= DENSE_S })
    }

    fn left(&self, poses: &Trajectory) -> Option<Left> {
        let poses = poses.poses();
        let each: Vec<(Vector3<f64>, Vector3<f64>)> = self
            .list
            .iter()
            .map(|s| {
                let turn = poses[s.poses[1]].rotation().inverse() * poses[s.poses[2]].rotation();
                (s.turn, rotation_vector_rad(&turn))
            })
            .collect();
        let size = kept_rms(each.iter().map(|(own, _)| own.norm()).collect());
        if size < TURNS_RAD {
            return None;
        }
        let part = |axis: usize| {
            median(&mut each.iter().map(|(own, pose)| own[axis] - pose[axis]).collect::<Vec<_>>())
        };
        let bias = Vector3::new(part(0)?, part(1)?, part(2)?);
        let most = BIAS_RAD_S * self.step_s;
        let bias = if bias.norm() > most { bias * (most / bias.norm()) } else { bias };
        let turns = kept_rms(each.iter().map(|(own, pose)| (own - bias - pose).norm()).collect()) / size;
        let acceleration = self.dense.then(|| self.acceleration(poses)).flatten();
        Some(Left { turns, m_s2: acceleration.map(|a| a.0), gravity: acceleration.map(|a| a.1) })
    }

    fn swings(&self) -> Vec<Swing> {
        let poses = self.read.poses();
        let dense = self.list.iter().filter(|_| self.dense);
        dense.map(|s| Swing { poses: s.poses.map(|i| poses[i]), force: s.force }).collect()
    }

    /// What is left of the accelerations, and the gravity that fits.
    fn acceleration(&self, poses: &[crate::frames::WorldFromBody]) -> Option<(f64, Vector3<f64>)> {
        let rows: Vec<(Matrix3<f64>, Vector3<f64>)> = self
            .list
            .iter()
            .map(|s| {
                let [a, b, c] = s.poses.map(|i| poses[i].translation());
                let body: UnitQuaternion<f64> = poses[s.poses[1]].rotation().inverse();
                let curve = body * ((c - b * 2.0 + a) / (self.step_s * self.step_s));
                (body.to_rotation_matrix().into_inner(), curve - s.force)
            })
            .collect();
        let mut kept: Vec<bool> = vec![true; rows.len()];
        let mut left = (f64::NAN, Vector3::zeros());
        for _ in 0..3 {
            // Of R g - b = curve - force, with a bias that is small.
            let (mut normal, mut right) = (Matrix6::<f64>::zeros(), Vector6::<f64>::zeros());
            for ((body, value), _) in rows.iter().zip(&kept).filter(|(_, kept)| **kept) {
                let mut lever = nalgebra::Matrix3x6::<f64>::zeros();
                lever.fixed_view_mut::<3, 3>(0, 0).copy_from(body);
                lever.fixed_view_mut::<3, 3>(0, 3).copy_from(&-Matrix3::identity());
                normal += lever.transpose() * lever;
                right += lever.transpose() * value;
            }
            for i in 3..6 {
                normal[(i, i)] += (0.1 / BIAS_M_S2).powi(2) * 10.0;
            }
            let solved = normal.try_inverse()? * right;
            let (gravity, bias) =
                (solved.fixed_rows::<3>(0).into_owned(), solved.fixed_rows::<3>(3).into_owned());
            let off: Vec<f64> =
                rows.iter().map(|(body, value)| (body * gravity - bias - value).norm()).collect();
            left = (kept_rms(off.clone()), gravity);
            let limit = 3.0 * median(&mut off.clone())?;
            kept = off.iter().map(|o| *o <= limit).collect();
        }
        left.0.is_finite().then_some(left)
    }
}

/// The mean specific force about a moment, weighted by a triangle over both stretches, in the body of that moment; and the
/// mean size of the turn rate.
fn force(
    imu: &[ImuSample],
    gyro: &Turning,
    middle: &super::turning::Known,
    (before, at, after): (f64, f64, f64),
) -> Option<(Vector3<f64>, f64)> {
    let (middle, _) = middle.as_ref()?;
    let (times, rotations) = (gyro.times(), gyro.rotations());
    let from = times.partition_point(|t| *t <= before);
    let to = times.partition_point(|t| *t < after);
    let (mut sum, mut weight, mut speed) = (Vector3::zeros(), 0.0, 0.0);
    for j in from..to {
        let t = times[j];
        let w = if t < at { (t - before) / (at - before) } else { (after - t) / (after - at) };
        sum += w * (middle.inverse() * (rotations[j] * imu[j].accel_m_s2));
        speed += w * imu[j].gyro_rad_s.norm();
        weight += w;
    }
    (weight > 2.0).then(|| (sum / weight, speed / weight))
}

#[cfg(test)]
#[path = "inertial_tests.rs"]
mod tests;
