//! The EuRoC adapter on the real sequence, against what SciPy integrates from its files.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use vice_core::dataset::{Dataset, DatasetFactory, GROUND_TRUTH, OpenOptions, Probe};
use vice_core::frames::rotation_angle_rad;
use vice_core::imu::{GRAVITY_Z_UP_M_S2, integrate_euler};
use vice_core::time::{Span, Stamp};
use vice_euroc::Euroc;

fn v1_01() -> Option<Box<dyn Dataset>> {
    let path = vice_tests::shared("data/euroc_v1_01")?;
    Some(Euroc.open(&path, &OpenOptions::default()).unwrap())
}

#[test]
fn the_imu_integrates_as_scipy_does() {
    let (Some(dataset), Some(oracle)) =
        (v1_01(), vice_tests::shared_json("oracle/euroc_v1_01_imu_euler.json"))
    else {
        return;
    };
    let start = Stamp::from_nanos(oracle["start"]["timestamp_ns"].as_i64().unwrap());
    let state = dataset.inertial_state(start).unwrap().unwrap();
    let poses = oracle["poses"].as_array().unwrap();
    let last = Stamp::from_nanos(poses.last().unwrap()["timestamp_ns"].as_i64().unwrap());
    assert!(last.since(start) >= Span::from_millis(5_900), "the oracle covers six seconds");
    let integrated = integrate_euler(&dataset.imu().unwrap(), &state, last, GRAVITY_Z_UP_M_S2).unwrap();
    for pose in poses {
        let stamp = Stamp::from_nanos(pose["timestamp_ns"].as_i64().unwrap());
        let got = integrated.pose_at(stamp, Span::from_millis(6)).unwrap();
        let p: Vec<f64> = serde_json::from_value(pose["position_m"].clone()).unwrap();
        let q: Vec<f64> = serde_json::from_value(pose["quat_xyzw"].clone()).unwrap();
        let off_m = (got.translation() - Vector3::new(p[0], p[1], p[2])).norm();
        assert!(off_m < 1e-6, "{off_m:e} m off at {stamp}");
        let expected = UnitQuaternion::from_quaternion(Quaternion::new(q[3], q[0], q[1], q[2]));
        let off_rad = rotation_angle_rad(&(expected.inverse() * got.rotation()));
        assert!(off_rad < 1e-6, "{off_rad:e} rad off at {stamp}");
    }
}

#[test]
fn the_sequence_is_what_its_files_say() {
    let Some(dataset) = v1_01() else { return };
    assert_eq!((dataset.name(), dataset.format()), ("euroc_v1_01", "euroc"));
    assert_eq!(dataset.cameras(), ["cam0", "cam1"]);
    for camera in dataset.cameras() {
        let frames = dataset.frames(&camera).unwrap();
        assert_eq!((frames.len(), frames[0].as_nanos()), (100, 1_403_715_273_262_142_976));
        let intrinsics = dataset.camera(&camera).unwrap();
        let image = dataset.image(&camera, 99).unwrap();
        assert_eq!((image.width(), image.height()), (intrinsics.width(), intrinsics.height()));
        assert!(dataset.image(&camera, 100).is_err());
    }
    let cam0 = dataset.camera("cam0").unwrap();
    assert_eq!(cam0.fx_fy_cx_cy(), [458.654, 457.296, 367.215, 248.375]);
    let body_from_camera = dataset.body_from_camera("cam0", Stamp::default()).unwrap();
    let expected = Vector3::new(-0.0216401454975, -0.064676986768, 0.00981073058949);
    assert_eq!(body_from_camera.translation(), expected);
    // The baseline between the two cameras is known: 11 cm.
    let baseline = body_from_camera.inverse() * dataset.body_from_camera("cam1", Stamp::default()).unwrap();
    assert!((baseline.translation().norm() - 0.110_078).abs() < 1e-5);

    assert_eq!(dataset.streams(), [GROUND_TRUTH]);
    assert_eq!(dataset.trajectory(GROUND_TRUTH).unwrap().len(), 2895);
    assert_eq!(dataset.imu().unwrap().len(), 29_120);
    assert!(dataset.cloud().unwrap().is_some());
    assert!(!dataset.has_depth("cam0"));
    assert!(dataset.camera("cam7").unwrap_err().to_string().contains("known: cam0, cam1"));
    assert!(dataset.trajectory("slam").unwrap_err().to_string().contains("known: ground-truth"));
}

#[test]
fn the_sequence_is_found_from_every_folder() {
    let Some(path) = vice_tests::shared("data/euroc_v1_01") else { return };
    assert_eq!(Euroc.probe(&path), Probe::Yes);
    assert_eq!(Euroc.probe(&path.join("mav0")), Probe::Yes);
    assert_eq!(Euroc.probe(&path.join("labels")), Probe::No);
    match Euroc.probe(path.parent().unwrap()) {
        Probe::Collection(runs) => assert!(runs.contains(&path), "{runs:?}"),
        other => panic!("{other:?}"),
    }
    let inside = Euroc.open(&path.join("mav0"), &OpenOptions::default()).unwrap();
    assert_eq!(inside.name(), "euroc_v1_01");
}
