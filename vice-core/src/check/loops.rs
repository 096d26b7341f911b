//! Whether a stream comes back to places where the reference comes back.
//!
//! Between two moments at one place of the reference the relative pose is nearly none, whatever was driven in between; what
//! an estimate says instead is its drift over that way. Odometry always has some: this is no fault, but a stream that
//! closes no loop is not one to label a map with.

use super::Check;
use crate::finding::{Finding, State, short};
use crate::statistics::{median, quantile, sorted};
use crate::time::{Span, Stamp};
use crate::trajectory::Trajectory;

/// What this check is.
pub const CHECK: Check = Check {
    name: "loops",
    title: "places that are seen again",
    looks_at: "whether an estimate comes back to where the reference comes back, against the way between",
    threshold: "look where it misses by more than 5 % of the way between and more than 0.3 m, in the middle of all loops",
    source: "relative poses between visits of one place; usual odometry drifts by 0.1 to 2 % of the way",
};

/// Moments that are compared, seconds apart, and at most so many.
const STEP_S: f64 = 0.5;
const MOST: usize = 1200;
/// A visit is another one after this time and this way, seconds and metres.
const APART_S: f64 = 10.0;
const WAY_M: f64 = 5.0;
/// Places this near are one, metres.
const SAME_M: f64 = 0.5;
/// Worth a look, a share of the way, and metres.
const SHARE: f64 = 0.05;
const OFF_M: f64 = 0.3;
/// Fewer loops say nothing.
const FEWEST: usize = 3;

/// How an estimate closes the loops of a reference; nothing where there are none. `offset`: what is added to the estimate's
/// stamps first.
pub fn loops(reference: (&str, &Trajectory), estimate: (&str, &Trajectory), offset: Span) -> Option<Finding> {
    let spacing = |t: &Trajectory| t.median_spacing().map(|s| s.as_secs_f64());
    let gap = |t: &Trajectory| Span::from_secs_f64((2.5 * spacing(t)?).max(0.11)).ok();
    let (gap, own_gap) = (gap(reference.1)?, gap(estimate.1)?);
    let start = reference.1.start().max(estimate.1.start().saturating_add(offset));
    let end = reference.1.end().min(estimate.1.end().saturating_add(offset));
    let seconds = end.since(start).as_secs_f64();
    let step = STEP_S.max(seconds / MOST as f64).max(spacing(estimate.1)?);
    if seconds < APART_S || step > APART_S {
        return None;
    }
    let mut rows = Vec::new();
    let mut way = 0.0;
    for k in 0..=(seconds / step) as usize {
        let stamp = start.saturating_add(Span::from_secs_f64(k as f64 * step).ok()?);
        let own = Stamp::from_nanos(stamp.as_nanos().saturating_sub(offset.as_nanos()));
        let (Ok(truth), Ok(pose)) = (reference.1.pose_at(stamp, gap), estimate.1.pose_at(own, own_gap))
        else {
            continue;
        };
        if let Some((_, before, _, _)) = rows.last() {
            let before: &crate::frames::WorldFromBody = before;
            way += (truth.translation() - before.translation()).norm();
        }
        rows.push((k as f64 * step, truth, pose, way));
    }
    let (mut off, mut shares) = (Vec::new(), Vec::new());
    for (i, (t, truth, pose, way)) in rows.iter().enumerate() {
        // The nearest later visit.
        let later = rows[i + 1..].iter().filter(|r| r.0 - t > APART_S && r.3 - way > WAY_M);
        let distance = |r: &&(f64, _, _, f64)| (place(&r.1) - truth.translation()).norm();
        let Some(again) = later.min_by(|a, b| distance(a).total_cmp(&distance(b))) else { continue };
        if distance(&again) > SAME_M {
            continue;
        }
        let true_step = truth.inverse() * again.1;
        let own_step = pose.inverse() * again.2;
        let miss = (own_step.translation() - true_step.translation()).norm();
        off.push(miss);
        shares.push(miss / (again.3 - way));
    }
    if off.len() < FEWEST {
        return None;
    }
    let count = off.len() as f64;
    let (middle, share) = (median(&mut off.clone())?, median(&mut shares)?);
    let worst = quantile(&sorted(off), 0.95)?;
    let state = if share > SHARE && middle > OFF_M { State::Look } else { State::Ok };
    let (name, truth) = (estimate.0, reference.0);
    let says = format!(
        "where {truth} comes back to a place, {name} misses it by {} m, {:.1} % of the way between",
        short((1e3 * middle).round() / 1e3),
        100.0 * share
    );
    let finding = Finding::new(CHECK.name, format!("{truth} / {name}"), state, says)
        .number("middle", middle, "m")
        .number("95%-quantile", worst, "m")
        .number("visits", count, "");
    Some(match state {
        State::Look => finding
            .mend("poses of this stream place nothing in a map; its drift is what `vice evaluate` measures"),
        _ => finding,
    })
}

fn place(pose: &crate::frames::WorldFromBody) -> nalgebra::Vector3<f64> {
    pose.translation()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Rigid, WorldFromBody};
    use nalgebra::{UnitQuaternion, Vector3};

    /// Rounds of 20 s and about 12.6 m, with a drift in the world, m/s.
    fn rounds(drift: f64) -> Trajectory {
        let rows = (0..1200).map(|i| {
            let t = f64::from(i) * 0.05;
            let angle = t * std::f64::consts::TAU / 20.0;
            let at = Vector3::new(2.0 * angle.cos() + drift * t, 2.0 * angle.sin(), 1.0);
            let pose: WorldFromBody =
                Rigid::from_parts(at, UnitQuaternion::from_euler_angles(0.0, 0.0, angle));
            (Stamp::from_nanos(i64::from(i) * 50_000_000), pose)
        });
        Trajectory::from_poses(rows.collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn a_stream_that_does_not_come_back_is_told() {
        let truth = rounds(0.0);
        let said = |drift: f64| loops(("truth", &truth), ("est", &rounds(drift)), Span::ZERO).unwrap();
        let good = said(0.002);
        assert_eq!(good.state, State::Ok, "{good:?}");
        // A round of 20 s at 0.05 m/s of drift: 1 m in 12.6 m.
        let bad = said(0.05);
        assert!(bad.state == State::Look && bad.says.contains("by 1 m, 8.0 %"), "{bad:?}");
        // A straight path has no loops.
        let line = truth.map_poses(|stamp, pose| {
            let at = Vector3::new(0.5 * stamp.as_nanos() as f64 * 1e-9, 0.0, 0.0);
            Rigid::from_parts(at, pose.rotation())
        });
        assert!(loops(("truth", &line), ("est", &rounds(0.0)), Span::ZERO).is_none());
    }
}
