//! Cameras that turn with a body, and extrinsics that are right or wrong.

use super::*;
use crate::imu::ImuSample;
use crate::random::SplitMix;
use crate::time::Stamp;

fn attitude(t: f64, level: bool) -> UnitQuaternion<f64> {
    let s = |f: f64, p: f64| (f * t + p).sin();
    let size = if level { 0.0 } else { 1.0 };
    UnitQuaternion::from_euler_angles(
        size * (0.3 * s(1.3, 0.0) + 0.1 * s(4.1, 1.0)),
        size * (0.25 * s(1.7, 3.0) + 0.1 * s(5.3, 1.5)),
        1.2 * s(0.41, 0.0) + 0.3 * s(2.3, 0.7),
    )
}

fn stamp(t: f64) -> Stamp {
    Stamp::from_nanos(1_500_000_000_000_000_000 + (t * 1e9).round() as i64)
}

fn truth() -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(-1.9, 0.02, -1.6)
}

fn gyro(level: bool) -> Turning {
    let h = 1e-5;
    let samples: Vec<ImuSample> = (0..8000)
        .map(|i| {
            let t = f64::from(i) * 0.005;
            let step = attitude(t - h, level).inverse() * attitude(t + h, level);
            ImuSample {
                stamp: stamp(t),
                gyro_rad_s: step.scaled_axis() / (2.0 * h) + Vector3::new(0.01, -0.02, 0.05),
                accel_m_s2: Vector3::zeros(),
            }
        })
        .collect();
    Turning::of_gyro(&samples).unwrap()
}

/// Runs of 30 frames at 20 Hz, eight of them, each turn with noise, and some quite wrong.
fn camera(level: bool, noise: f64) -> Turning {
    let mut random = SplitMix::new(5);
    let mut steps = Vec::new();
    for run in 0..8 {
        for k in 0..30 {
            let t = 1.0 + 4.7 * f64::from(run) + 0.05 * f64::from(k);
            let turn = |t: f64| attitude(t, level) * truth();
            let mut step = turn(t - 0.05).inverse() * turn(t);
            let mut draw = |size: f64| Vector3::from_fn(|_, _| size * random.normal());
            let wrong = if (k + run) % 12 == 5 { draw(0.05) } else { Vector3::zeros() };
            step *= UnitQuaternion::from_scaled_axis(draw(noise) + wrong);
            steps.push((stamp(t), (k > 0).then_some(step)));
        }
    }
    Turning::of_steps(&steps).unwrap()
}

fn said(given: UnitQuaternion<f64>, level: bool, noise: f64) -> Finding {
    let expected = gyro(level).of_frame(|_| Some(given)).unwrap();
    let others = [("cam1".to_string(), UnitQuaternion::from_euler_angles(-1.9, 0.6, -1.6))];
    let subject = Subject { camera: "cam0", source: "imu", is_body: true, given, others: &others };
    finding(&subject, &hand_eye(&expected, &camera(level, noise), 0.0, true))
}

#[test]
fn right_extrinsics_are_right_and_wrong_ones_are_off_by_what_they_are() {
    let fine = said(truth(), false, 1e-3);
    assert_eq!(fine.state, State::Ok, "{fine:?}");
    for (degrees, state) in [(0.3, State::Ok), (2.5, State::Look), (5.0, State::Wrong), (25.0, State::Wrong)]
    {
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let off = UnitQuaternion::from_scaled_axis(axis * f64::to_radians(degrees));
            let found = said(truth() * off, false, 1e-3);
            assert_eq!(found.state, state, "{degrees}: {found:?}");
            let told = found.numbers.iter().find(|n| n.name == "off").unwrap().value;
            let half = found.numbers.iter().find(|n| n.name == "half-of-95%-interval").unwrap().value;
            assert!((told - degrees).abs() < (2.0 * half).max(0.05), "{degrees}: {told} {half}");
            assert!(half < 1.0, "{half}");
        }
    }
}

#[test]
fn intervals_hold_the_truth() {
    let mut inside = 0;
    for seed in 0..60 {
        let mut random = SplitMix::new(seed);
        let expected = gyro(false).of_frame(|_| Some(truth())).unwrap();
        let mut steps = Vec::new();
        for i in 0..160 {
            let t = 1.0 + 0.2 * f64::from(i);
            let turn = |t: f64| attitude(t, false) * truth();
            let noise = Vector3::from_fn(|_, _| 4e-3 * random.normal());
            let step = turn(t - 0.2).inverse() * turn(t) * UnitQuaternion::from_scaled_axis(noise);
            steps.push((stamp(t), (i > 0).then_some(step)));
        }
        let found = hand_eye(&expected, &Turning::of_steps(&steps).unwrap(), 0.0, true).unwrap();
        inside += i32::from(found.beyond_rad == 0.0);
    }
    // All three axes at once, each at 95 %.
    assert!((45..=59).contains(&inside), "{inside} of 60");
}

#[test]
fn mistakes_are_named() {
    let named = |given: UnitQuaternion<f64>, words: &str| {
        let found = said(given, false, 1e-3);
        assert!(found.state == State::Wrong && found.says.contains(words), "{words}: {found:?}");
    };
    named(truth().inverse(), "inverse");
    let optical = UnitQuaternion::from_basis_unchecked(&[-Vector3::y(), -Vector3::z(), Vector3::x()]);
    named(truth() * optical.inverse(), "looks along x");
    named(truth() * optical, "twice");
    let identity = said(UnitQuaternion::identity(), false, 1e-3);
    assert!(
        identity.state == State::Wrong && identity.mend.contains("`body_from_camera` is ["),
        "{identity:?}"
    );
    // Those of the other camera.
    let given = truth() * UnitQuaternion::from_euler_angles(0.4, -0.3, 0.2);
    let expected = gyro(false).of_frame(|_| Some(given)).unwrap();
    let others = [("cam1".to_string(), truth())];
    let subject = Subject { camera: "cam0", source: "imu", is_body: true, given, others: &others };
    let found = finding(&subject, &hand_eye(&expected, &camera(false, 1e-3), 0.0, true));
    assert!(found.says.contains("those of cam1 would fit"), "{found:?}");
    // An estimate whose poses are the camera's.
    let poses = gyro(false).of_frame(|_| Some(truth())).unwrap();
    let expected = poses.of_frame(|_| Some(truth())).unwrap();
    let subject = Subject { camera: "cam0", source: "est", is_body: false, given: truth(), others: &[] };
    let found = finding(&subject, &hand_eye(&expected, &camera(false, 1e-3), 0.0, true));
    assert!(found.state == State::Wrong && found.mend.contains("`estimate-as` camera"), "{found:?}");
}

#[test]
fn a_cart_tells_where_its_axis_lies_and_no_more() {
    let fine = said(truth(), true, 5e-4);
    assert!(fine.state == State::Ok && fine.says.contains("one axis only"), "{fine:?}");
    // Turned about the vertical: nothing can be known of that.
    let about = said(UnitQuaternion::from_scaled_axis(Vector3::z() * 0.5) * truth(), true, 5e-4);
    assert_eq!(about.state, State::Ok, "{about:?}");
    let tilted = said(UnitQuaternion::from_scaled_axis(Vector3::x() * 0.2) * truth(), true, 5e-4);
    assert_eq!(tilted.state, State::Wrong, "{tilted:?}");
}

#[test]
fn what_cannot_be_known_is_not_said() {
    let noisy = said(truth().inverse(), false, 0.2);
    assert_eq!(noisy.state, State::Unknown, "{noisy:?}");
    let expected = gyro(false).of_frame(|_| Some(truth())).unwrap();
    let short: Vec<_> =
        (0..12).map(|i| (stamp(2.0 + 0.1 * f64::from(i)), Some(UnitQuaternion::identity()))).collect();
    let few = hand_eye(&expected, &Turning::of_steps(&short).unwrap(), 0.0, true);
    assert!(matches!(few, Err(HandEyeDoubt::Few { .. })), "{few:?}");
    let still: Vec<_> =
        (0..300).map(|i| (stamp(2.0 + 0.05 * f64::from(i)), Some(UnitQuaternion::identity()))).collect();
    let rest = hand_eye(&Turning::of_steps(&still).unwrap(), &Turning::of_steps(&still).unwrap(), 0.0, true);
    assert!(matches!(rest, Err(HandEyeDoubt::Quiet { .. })), "{rest:?}");
}
