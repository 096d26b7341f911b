//! Depth from the labels themselves: half of them give it, the other half is scored.

use super::*;
use crate::evaluate::TriangulatedDepth;

fn run_triangulated(labels: &LabelSet, streams: &[Stream]) -> Evaluated {
    run_with(labels, streams, Window::default(), |evaluation| {
        let triangulated = Evaluation { depths: &[&TriangulatedDepth], ..evaluation };
        evaluate(&triangulated, &|_, _| {})
    })
    .unwrap()
}

fn scaled(scale: f64) -> Trajectory {
    let pose = |i: usize| {
        let exact = world_from_body(i);
        (stamp(i), Rigid::from_parts(exact.translation() * scale, exact.rotation()))
    };
    Trajectory::from_poses((0..FRAMES).map(pose)).unwrap()
}

#[test]
fn half_of_the_labels_give_depth_and_the_others_are_scored() {
    let labels = labels(&flyer());
    let streams = [stream(Role::Reference, exact()), stream(Role::Estimate, exact())];
    let document = run_triangulated(&labels, &streams);
    let floor = run(&labels, &streams, Window::default()).unwrap();
    for (part, by_floor) in document.pixel.iter().zip(&floor.pixel) {
        // 19 labels after each of eight key frames: ten for depth, nine are scored.
        assert_eq!((part.scored, part.skipped.len(), part.keyframes.len()), (8 * 9, 0, 8));
        let told = part.triangulation.as_ref().unwrap();
        assert_eq!((told.labels_for_depth, told.keyframes, told.keyframes_without_depth), (8 * 10, 8, 0));
        assert!(part.pooled_rmse_px.unwrap() < 1e-6, "{:?}", part.pooled_rmse_px);
        for (keyframe, by_floor) in part.keyframes.iter().zip(&by_floor.keyframes) {
            assert_eq!((&keyframe.point, keyframe.timestamp_ns), (&by_floor.point, by_floor.timestamp_ns));
            assert!((keyframe.depth_z_m / by_floor.depth_z_m - 1.0).abs() < 1e-7);
            let told = keyframe.triangulated.unwrap();
            assert!(told.depth_sigma_m > 0.0 && told.parallax_deg > 1.0 && told.labels == 10, "{told:?}");
            assert!(by_floor.triangulated.is_none());
        }
        // The scored ones are the 2nd, 4th ... after the key frame.
        let first = part.samples.iter().find(|s| s.timestamp_ns > stamp(20)).unwrap();
        assert_eq!(first.timestamp_ns, stamp(22));
    }
    #[cfg(feature = "serde")]
    {
        let text = serde_json::to_string(&document).unwrap();
        assert_eq!(serde_json::from_str::<Evaluated>(&text).unwrap(), document);
    }
}

#[test]
fn each_stream_has_depths_of_its_own_and_a_wrong_scale_leaves_no_error() {
    let labels = labels(&flyer());
    let streams = [stream(Role::Reference, exact()), stream(Role::Estimate, scaled(1.25))];
    let [exact, scaled] = &run_triangulated(&labels, &streams).pixel[..] else { panic!("two parts") };
    // The arm between body and camera is not scaled.
    assert!(scaled.pooled_rmse_px.unwrap() < 0.5, "{:?}", scaled.pooled_rmse_px);
    for (one, other) in exact.keyframes.iter().zip(&scaled.keyframes) {
        assert!((other.depth_z_m / one.depth_z_m - 1.25).abs() < 0.05);
    }
    let floor = run(&labels, &streams, Window::default()).unwrap();
    assert!(floor.pixel[1].pooled_rmse_px.unwrap() > 5.0);
}

#[test]
fn a_rotation_that_drifts_is_still_seen() {
    let labels = labels(&flyer());
    let pose = |i: usize| {
        let exact = world_from_body(i);
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.004 * i as f64);
        (stamp(i), Rigid::from_parts(exact.translation(), exact.rotation() * turn))
    };
    let drifting = Trajectory::from_poses((0..FRAMES).map(pose)).unwrap();
    let streams = [stream(Role::Reference, exact()), stream(Role::Estimate, drifting)];
    let triangulated = run_triangulated(&labels, &streams).pixel[1].pooled_rmse_px.unwrap();
    assert!(triangulated > 1.0, "{triangulated}");
}

#[test]
fn a_gap_takes_its_labels_from_both_halves_and_no_motion_gives_no_depth() {
    let labels = labels(&flyer());
    let kept = (0..FRAMES).filter(|i| !(8..12).contains(i)).map(|i| (stamp(i), world_from_body(i)));
    let gappy = Trajectory::from_poses(kept).unwrap();
    let still = Trajectory::from_poses((0..FRAMES).map(|i| (stamp(i), world_from_body(0)))).unwrap();
    let streams = [stream(Role::Estimate, gappy), Stream::new("still", Role::Estimate, still)];
    let parts = run_triangulated(&labels, &streams).pixel;
    assert_eq!(parts[0].skips_by_reason().into_iter().collect::<Vec<_>>(), [("frame-gap", 4 * 2)]);
    assert_eq!(parts[0].scored, 8 * 9 - 4 * 2);
    let told = parts[0].triangulation.as_ref().unwrap();
    assert_eq!((told.labels_for_depth, parts[0].keyframes[0].triangulated.unwrap().labels), (8 * 10, 8));
    let told = parts[1].triangulation.as_ref().unwrap();
    assert_eq!((told.keyframes, told.keyframes_without_depth, parts[1].scored), (0, 8, 0));
    assert_eq!(
        parts[1].skips_by_reason().into_iter().collect::<Vec<_>>(),
        [("keyframe-little-parallax", 8 * 9)]
    );
}

#[test]
fn it_stands_beside_no_other_depth() {
    let labels = labels(&flyer());
    let streams = [stream(Role::Estimate, exact())];
    let mixed = run_with(&labels, &streams, Window::default(), |evaluation| {
        evaluate(&Evaluation { depths: &[&FloorOfTest, &TriangulatedDepth], ..evaluation }, &|_, _| {})
    });
    assert!(matches!(mixed, Err(EvaluateError::MixedDepths)), "{mixed:?}");
    let checked = run_with(&labels, &streams, Window::default(), |evaluation| {
        let depths = Evaluation { depths: &[&TriangulatedDepth], checks: &[&FloorOfTest], ..evaluation };
        evaluate(&depths, &|_, _| {})
    });
    assert!(matches!(checked, Err(EvaluateError::MixedDepths)), "{checked:?}");
}
