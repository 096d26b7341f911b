//! Clocks of made-up flights.

use nalgebra::{UnitQuaternion, Vector3};

use super::super::turning::Turning;
use super::*;
use crate::finding::State;
use crate::frames::{Rigid, WorldFromBody};
use crate::random::SplitMix;
use crate::trajectory::Trajectory;

const START: f64 = 1_500_000_000.0;

fn stamp(seconds: f64) -> Stamp {
    Stamp::from_nanos(((START + seconds) * 1e9) as i64)
}

/// A motion that does not repeat itself.
fn attitude(t: f64, size: f64) -> UnitQuaternion<f64> {
    let s = |f: f64, p: f64| (f * t + p).sin();
    let roll = 0.3 * s(1.3, 0.0) + 0.12 * s(4.1, 1.0) + 0.05 * s(7.9, 2.0);
    let pitch = 0.25 * s(1.7, 3.0) + 0.1 * s(5.3, 1.5);
    let yaw = 1.2 * s(0.41, 0.0) + 0.3 * s(2.3, 0.7);
    UnitQuaternion::from_euler_angles(size * roll, size * pitch, size * yaw)
}

/// Poses whose clock is `late` seconds late and runs fast by a share, of a body turned against the other one.
fn poses(hz: f64, seconds: f64, size: f64, late: f64, fast: f64, noise: f64) -> Turning {
    let mut random = SplitMix::new(7);
    let body = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0);
    let world = UnitQuaternion::from_euler_angles(1.0, 0.4, -2.0);
    let count = (seconds * hz) as i64;
    let rows = (0..count).map(|i| {
        let t = i as f64 / hz;
        let mut draw = || noise * (random.below(2001) as f64 / 1000.0 - 1.0);
        let jitter = UnitQuaternion::from_scaled_axis(Vector3::new(draw(), draw(), draw()));
        let pose: WorldFromBody =
            Rigid::from_parts(Vector3::zeros(), world * attitude(t, size) * body * jitter);
        (stamp(t + late + fast * (t - 0.5 * seconds)), pose)
    });
    Turning::of_poses(&Trajectory::from_poses(rows.collect::<Vec<_>>()).unwrap()).unwrap()
}

fn gyro(hz: f64, seconds: f64, size: f64) -> Turning {
    let h = 1e-5;
    let samples: Vec<crate::imu::ImuSample> = (0..(seconds * hz) as i64)
        .map(|i| {
            let t = i as f64 / hz;
            let step = attitude(t - h, size).inverse() * attitude(t + h, size);
            let rate = crate::frames::rotation_vector_rad(&step) / (2.0 * h);
            let bias = Vector3::new(0.01, -0.02, 0.03);
            crate::imu::ImuSample { stamp: stamp(t), gyro_rad_s: rate + bias, accel_m_s2: Vector3::zeros() }
        })
        .collect();
    Turning::of_gyro(&samples).unwrap()
}

#[test]
fn offsets_are_found_in_any_frame_and_either_order() {
    let reference = gyro(200.0, 60.0, 1.0);
    for (hz, late) in [(20.0, 0.05), (20.0, -0.1), (100.0, 0.005), (2.0, 0.02), (30.0, 1.3), (25.0, 11.0)] {
        let estimate = poses(hz, 60.0, 1.0, late, 0.0, 1e-3);
        let found = clock_offset(&reference, &estimate, None).unwrap();
        let off = found.offset_s + late;
        assert!(off.abs() < 2e-3, "{hz} Hz, {late} s late: {found:?}");
        assert!(off.abs() < 3.0 * found.half_95_s.max(1e-4), "{hz} Hz: {off} {}", found.half_95_s);
        assert!(found.by_vectors && found.rate.is_none(), "{found:?}");
        let back = clock_offset(&estimate, &reference, None).unwrap();
        assert!((back.offset_s + found.offset_s).abs() < 1e-3, "{hz} Hz: {back:?}");
    }
    let said =
        finding("gyro", "est", &clock_offset(&reference, &poses(20.0, 60.0, 1.0, 0.05, 0.0, 1e-3), None));
    assert_eq!(said.state, State::Wrong);
    assert!(said.says.contains("est are 50.") || said.says.contains("est are 49."), "{}", said.says);
    assert!(said.mend.starts_with("`time-offset` -0.0") && said.says.contains("late"), "{}", said.mend);
}

#[test]
fn bodies_are_told_apart() {
    let reference = gyro(200.0, 60.0, 1.0);
    let found = clock_offset(&reference, &poses(50.0, 60.0, 1.0, 0.0, 0.0, 1e-4), None).unwrap();
    // The estimate's body in the reference's.
    let body = UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0);
    assert!(
        found.reference_from_estimate.angle_to(&body) < 2e-3,
        "{}",
        found.reference_from_estimate.angle_to(&body)
    );
}

#[test]
fn rates_are_found() {
    let reference = gyro(200.0, 60.0, 1.0);
    for share in [5e-4, -3e-3] {
        let found = clock_offset(&reference, &poses(50.0, 60.0, 1.0, 0.0, share, 1e-3), None).unwrap();
        let rate = found.rate.unwrap();
        assert!((rate.share + share).abs() < 2.0 * rate.half_95.max(1e-5), "{share}: {rate:?}");
        assert!(found.offset_s.abs() < 2e-3, "{found:?}");
        assert_eq!(finding("a", "b", &Ok(found)).state, State::Wrong);
    }
}

#[test]
fn a_wrong_frame_rate_and_a_clock_that_is_set_are_told_by_parts() {
    let reference = gyro(200.0, 60.0, 1.0);
    for share in [0.05, -0.02] {
        let found = clock_offset(&reference, &poses(50.0, 60.0, 1.0, 0.0, share, 1e-3), None).unwrap();
        let rate = found.rate.unwrap().share;
        // Seconds of the estimate are longer by the share.
        assert!((rate + share / (1.0 + share)).abs() < 1e-3, "{share}: {found:?}");
    }
    let plain = poses(50.0, 60.0, 1.0, 0.0, 0.0, 1e-3);
    let (start, _) = plain.range();
    let rows = plain.times().iter().zip(plain.rotations()).map(|(t, r)| {
        let late = if *t > 25.0 { 0.15 } else { 0.0 };
        let at = start + Span::from_secs_f64(t + late).unwrap();
        (at, WorldFromBody::from_parts(Vector3::zeros(), *r))
    });
    let stepped = Turning::of_poses(&Trajectory::from_poses(rows.collect::<Vec<_>>()).unwrap()).unwrap();
    match clock_offset(&reference, &stepped, None) {
        Err(ClockDoubt::Step { at, before_s, after_s }) => {
            assert!(before_s.abs() < 5e-3 && (after_s + 0.15).abs() < 5e-3, "{before_s} {after_s}");
            assert!((at.since(start).as_secs_f64() - 25.0).abs() < 5.0, "{at}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_cannot_be_known_is_not_said() {
    let reference = gyro(200.0, 60.0, 1.0);
    // Quiet, with noise of the poses.
    let quiet = clock_offset(&gyro(200.0, 60.0, 1e-3), &poses(20.0, 60.0, 1e-3, 0.05, 0.0, 1e-3), None);
    assert!(quiet.is_err(), "{quiet:?}");
    // Another motion.
    let other = poses(20.0, 60.0, -1.7, 40.0, 0.0, 1e-3);
    let unlike = clock_offset(&reference, &other, Some(2.0));
    assert!(matches!(unlike, Err(ClockDoubt::Uncorrelated { .. })), "{unlike:?}");
    // No time in common.
    let later = clock_offset(&reference, &poses(20.0, 60.0, 1.0, 1000.0, 0.0, 1e-3), None);
    assert!(matches!(later, Err(ClockDoubt::TooShort { .. })), "{later:?}");
    // A motion that repeats itself each second.
    let sway = |hz: f64, late: f64| {
        let rows = (0..(60.0 * hz) as i64).map(|i| {
            let t = i as f64 / hz;
            let turn = UnitQuaternion::from_euler_angles(0.3 * (std::f64::consts::TAU * t).sin(), 0.0, 0.0);
            (stamp(t + late), WorldFromBody::from_parts(Vector3::zeros(), turn))
        });
        Turning::of_poses(&Trajectory::from_poses(rows.collect::<Vec<_>>()).unwrap()).unwrap()
    };
    let periodic = clock_offset(&sway(100.0, 0.0), &sway(30.0, 0.02), None);
    assert!(matches!(periodic, Err(ClockDoubt::NotUnique { .. })), "{periodic:?}");
    let said = finding("a", "b", &periodic);
    assert_eq!(said.state, State::Unknown);
    assert!(said.says.contains("too uncertain"), "{}", said.says);
}
