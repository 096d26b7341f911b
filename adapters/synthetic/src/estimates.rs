//! Estimates whose flaw is known: the truth, and the truth made wrong in one way each.

use nalgebra::{UnitQuaternion, Vector3};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::Rigid;
use vice_core::random::SplitMix;
use vice_core::time::Span;
use vice_core::trajectory::{RelativeMotion, Trajectory};

use crate::options::Flaws;

/// The names of the estimates, in the order in which they are listed.
pub const ESTIMATES: [&str; 5] = ["exact", "drift", "clock-offset", "wrong-extrinsic", "white-noise"];

/// The estimates of [`ESTIMATES`] from the truth.
pub(crate) fn estimates(
    truth: &Trajectory,
    flaws: &Flaws,
    seed: u64,
) -> DataResult<Vec<(&'static str, Trajectory)>> {
    let rotation = UnitQuaternion::from_scaled_axis(flaws.extrinsic_rotation_rad);
    let wrong_body = Rigid::from_parts(Vector3::zeros(), rotation);
    let [exact, drift, clock, extrinsic, noise] = ESTIMATES;
    let shifted = truth
        .shifted(Span::from_nanos(flaws.clock_offset_ns))
        .map_err(|e| DataError::new("the stamps of the desynchronised estimate").because(e))?;
    Ok(vec![
        (exact, truth.clone()),
        (drift, drifting(truth, flaws)?),
        (clock, shifted),
        (extrinsic, truth.map_poses(|_, pose| pose * wrong_body)),
        (noise, noisy(truth, flaws, seed)),
    ])
}

/// Dead reckoning whose heading turns at a constant rate and whose velocity is off by a constant, both in the world:
/// with the yaw error `ψ = rate · t`, each step is `Rz(ψ) Δp + drift · Δt`.
fn drifting(truth: &Trajectory, flaws: &Flaws) -> DataResult<Trajectory> {
    let start = truth.start();
    let turn =
        |seconds: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), flaws.yaw_drift_rad_s * seconds);
    let mut position = truth.poses()[0].translation();
    let mut poses = vec![(start, truth.poses()[0])];
    for ((t0, p0), (t1, p1)) in truth.iter().zip(truth.iter().skip(1)) {
        let (from, to) = (t0.since(start).as_secs_f64(), t1.since(start).as_secs_f64());
        position +=
            turn((from + to) / 2.0) * (p1.translation() - p0.translation()) + flaws.drift_m_s * (to - from);
        poses.push((t1, Rigid::from_parts(position, turn(to) * p1.rotation())));
    }
    Trajectory::from_poses(poses).map_err(|e| DataError::new("the drifting estimate").because(e))
}

fn noisy(truth: &Trajectory, flaws: &Flaws, seed: u64) -> Trajectory {
    let mut rng = SplitMix::for_purpose(seed, 3);
    truth.map_poses(|_, pose| {
        let mut vector = |sigma: f64| Vector3::from_fn(|_, _| sigma * rng.normal());
        let position = pose.translation() + vector(flaws.noise_position_m);
        let turn = UnitQuaternion::from_scaled_axis(vector(flaws.noise_rotation_rad));
        Rigid::from_parts(position, pose.rotation() * turn)
    })
}

/// A trajectory as relative motions `T^{B_t1, B_t0}` between neighbours: the paper's primary input.
pub(crate) fn relative_motions(trajectory: &Trajectory) -> Vec<RelativeMotion> {
    trajectory
        .iter()
        .zip(trajectory.iter().skip(1))
        .map(|((from, p0), (to, p1))| RelativeMotion { from, to, later_from_earlier: p1.inverse() * p0 })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::Synthetic;
    use crate::options::SyntheticOptions;
    use approx::assert_relative_eq;
    use vice_core::frames::rotation_angle_rad;

    fn made() -> (Trajectory, Vec<(&'static str, Trajectory)>) {
        let options = SyntheticOptions { width: 64, height: 48, ..Default::default() };
        let synthetic = Synthetic::new(options).unwrap();
        (synthetic.truth().clone(), synthetic.estimates().to_vec())
    }

    #[test]
    fn each_estimate_has_its_flaw_and_no_other() {
        let (truth, all) = made();
        let names: Vec<_> = all.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, ESTIMATES);
        let [exact, drift, clock, extrinsic, noise] = [0, 1, 2, 3, 4].map(|i| &all[i].1);
        assert_eq!(exact, &truth);
        assert_eq!(clock.poses(), truth.poses());
        assert_eq!(clock.start().since(truth.start()), Span::from_millis(50));
        for (wrong, right) in extrinsic.poses().iter().zip(truth.poses()) {
            assert_eq!(wrong.translation(), right.translation());
            let turn = right.rotation().inverse() * wrong.rotation();
            assert_relative_eq!(rotation_angle_rad(&turn).to_degrees(), 2.0, epsilon = 1e-9);
        }
        let n = truth.len() as f64;
        let squares: f64 = noise
            .poses()
            .iter()
            .zip(truth.poses())
            .map(|(a, b)| (a.translation() - b.translation()).norm_squared())
            .sum();
        assert_relative_eq!((squares / n / 3.0).sqrt(), 0.002, max_relative = 0.05);
        let last = truth.len() - 1;
        let seconds = truth.end().since(truth.start()).as_secs_f64();
        let turn = drift.poses()[last].rotation() * truth.poses()[last].rotation().inverse();
        assert_relative_eq!(rotation_angle_rad(&turn).to_degrees(), 0.4 * seconds, epsilon = 1e-6);
        let step = |t: &Trajectory| t.poses()[1].translation() - t.poses()[0].translation();
        assert_relative_eq!((step(drift) - step(&truth)) / 0.005, Flaws::default().drift_m_s, epsilon = 1e-4);
    }

    #[test]
    fn relative_motions_chain_back() {
        let (truth, _) = made();
        let chained = Trajectory::from_relative(&relative_motions(&truth), truth.poses()[0]).unwrap();
        for (a, b) in chained.poses().iter().zip(truth.poses()) {
            assert_relative_eq!(a.translation(), b.translation(), epsilon = 1e-9);
        }
    }
}
