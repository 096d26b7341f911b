//! What no robot's path does: jumps, frozen stretches, speeds of another unit.

use super::Check;
use crate::finding::{Finding, State, short};
use crate::frames::rotation_angle_rad;
use crate::statistics::{quantile, sorted};
use crate::trajectory::Trajectory;

/// What this check is.
pub const CHECK: Check = Check {
    name: "path",
    title: "trajectories",
    looks_at: "jumps, frozen stretches, rotations that never change, speeds and turn rates beyond any platform",
    threshold: "wrong: middle speed above 70 m/s, rotation constant to 1e-6 rad over a path of 2 m with corners, or more than half of the poses repeat the one before at a rate of motion; look: jumps beyond 15 usual steps that ask for more than 8 g, poses frozen for more than 0.5 s within motion",
    source: "speed and acceleration of wheeled, walking and flying robots and of hands",
};

/// Middle speeds beyond this are another unit of length, m/s.
const FASTEST_M_S: f64 = 70.0;
/// A step is a jump where it leaves the course by more than this, and by so many times the usual, metres.
const JUMP_M: f64 = 0.03;
const JUMP_RAD: f64 = 0.01;
const JUMP_TIMES: f64 = 15.0;
/// ... and asks for more than this acceleration, m/s² and rad/s².
const JUMP_M_S2: f64 = 80.0;
const JUMP_RAD_S2: f64 = 150.0;
/// Steps across more than so many usual spacings are gaps.
const GAP: f64 = 2.5;
/// Rotations that differ by less are the same, radians.
const SAME_RAD: f64 = 1e-6;
/// Positions that differ by less are the same, metres.
const SAME_M: f64 = 1e-9;
/// Frozen for longer than this is worth a look, seconds.
const FROZEN_S: f64 = 0.5;
/// A path of this length shows whether a rotation changes, metres.
const PATH_M: f64 = 2.0;
/// Corners of a path: the directions of travel spread by this, radians.
const CORNERS_RAD: f64 = 0.5;

/// Whether the rotation never changes; unlike its path. `None` where the path is too short or straight to tell.
pub fn is_frozen(trajectory: &Trajectory) -> bool {
    let first = trajectory.poses()[0].rotation();
    trajectory.len() > 4
        && trajectory.poses().iter().all(|p| rotation_angle_rad(&(first.inverse() * p.rotation())) < SAME_RAD)
}

/// Whether the direction of travel changes by more than any straight path's does.
fn has_corners(trajectory: &Trajectory) -> bool {
    let poses = trajectory.poses();
    let every = (poses.len() / 40).max(1);
    let places: Vec<_> = poses.iter().step_by(every).map(|p| p.translation()).collect();
    let steps: Vec<_> = places.windows(2).filter_map(|w| (w[1] - w[0]).try_normalize(0.02)).collect();
    let Some(first) = steps.first() else { return false };
    steps.iter().any(|s| s.dot(first) < CORNERS_RAD.cos())
}

/// What a stream's path is like: one finding or several.
pub fn path(about: &str, trajectory: &Trajectory) -> Vec<Finding> {
    if trajectory.len() < 5 {
        let says = format!("{} poses: nothing can be said of the path", trajectory.len());
        return vec![Finding::new(CHECK.name, about, State::Unknown, says)];
    }
    let mut found: Vec<Finding> = [
        speed(about, trajectory),
        rotation(about, trajectory),
        jumps(about, trajectory),
        frozen(about, trajectory),
    ]
    .into_iter()
    .flatten()
    .collect();
    if found.is_empty() {
        let seconds = trajectory.end().since(trajectory.start()).as_secs_f64();
        let metres = trajectory.path_length_m();
        let says = format!("{} m in {} s without jumps or frozen stretches", short(metres), short(seconds));
        found.push(Finding::new(CHECK.name, about, State::Ok, says).number(
            "mean-speed",
            metres / seconds.max(1e-9),
            "m/s",
        ));
    }
    found
}

/// Middle speed over a tenth of a second and more, so that jitter is not counted as travel.
fn speed(about: &str, trajectory: &Trajectory) -> Option<Finding> {
    let (stamps, poses) = (trajectory.stamps(), trajectory.poses());
    let mut speeds = Vec::new();
    let mut from = 0;
    for i in 1..poses.len() {
        let dt = stamps[i].since(stamps[from]).as_secs_f64();
        if dt >= 0.1 {
            speeds.push((poses[i].translation() - poses[from].translation()).norm() / dt);
            from = i;
        }
    }
    let middle = quantile(&sorted(speeds), 0.5)?;
    (middle > FASTEST_M_S).then(|| {
        let unit = match middle {
            m if m > 1000.0 * FASTEST_M_S => "",
            _ => ": perhaps the positions are in millimetres or centimetres",
        };
        let says = format!("a middle speed of {} m/s is no robot's{unit}", short(middle));
        Finding::new(CHECK.name, about, State::Wrong, says)
            .number("middle-speed", middle, "m/s")
            .mend("`estimate-as` mm, or cm")
    })
}

fn rotation(about: &str, trajectory: &Trajectory) -> Option<Finding> {
    if !is_frozen(trajectory) {
        return None;
    }
    let metres = trajectory.path_length_m();
    let corners = metres > PATH_M && has_corners(trajectory);
    let state = if corners { State::Wrong } else { State::Look };
    let says = format!(
        "the rotation never changes{}, as if it had not been written",
        if corners { " though the path turns" } else { "" }
    );
    let finding = Finding::new(CHECK.name, about, state, says).number("path", metres, "m");
    Some(finding.mend("write the rotations: no option mends this"))
}

/// Steps that leave the course.
fn jumps(about: &str, trajectory: &Trajectory) -> Option<Finding> {
    let (stamps, poses) = (trajectory.stamps(), trajectory.poses());
    let dt: Vec<f64> = stamps.windows(2).map(|w| w[1].since(w[0]).as_secs_f64()).collect();
    let usual = quantile(&sorted(dt.clone()), 0.5)?;
    // How far a step is from the mean of its neighbours', and the acceleration that this asks for.
    let steps: Vec<_> = poses.windows(2).map(|w| w[1].translation() - w[0].translation()).collect();
    let turns: Vec<_> = poses
        .windows(2)
        .map(|w| crate::frames::rotation_vector_rad(&(w[0].rotation().inverse() * w[1].rotation())))
        .collect();
    let gap = |i: usize| dt[i] > GAP * usual;
    let mut off: Vec<(usize, f64, f64)> = Vec::new();
    for i in 1..steps.len() - 1 {
        if gap(i - 1) || gap(i) || gap(i + 1) {
            continue;
        }
        // Rates, so that uneven spacing is no jump.
        let leave = |v: &[nalgebra::Vector3<f64>]| {
            (v[i] / dt[i] - 0.5 * (v[i - 1] / dt[i - 1] + v[i + 1] / dt[i + 1])).norm() * dt[i]
        };
        off.push((i, leave(&steps), leave(&turns)));
    }
    let quantiles = |f: fn(&(usize, f64, f64)) -> f64| quantile(&sorted(off.iter().map(f).collect()), 0.9);
    let (usual_m, usual_rad) = (quantiles(|o| o.1)?, quantiles(|o| o.2)?);
    let jumped: Vec<&(usize, f64, f64)> = off
        .iter()
        .filter(|(i, m, rad)| {
            let h = dt[*i] * dt[*i];
            (*m > JUMP_M && *m > JUMP_TIMES * usual_m && m / h > JUMP_M_S2)
                || (*rad > JUMP_RAD && *rad > JUMP_TIMES * usual_rad && rad / h > JUMP_RAD_S2)
        })
        .collect();
    let largest = jumped.iter().max_by(|a, b| (a.1 + a.2).total_cmp(&(b.1 + b.2)))?;
    // A jump shows in its neighbours as well.
    let mut count = 0_u32;
    let mut last = None;
    for (i, ..) in jumped.iter().map(|j| **j) {
        if last.is_none_or(|l| i > l + 2) {
            count += 1;
        }
        last = Some(i);
    }
    let at = stamps[largest.0];
    let says = format!(
        "{count} jump{}: the largest by {} m and {} degrees at {at} ns, {} s after the start",
        if count == 1 { "" } else { "s" },
        short(largest.1),
        short(largest.2.to_degrees()),
        short(at.since(stamps[0]).as_secs_f64())
    );
    Some(
        Finding::new(CHECK.name, about, State::Look, says)
            .number("jumps", f64::from(count), "")
            .number("largest-jump", largest.1, "m")
            .number("usual-step-off-course", usual_m, "m")
            .mend("a loop closure or a reset jumps: labels across it are carried wrong; give the odometry without corrections, or key frames after it"),
    )
}

/// Stretches of poses that repeat each other within motion.
fn frozen(about: &str, trajectory: &Trajectory) -> Option<Finding> {
    let (stamps, poses) = (trajectory.stamps(), trajectory.poses());
    let same = |i: usize| {
        (poses[i].translation() - poses[i - 1].translation()).norm() < SAME_M
            && rotation_angle_rad(&(poses[i - 1].rotation().inverse() * poses[i].rotation())) < SAME_RAD
    };
    // Poses that are really still do not move on by a jerk: a stretch counts where the pose leaves it much faster than at
    // the rate of its own motion.
    let (mut longest, mut at, mut count, mut from) = (0.0_f64, 0, 0_u32, None);
    for i in 1..poses.len() {
        match (same(i), from) {
            (true, None) => from = Some(i - 1),
            (false, Some(start)) => {
                let seconds = stamps[i - 1].since(stamps[start]).as_secs_f64();
                let dt = stamps[i].since(stamps[i - 1]).as_secs_f64().max(1e-9);
                let leaves_m_s = (poses[i].translation() - poses[i - 1].translation()).norm() / dt;
                let comes_m_s = match start.checked_sub(1) {
                    None => 0.0,
                    Some(before) => {
                        let dt = stamps[start].since(stamps[before]).as_secs_f64().max(1e-9);
                        (poses[start].translation() - poses[before].translation()).norm() / dt
                    }
                };
                if seconds > FROZEN_S && leaves_m_s > 0.2 && comes_m_s > 0.2 {
                    count += 1;
                    if seconds > longest {
                        (longest, at) = (seconds, start);
                    }
                }
                from = None;
            }
            _ => {}
        }
    }
    (count > 0).then(|| {
        let says = format!(
            "the pose is frozen for {} s in the middle of motion, from {} ns on ({count} such stretch{})",
            short(longest),
            stamps[at],
            if count == 1 { "" } else { "es" }
        );
        Finding::new(CHECK.name, about, State::Look, says)
            .number("longest", longest, "s")
            .number("stretches", f64::from(count), "")
            .mend("the tracker was lost there: leave that time out with `start` and `duration`")
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::frames::{Rigid, WorldFromBody};
    use crate::time::Stamp;

    fn flight(change: impl Fn(usize, f64, WorldFromBody) -> WorldFromBody) -> Trajectory {
        let rows = (0..1000_usize).map(|i| {
            let t = i as f64 * 0.01;
            let turn =
                UnitQuaternion::from_euler_angles(0.1 * (2.0 * t).sin(), 0.1 * (1.7 * t).cos(), 0.6 * t);
            let pose =
                Rigid::from_parts(Vector3::new(2.0 * (0.5 * t).cos(), 2.0 * (0.5 * t).sin(), 1.0), turn);
            (Stamp::from_nanos(i as i64 * 10_000_000), change(i, t, pose))
        });
        Trajectory::from_poses(rows.collect::<Vec<_>>()).unwrap()
    }

    fn worst(found: &[Finding]) -> State {
        found.iter().map(|f| f.state).max().unwrap()
    }

    #[test]
    fn a_flight_is_fine_and_faults_are_named() {
        assert_eq!(worst(&path("est", &flight(|_, _, p| p))), State::Ok);
        let scaled =
            path("est", &flight(|_, _, p| Rigid::from_parts(p.translation() * 1000.0, p.rotation())));
        assert!(worst(&scaled) == State::Wrong && scaled[0].mend.contains("mm"), "{scaled:?}");
        let frozen =
            path("est", &flight(|_, _, p| Rigid::from_parts(p.translation(), UnitQuaternion::identity())));
        assert!(worst(&frozen) == State::Wrong && frozen[0].says.contains("never changes"), "{frozen:?}");
        let jump = path(
            "est",
            &flight(|i, _, p| {
                let by = if i > 500 { Vector3::new(0.08, 0.0, 0.0) } else { Vector3::zeros() };
                Rigid::from_parts(p.translation() + by, p.rotation())
            }),
        );
        assert!(worst(&jump) == State::Look && jump[0].says.starts_with("1 jump:"), "{jump:?}");
        let held = flight(|_, _, p| p);
        let stuck =
            path("est", &flight(|i, _, p| if (300..400).contains(&i) { held.poses()[300] } else { p }));
        assert!(stuck.iter().any(|f| f.says.contains("frozen for 0.99 s")), "{stuck:?}");
    }
}
