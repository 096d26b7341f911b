use super::*;
use crate::frames::WorldFromBody;
use crate::time::Stamp;
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

/// Reference and estimate alike: stamps in ns, x in metres, yaw in degrees.
fn path(poses: &[(i64, f64, f64)]) -> PosePairs {
    PosePairs::new(poses.iter().map(|&(t, x, yaw)| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * yaw.to_radians());
        let pose = WorldFromBody::from_parts(Vector3::x() * x, turn);
        (Stamp::from_nanos(t), pose, pose)
    }))
    .unwrap()
}

fn chosen(pairs: &PosePairs, delta: f64, unit: DeltaUnit, mode: PairMode) -> DataResult<Vec<(usize, usize)>> {
    let options = RpeOptions { delta: Delta::new(delta, unit)?, mode, pairs_from: PairsFrom::Reference };
    RpeErrors::of(pairs, &options).map(|e| e.pairs)
}

const SECOND: i64 = 1_000_000_000;

#[test]
fn deltas_that_mean_nothing_are_refused() {
    for (value, unit, why) in [
        (0.0, DeltaUnit::Meters, "not above zero"),
        (-1.0, DeltaUnit::Seconds, "not above zero"),
        (f64::NAN, DeltaUnit::Degrees, "not above zero"),
        (f64::INFINITY, DeltaUnit::Meters, "not above zero"),
        (1.5, DeltaUnit::Frames, "not a whole number"),
        (180.1, DeltaUnit::Degrees, "more than 180"),
        (1e-10, DeltaUnit::Seconds, "less than a nanosecond"),
    ] {
        let error = Delta::new(value, unit).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
    for unit in DeltaUnit::ALL {
        assert_eq!(unit.name().parse::<DeltaUnit>().unwrap(), unit);
    }
}

#[test]
fn no_pairs_says_what_there_is() {
    let pairs = path(&[(0, 0.0, 0.0), (SECOND, 1.5, 20.0)]);
    for (delta, unit, what) in [
        (2.0, DeltaUnit::Frames, "there are 2 paired poses"),
        (1e300, DeltaUnit::Frames, "there are 2 paired poses"),
        (2.0, DeltaUnit::Meters, "1.500 m long"),
        (9.0, DeltaUnit::Seconds, "span 1 s"),
        (1e300, DeltaUnit::Seconds, "span 1 s"),
        (30.0, DeltaUnit::Degrees, "turn by 20.000 degrees"),
    ] {
        for mode in [PairMode::Consecutive, PairMode::All] {
            let error = chosen(&pairs, delta, unit, mode).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }
    let single = path(&[(0, 0.0, 0.0)]);
    for unit in DeltaUnit::ALL {
        for mode in [PairMode::Consecutive, PairMode::All] {
            assert!(chosen(&single, 1.0, unit, mode).is_err());
        }
    }
}

#[test]
fn frames_step_or_slide() {
    let pairs = path(&[(0, 0.0, 0.0), (1, 0.0, 0.0), (2, 0.0, 0.0), (3, 0.0, 0.0), (4, 0.0, 0.0)]);
    let by = |delta, mode| chosen(&pairs, delta, DeltaUnit::Frames, mode).unwrap();
    assert_eq!(by(2.0, PairMode::Consecutive), [(0, 2), (2, 4)]);
    assert_eq!(by(2.0, PairMode::All), [(0, 2), (1, 3), (2, 4)]);
    assert_eq!(by(4.0, PairMode::Consecutive), [(0, 4)]);
}

#[test]
fn seconds_take_the_nearest_pose() {
    // 2 Hz with a jitter of 10 ns, and a gap of 3 s before the last two.
    let stamps = [0, 500_000_010, 999_999_990, 1_500_000_010, 4_500_000_000, 5_000_000_000];
    let poses: Vec<_> = stamps.iter().map(|t| (*t, 0.0, 0.0)).collect();
    let pairs = path(&poses);
    let by = |delta, mode| chosen(&pairs, delta, DeltaUnit::Seconds, mode).unwrap();
    // From 1.0 s the nearest to 2.0 s is at 1.5 s; from 1.5 s the nearest to 2.5 s is the pose itself: no pair.
    assert_eq!(by(1.0, PairMode::All), [(0, 2), (1, 3), (2, 3)]);
    assert_eq!(by(1.0, PairMode::Consecutive), [(0, 2), (2, 3)]);
    // The last pose counts although the clock jitters past it: 4.5 s + 0.5 s + 20 ns.
    assert_eq!(by(0.500_000_02, PairMode::All), [(0, 1), (1, 2), (2, 3), (4, 5)]);
}

#[test]
fn standing_still_takes_the_first_pose_at_a_place() {
    let pairs =
        path(&[(0, 0.0, 0.0), (1, 0.95, 0.0), (2, 0.95, 0.0), (3, 2.0, 0.0), (4, 3.0, 0.0), (5, 3.0, 0.0)]);
    let all = chosen(&pairs, 1.0, DeltaUnit::Meters, PairMode::All).unwrap();
    assert_eq!(all, [(0, 1), (1, 3), (2, 3), (3, 4)]);
    let consecutive = chosen(&pairs, 0.9, DeltaUnit::Meters, PairMode::Consecutive).unwrap();
    assert_eq!(consecutive, [(0, 1), (1, 3), (3, 4)]);
}

#[test]
fn too_many_pairs_by_angle_are_refused() {
    let turns: Vec<_> =
        (0..100).map(|i| UnitQuaternion::from_scaled_axis(Vector3::z() * f64::from(i % 2) * 0.5)).collect();
    let degrees = 0.5_f64.to_degrees();
    assert_eq!(pairs::all_by_angle(&turns, degrees, 2500).unwrap().len(), 2500);
    let error = pairs::all_by_angle(&turns, degrees, 2499).unwrap_err().to_string();
    assert!(error.contains("more than 2499 pairs of 100 poses"), "{error}");
}

/// All pairs by path as the definition says it, in O(n²).
fn nearest_by_path(x: &[f64], delta: f64) -> Vec<(usize, usize)> {
    let mut path = vec![0.0];
    for w in x.windows(2) {
        path.push(path[path.len() - 1] + (w[1] - w[0]).abs());
    }
    let mut pairs = Vec::new();
    for i in 0..x.len() {
        let mut best: Option<(f64, usize)> = None;
        for j in i + 1..x.len() {
            let off = (path[j] - path[i] - delta).abs();
            if best.is_none_or(|(least, _)| off < least) {
                best = Some((off, j));
            }
        }
        pairs.extend(best.filter(|b| b.0 <= delta * ALL_PAIRS_TOLERANCE).map(|b| (i, b.1)));
    }
    pairs
}

proptest! {
    #[test]
    fn the_search_by_path_is_the_definition(
        // Quarters, so that distances repeat and ties are exact.
        x in prop::collection::vec((-12..12_i32).prop_map(|v| f64::from(v) * 0.25), 2..50),
        delta in prop::sample::select(vec![0.25, 1.0, 2.6, 5.0]),
    ) {
        let poses: Vec<_> = x.iter().enumerate().map(|(i, x)| (i as i64, *x, 0.0)).collect();
        let got = chosen(&path(&poses), delta, DeltaUnit::Meters, PairMode::All).unwrap_or_default();
        prop_assert_eq!(got, nearest_by_path(&x, delta));
    }

    #[test]
    fn the_search_by_angle_is_the_definition(
        turns in prop::collection::vec(prop::array::uniform3(-2.0..2.0_f64), 2..40),
        degrees in 1e-3..180.0_f64,
    ) {
        let rotations: Vec<_> =
            turns.iter().map(|r| UnitQuaternion::from_scaled_axis(Vector3::from(*r))).collect();
        let mut expected = Vec::new();
        for i in 0..rotations.len() {
            for j in i + 1..rotations.len() {
                let angle = rotations[i].angle_to(&rotations[j]).to_degrees();
                if (angle - degrees).abs() <= 0.1 * degrees {
                    expected.push((i, j));
                }
            }
        }
        prop_assert_eq!(pairs::all_by_angle(&rotations, degrees, 10_000).unwrap(), expected);
    }

    #[test]
    fn the_search_by_angle_is_the_double_loop_to_the_last_bit(
        seed in 0_u64..1_000_000,
        n in 2_usize..900,
        // Of a heading, of a drone that tilts a little, of anything; standing still; and headings of whole steps, whose
        // differences lie on the bounds.
        kind in 0..5,
        degrees in prop::sample::select(vec![1e-3_f64, 0.7, 10.0, 40.0, 90.0, 163.63636363636365, 170.0, 180.0]),
    ) {
        let rotations = turning(seed, n, kind);
        let mut expected = Vec::new();
        let (delta, tolerance) = (degrees.to_radians(), (degrees * ALL_PAIRS_TOLERANCE).to_radians());
        for i in 0..n {
            for j in i + 1..n {
                let angle = rotation_angle_rad(&(rotations[i].inverse() * rotations[j]));
                if (delta - tolerance..=delta + tolerance).contains(&angle) {
                    expected.push((i, j));
                }
            }
        }
        prop_assert_eq!(pairs::all_by_angle(&rotations, degrees, usize::MAX).unwrap(), expected);
    }
}

/// Orientations along a path.
fn turning(seed: u64, n: usize, kind: i32) -> Vec<UnitQuaternion<f64>> {
    let mut numbers = crate::random::Congruential::new(seed);
    let mut at = Vector3::zeros();
    let turns = (0..n).map(|i| {
        let mut draw = |size: f64| Vector3::from_fn(|_, _| numbers.uniform(-size, size));
        let rotation = match kind {
            0 => {
                at += Vector3::z() * draw(0.2).x;
                at
            }
            1 => {
                at += Vector3::z() * draw(0.2).x;
                at + draw(0.05)
            }
            2 => draw(3.0),
            3 => Vector3::repeat(0.3),
            _ => Vector3::z() * (9.0 * (i % 41) as f64).to_radians(),
        };
        let turn = UnitQuaternion::from_scaled_axis(rotation);
        // Both signs are the same orientation.
        if i % 3 == 0 { UnitQuaternion::new_unchecked(-turn.into_inner()) } else { turn }
    });
    turns.collect()
}

#[test]
fn poses_that_match_none_are_not_looked_at() {
    // With the double loop two million poses would take half an hour here.
    let turns: Vec<_> = (0..2_000_000)
        .map(|i| UnitQuaternion::from_scaled_axis(Vector3::z() * (f64::from(i) * 0.001).sin()))
        .collect();
    assert_eq!(pairs::all_by_angle(&turns, 170.0, 0).unwrap(), []);
}
