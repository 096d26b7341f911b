use super::*;
use crate::metrics::trajectory::{ApeErrors, Summary};
use crate::time::Stamp;
use approx::assert_relative_eq;
use proptest::prelude::*;

fn pairs(poses: &[(WorldFromBody, WorldFromBody)]) -> PosePairs {
    PosePairs::new(poses.iter().enumerate().map(|(i, (r, e))| (Stamp::from_nanos(i as i64), *r, *e))).unwrap()
}

fn at(x: f64, y: f64, z: f64) -> WorldFromBody {
    WorldFromBody::from_parts(Vector3::new(x, y, z), UnitQuaternion::identity())
}

fn rmse_m(pairs: &PosePairs, alignment: Alignment) -> f64 {
    let moved = align(pairs, alignment, None).unwrap().apply_to(pairs);
    Summary::of(&moved).unwrap().rmse_3d_m
}

#[test]
fn names_go_there_and_back() {
    for alignment in Alignment::ALL {
        assert_eq!(alignment.name().parse::<Alignment>().unwrap(), alignment);
    }
    assert!("SE(3)".parse::<Alignment>().unwrap_err().to_string().contains("first-pose"));
}

#[test]
fn what_is_not_determined_is_refused() {
    let line: Vec<_> =
        (0..50).map(|i| (at(0.1 * f64::from(i), 0.3, 0.7), at(0.7, 0.1 * f64::from(i), 0.3))).collect();
    let slanted: Vec<_> = (0..50)
        .map(|i| f64::from(i) * 0.037)
        .map(|s| (at(1e3 + s, 2.0 * s, 3.0 * s), at(-s, s / 3.0, 5.0 + s)))
        .collect();
    let still: Vec<_> = (0..50).map(|_| (at(0.1, 0.2, 0.3), at(1.1, 0.7, 0.3))).collect();
    for alignment in [Alignment::Se3, Alignment::Sim3] {
        for (poses, why) in [(&line, "on a line"), (&slanted, "on a line"), (&still, "coincide")] {
            let error = align(&pairs(poses), alignment, None).unwrap_err().to_string();
            assert!(error.contains(why) && error.contains("not determined"), "{error}");
        }
        let error = align(&pairs(&line), alignment, Some(2)).unwrap_err().to_string();
        assert!(error.contains("on 2 poses is not determined: fewer than three"), "{error}");
    }
    assert!(align(&pairs(&still), Alignment::Yaw, None).is_err());
    let up: Vec<_> = (0..9).map(|i| (at(1.0, 2.0, f64::from(i)), at(0.3, 0.1, f64::from(i)))).collect();
    assert!(align(&pairs(&up), Alignment::Yaw, None).is_err());
    // A line is enough for the heading, and for the first pose anything is.
    assert!(align(&pairs(&line), Alignment::Yaw, None).is_ok());
    assert!(align(&pairs(&still), Alignment::FirstPose, None).is_ok());
    assert!(align(&pairs(&line), Alignment::Se3, Some(0)).is_err());
    let huge = pairs(&[(at(1e200, 0.0, 0.0), at(0.0, 1.0, 0.0)), (at(0.0, 0.0, 1.0), at(1.0, 0.0, 0.0))]);
    assert!(align(&huge, Alignment::Yaw, None).unwrap_err().to_string().contains("too large"));
}

#[test]
fn a_mirrored_estimate_is_turned_not_mirrored() {
    let points = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0], [4.0, 1.0, 1.0]];
    let poses: Vec<_> = points.iter().map(|p| (at(p[0], p[1], p[2]), at(-p[0], p[1], p[2]))).collect();
    let pairs = pairs(&poses);
    let found = align(&pairs, Alignment::Se3, None).unwrap();
    assert_relative_eq!(found.rotation.to_rotation_matrix().matrix().determinant(), 1.0, epsilon = 1e-12);
    // No small turn away from it is better.
    let best = rmse_m(&pairs, Alignment::Se3);
    assert!(best > 0.1);
    let moments = Moments::of(&pairs, pairs.len(), Alignment::Se3).unwrap();
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        for angle in [-1e-3, 1e-3] {
            let turn = UnitQuaternion::from_scaled_axis(axis * angle);
            let other = moments.with_rotation(turn * found.rotation, 1.0).apply_to(&pairs);
            assert!(Summary::of(&other).unwrap().rmse_3d_m > best);
        }
    }
}

#[test]
fn a_nearly_straight_path_keeps_its_digits() {
    // A corridor, far from the origin of the map: 100 m long, 1 mm of sway.
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.8, 1.1));
    let poses: Vec<_> = (0..200)
        .map(|i| f64::from(i) * 0.5)
        .map(|s| {
            let p = Vector3::new(s, 1e-3 * (3.0 * s).sin(), 1e-3 * (1.7 * s).cos());
            let reference = WorldFromBody::from_parts(p + Vector3::new(5e5, 4e6, 0.0), turn);
            (reference, WorldFromBody::from_parts(turn.inverse() * p, UnitQuaternion::identity()))
        })
        .collect();
    let found = align(&pairs(&poses), Alignment::Se3, None).unwrap();
    assert!(crate::frames::rotation_angle_rad(&(found.rotation * turn.inverse())) < 1e-5);
}

fn any_pose(size: f64) -> impl Strategy<Value = WorldFromBody> {
    (prop::array::uniform3(-size..size), prop::array::uniform3(-1.7..1.7_f64))
        .prop_map(|(t, r)| Rigid::from_parts(t.into(), UnitQuaternion::from_scaled_axis(Vector3::from(r))))
}

fn flights() -> impl Strategy<Value = Vec<(WorldFromBody, WorldFromBody)>> {
    prop::collection::vec((any_pose(5.0), any_pose(0.1)), 5..30)
        .prop_map(|all| all.into_iter().map(|(pose, error)| (pose, pose * error.reinterpret())).collect())
}

proptest! {
    #[test]
    fn aligned_errors_do_not_depend_on_the_estimates_world(poses in flights(), world in any_pose(20.0)) {
        let there = pairs(&poses);
        let moved = there.map_estimate(|p| world.reinterpret::<crate::frames::World, crate::frames::World>() * *p);
        for alignment in [Alignment::FirstPose, Alignment::Se3, Alignment::Sim3] {
            let a = align(&there, alignment, None).unwrap().apply_to(&there);
            let b = align(&moved, alignment, None).unwrap().apply_to(&moved);
            let (a, b) = (ApeErrors::of(&a), ApeErrors::of(&b));
            for (a, b) in a.full.iter().zip(&b.full) {
                prop_assert!((a - b).abs() < 1e-9, "{alignment:?}: {a} and {b}");
            }
        }
    }

    #[test]
    fn exact_poses_have_no_error(poses in flights(), world in any_pose(20.0), yaw in -3.0..3.0_f64) {
        let same: Vec<_> = poses.iter().map(|(r, _)| (*r, *r)).collect();
        let same = pairs(&same);
        let turned = Rigid::from_parts(world.translation(), UnitQuaternion::from_scaled_axis(Vector3::z() * yaw));
        for alignment in Alignment::ALL {
            let world: Rigid<crate::frames::World, crate::frames::World> = match alignment {
                Alignment::None => Rigid::identity(),
                Alignment::Yaw => turned,
                _ => world.reinterpret(),
            };
            let moved = same.map_estimate(|p| world * *p);
            let back = align(&moved, alignment, None).unwrap().apply_to(&moved);
            for error in ApeErrors::of(&back).full {
                prop_assert!(error < 1e-10, "{alignment:?}: {error}");
            }
        }
    }

    #[test]
    fn sim3_recovers_the_scale(poses in flights(), world in any_pose(20.0), scale in 0.05..20.0_f64) {
        let to = ReferenceFromEstimate { rotation: world.rotation(), translation_m: world.translation(), scale };
        let same: Vec<_> = poses.iter().map(|(r, _)| (to.apply(r), *r)).collect();
        let same = pairs(&same);
        let found = align(&same, Alignment::Sim3, None).unwrap();
        prop_assert!((found.scale / scale - 1.0).abs() < 1e-12);
        let off = ApeErrors::of(&found.apply_to(&same)).statistics().unwrap();
        prop_assert!(off.full.max < 1e-9 * scale.max(1.0));
    }

    #[test]
    fn more_freedom_is_never_worse(poses in flights()) {
        let pairs = pairs(&poses);
        let [yaw, se3, sim3] = [Alignment::Yaw, Alignment::Se3, Alignment::Sim3].map(|a| rmse_m(&pairs, a));
        prop_assert!(sim3 <= se3 + 1e-12 && se3 <= yaw + 1e-12, "{yaw} {se3} {sim3}");
    }
}
