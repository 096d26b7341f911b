//! Conventions by gyroscope and accelerometer.

use nalgebra::{UnitQuaternion, Vector3};

use super::*;
use crate::frames::{Body, BodyFromCamera, Rigid, WorldFromBody, rotation_vector_rad};

fn pose(t: f64) -> WorldFromBody {
    let turn = UnitQuaternion::from_euler_angles(0.2 * (1.9 * t).sin(), 0.15 * (1.3 * t).cos(), 0.5 * t);
    let at = Vector3::new(2.0 * (0.9 * t).cos(), 1.5 * (1.1 * t).sin(), 1.0 + 0.3 * (1.7 * t).sin());
    Rigid::from_parts(at, turn)
}

fn imu() -> Vec<ImuSample> {
    let h = 1e-3;
    (0..6000_i64)
        .map(|i| {
            let t = i as f64 * 0.005;
            let step = pose(t - h).rotation().inverse() * pose(t + h).rotation();
            let curve = (pose(t + h).translation() - pose(t).translation() * 2.0 + pose(t - h).translation())
                / (h * h);
            let force = pose(t).rotation().inverse() * (curve + Vector3::new(0.0, 0.0, 9.81));
            ImuSample {
                stamp: Stamp::from_nanos(i * 5_000_000),
                gyro_rad_s: rotation_vector_rad(&step) / (2.0 * h) + Vector3::new(-0.01, 0.02, 0.05),
                accel_m_s2: force + Vector3::new(0.05, -0.1, 0.08),
            }
        })
        .collect()
}

fn extrinsics() -> BodyFromCamera {
    Rigid::from_parts(Vector3::new(0.1, -0.03, 0.02), UnitQuaternion::from_euler_angles(-1.9, 0.02, -1.6))
}

fn said(world: WorldFromBody, misread: impl Fn(WorldFromBody) -> WorldFromBody) -> Vec<Finding> {
    let rows = (0..580_i64).map(|i| {
        let jitter = Vector3::new((i % 3) as f64, (i % 5) as f64, (i % 7) as f64) * 2e-4;
        let moved: WorldFromBody = world * pose(i as f64 * 0.05).reinterpret::<Body, Body>();
        let noisy = Rigid::from_parts(moved.translation() + jitter, moved.rotation());
        (Stamp::from_nanos(i * 50_000_000), misread(noisy))
    });
    let trajectory = Trajectory::from_poses(rows.collect::<Vec<_>>()).unwrap();
    let at = |_: Stamp| Some(extrinsics());
    let given = Given { body_from_camera: Some(&at), first_frame: None };
    inertial(&imu(), ("est", &trajectory), Span::ZERO, true, given)
}

#[test]
fn good_poses_are_fine_and_a_tilted_world_is_told() {
    let fine = said(Rigid::identity(), |p| p);
    assert_eq!(fine.iter().map(|f| f.state).collect::<Vec<_>>(), [State::Ok; 3], "{fine:?}");
    let tilted = Rigid::from_parts(Vector3::zeros(), UnitQuaternion::from_euler_angles(1.4, 0.0, 0.0));
    let found = said(tilted, |p| p);
    assert!(found[0].state == State::Ok && found[1].state == State::Wrong, "{found:?}");
    assert!(found[1].says.contains("up is 80."), "{}", found[1].says);
}

#[test]
fn each_convention_is_named_without_a_reference() {
    let quaternion = |p: WorldFromBody, [w, x, y, z]: [f64; 4]| {
        let q = nalgebra::Quaternion::new(w, x, y, z);
        Rigid::from_parts(p.translation(), UnitQuaternion::from_quaternion(q))
    };
    let named = |misread: &dyn Fn(WorldFromBody) -> WorldFromBody, word: &str| {
        let found = said(Rigid::identity(), misread);
        assert_eq!(found[0].state, State::Wrong, "{word}: {found:?}");
        assert!(found[0].mend.contains(&format!("`estimate-as` {word}")), "{word}: {found:?}");
    };
    named(&|p| Rigid::from_parts(p.translation(), p.rotation().inverse()), "conjugate");
    named(&|p| p.inverse().reinterpret(), "inverse");
    named(
        &|p| {
            let q = p.rotation().coords;
            quaternion(p, [q.z, q.w, q.x, q.y])
        },
        "wxyz",
    );
    named(&|p| p * extrinsics().reinterpret::<Body, Body>(), "camera");
    named(
        &|p| {
            let t = p.translation();
            Rigid::from_parts(Vector3::new(t.y, t.x, t.z), p.rotation())
        },
        "yxz",
    );
    named(&|p| Rigid::from_parts(p.translation() * 1000.0, p.rotation()), "mm");
    named(
        &|p| {
            let (t, q) = (p.translation(), p.rotation().coords);
            let m = quaternion(p, [q.w, -q.x, -q.y, q.z]);
            Rigid::from_parts(Vector3::new(t.x, t.y, -t.z), m.rotation())
        },
        "mirror-z",
    );
    let frozen = said(Rigid::identity(), |p| Rigid::from_parts(p.translation(), UnitQuaternion::identity()));
    assert!(frozen[0].state == State::Wrong && frozen[0].says.contains("never changes"), "{frozen:?}");
}

#[test]
fn units_of_the_imu_are_told() {
    let rows = (0..580_i64).map(|i| (Stamp::from_nanos(i * 50_000_000), pose(i as f64 * 0.05)));
    let trajectory = Trajectory::from_poses(rows.collect::<Vec<_>>()).unwrap();
    let with = |f: fn(&mut ImuSample)| {
        let mut samples = imu();
        samples.iter_mut().for_each(f);
        inertial(&samples, ("est", &trajectory), Span::ZERO, true, Given::default())[0].says.clone()
    };
    assert!(with(|s| s.accel_m_s2 /= 9.81).contains("in g"));
    assert!(with(|s| s.gyro_rad_s *= 180.0 / std::f64::consts::PI).contains("degrees a second"));
}

#[test]
fn noise_of_the_positions_is_no_smaller_unit() {
    // A body that turns in its place, and a tracker whose positions jitter by centimetres.
    let samples: Vec<ImuSample> = (0..6000_i64)
        .map(|i| {
            let t = i as f64 * 0.005;
            let (h, turn) = (1e-3, |t: f64| pose(t).rotation());
            let step = turn(t - h).inverse() * turn(t + h);
            ImuSample {
                stamp: Stamp::from_nanos(i * 5_000_000),
                gyro_rad_s: rotation_vector_rad(&step) / (2.0 * h),
                accel_m_s2: turn(t).inverse() * Vector3::new(0.0, 0.0, 9.81),
            }
        })
        .collect();
    let rows = (0..580_i64).map(|i| {
        let jitter =
            Vector3::new((i * 7919 % 101) as f64, (i * 6101 % 97) as f64, (i * 5003 % 89) as f64) * 3e-4;
        (Stamp::from_nanos(i * 50_000_000), Rigid::from_parts(jitter, pose(i as f64 * 0.05).rotation()))
    });
    let trajectory = Trajectory::from_poses(rows.collect::<Vec<_>>()).unwrap();
    let found = inertial(&samples, ("est", &trajectory), Span::ZERO, true, Given::default());
    assert!(found.iter().all(|f| f.state != State::Wrong), "{found:?}");
}
