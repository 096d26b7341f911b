//! Two sources in one series: poses that jump away and come back, over and over.
//!
//! A robot that moves never does that, and noise does not come back to where it was; two robots, or two estimators, that
//! publish the same edge of tf or the same topic do nothing else, in whatever rhythm.

use vice_core::frames::rotation_angle_rad;
use vice_core::statistics::middle;
use vice_core::suspicion::Suspicion;

use crate::doubts::TWO_SOURCES;
use crate::transform::Transform;

/// Steps below these are no jumps, whatever comes after: metres and radians.
const SMALLEST_JUMP: (f64, f64) = (0.02, 0.02);
/// A series that jumps has jumped back where it is nearer to its old place than this part of the jump.
const BACK: f64 = 0.25;
/// Jumps that come back, below which a series is only restless.
const FEWEST: u64 = 4;
/// What part of the jumps has to come back.
const SHARE: f64 = 0.5;
/// How many times the middle step a step has to be, to be a jump among steps that are all large.
const ABOVE_MIDDLE: f64 = 5.0;

/// Jumps that come back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ToAndFro {
    /// How many.
    pub(crate) times: u64,
    /// The middle one of them, in the unit of the distances.
    pub(crate) middle: f64,
}

/// Looks for two sources in a series of `n` values, given how far apart any two of them are.
pub(crate) fn find(n: usize, smallest: f64, distance: impl Fn(usize, usize) -> f64) -> Option<ToAndFro> {
    let steps: Vec<f64> = (1..n).map(|i| distance(i - 1, i)).collect();
    let usual = middle(&mut steps.clone(), f64::total_cmp)?;
    // Where one source answers now and then between many of the other, and the robot is fast, only jumps among the
    // steps count; where the two alternate, each step is a jump.
    let limits = [smallest, (usual * ABOVE_MIDDLE).max(smallest)];
    limits.into_iter().find_map(|limit| jumps(&steps, limit, &distance))
}

fn jumps(steps: &[f64], limit: f64, distance: &impl Fn(usize, usize) -> f64) -> Option<ToAndFro> {
    // The jump from value i to i + 1 has come back where the next jump lands beside value i.
    let jumps: Vec<usize> = (0..steps.len()).filter(|i| steps[*i] > limit).collect();
    let comes_back = |pair: &[usize]| {
        let (away, back) = (pair[0], pair[1]);
        (distance(away, back + 1) < BACK * steps[away]).then_some(steps[away])
    };
    let mut back: Vec<f64> = jumps.windows(2).filter_map(comes_back).collect();
    let enough = back.len() as u64 >= FEWEST && back.len() as f64 >= SHARE * (jumps.len() - 1) as f64;
    let middle = middle(&mut back, f64::total_cmp)?;
    enough.then_some(ToAndFro { times: back.len() as u64, middle })
}

/// The doubt about poses in the order of their stamps.
pub(crate) fn doubt(about: &str, poses: &[Transform]) -> Option<Suspicion> {
    let metres = |a: usize, b: usize| (poses[a].translation() - poses[b].translation()).norm();
    let radians =
        |a: usize, b: usize| rotation_angle_rad(&(poses[a].rotation().inverse() * poses[b].rotation()));
    let (found, unit) = match find(poses.len(), SMALLEST_JUMP.0, metres) {
        Some(found) => (found, "m"),
        None => (find(poses.len(), SMALLEST_JUMP.1, radians)?, "rad"),
    };
    let message = "the poses jump to and fro, as where two sources publish them";
    Some(
        Suspicion::new(TWO_SOURCES, about, message)
            .evidence(format!("{} jumps of about {:.2} {unit} that come back", found.times, found.middle))
            .advice("use a topic of one source only, or record only one of them")
            .times(1),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{UnitQuaternion, Vector3};
    use vice_core::frames::Rigid;
    use vice_core::random::SplitMix;

    fn of(xs: &[f64]) -> Option<ToAndFro> {
        find(xs.len(), 0.02, |a, b| (xs[a] - xs[b]).abs())
    }

    /// `rhythm` says whose turn it is, over and over; the sources drive `step` a sample and are `apart`.
    fn two(rhythm: &[u8], n: usize, step: f64, apart: f64) -> Vec<f64> {
        let x = |i: usize| step * i as f64 + apart * f64::from(rhythm[i % rhythm.len()]);
        (0..n).map(x).collect()
    }

    #[test]
    fn two_sources_in_any_rhythm() {
        for rhythm in
            [&[0, 1][..], &[0, 0, 1, 1], &[0, 0, 0, 0, 0, 1], &[0, 0, 0, 0, 1, 1, 1, 1, 1], &[1, 0, 1]]
        {
            for (step, apart) in [(0.0, 0.03), (0.0, 0.2), (0.005, 1.0), (0.005, 100.0)] {
                let found = of(&two(rhythm, 60, step, apart)).unwrap();
                assert!((found.middle - apart).abs() < 0.1 * apart, "{rhythm:?} {step} {apart}: {found:?}");
            }
        }
        let fast = of(&two(&[0, 0, 0, 0, 0, 0, 1], 200, 0.1, 40.0)).unwrap();
        assert!(
            (fast.middle - 40.0).abs() < 1.0,
            "a source that answers rarely, among steps of 0.1 m: {fast:?}"
        );
        assert!(of(&two(&[0, 1], 8, 0.01, 3.0)).is_some(), "a short recording");
    }

    #[test]
    fn one_source_is_left_in_peace() {
        let drives: Vec<f64> = (0..200).map(|i| 0.1 * f64::from(i)).collect();
        let shakes: Vec<f64> = (0..400).map(|i| 0.5 * (0.9 * f64::from(i)).sin()).collect();
        let jumps_once: Vec<f64> = (0..100).map(|i| if i < 50 { 0.0 } else { 3.0 }).collect();
        let mut random = SplitMix::new(12345);
        let noisy: Vec<f64> = (0..2000).map(|_| random.normal()).collect();
        let outliers: Vec<f64> = (0..100).map(|i| if i == 30 || i == 60 { 9.0 } else { 0.0 }).collect();
        for series in [drives, shakes, jumps_once, noisy, outliers, vec![], vec![0.0], vec![0.0, 9.0]] {
            assert_eq!(of(&series), None);
        }
    }

    #[test]
    fn a_turn_counts_too() {
        let yaw = |i: usize| {
            UnitQuaternion::from_scaled_axis(Vector3::z() * if i.is_multiple_of(2) { 0.0 } else { 2.0 })
        };
        let poses: Vec<Transform> = (0..20).map(|i| Rigid::from_parts(Vector3::zeros(), yaw(i))).collect();
        let line = doubt("tf odom -> base", &poses).unwrap().line();
        assert!(line.starts_with("tf odom -> base: the poses jump to and fro"), "{line}");
        assert!(line.contains("of about 2.00 rad"), "{line}");
    }
}
