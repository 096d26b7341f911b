use std::path::PathBuf;

use proptest::prelude::*;

use super::*;

fn read_as(name: &str, text: &str) -> DataResult<CalibrationFile> {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    CalibrationFile::read(&path)
}

fn base() -> Camera {
    let model = Model::from_name("radtan", &[-0.28, 0.07, 2e-4, 2e-5]).unwrap();
    Camera::new(752, 480, [458.0, 457.0, 367.0, 248.0], model).unwrap()
}

#[test]
fn what_is_left_out_stays() {
    let file =
        read_as("c.toml", "time_offset_s = -0.02\n[cam0]\nintrinsics = [400, 401.5, 300, 200]\n").unwrap();
    let camera = file.camera("cam0", Some(&base())).unwrap().unwrap();
    assert_eq!(camera.fx_fy_cx_cy(), [400.0, 401.5, 300.0, 200.0]);
    assert_eq!((camera.width(), camera.model()), (752, base().model()));
    assert_eq!(file.time_offset, Some(Span::from_millis(-20)));
    assert_eq!(file.camera("cam1", Some(&base())).unwrap(), None);
    assert_eq!(file.body_from_camera("cam0"), None);
    let alone = file.camera("cam0", None).unwrap_err().to_string();
    assert!(alone.contains("c.toml") && alone.contains("resolution is missing"), "{alone}");

    let file = read_as("c.toml", "[cam0]\nmodel = 'radial-tangential'\n").unwrap();
    assert_eq!(file.camera("cam0", Some(&base())).unwrap(), Some(base()));
    let file = read_as("c.toml", "[cam0]\nmodel = 'pinhole'\n").unwrap();
    assert_eq!(file.camera("cam0", Some(&base())).unwrap().unwrap().model(), &Model::Pinhole);
    let file = read_as("c.toml", "[cam0]\nmodel = 'equidistant'\n").unwrap();
    let error = file.camera("cam0", Some(&base())).unwrap_err().to_string();
    assert!(error.contains("equidistant takes 4"), "{error}");
    let file = read_as("c.toml", "[cam0]\ndistortion = [1, 2]\n").unwrap();
    assert!(file.camera("cam0", Some(&base())).is_err());
}

#[test]
fn a_camchain_of_kalibr_is_read() {
    let text = "cam0:\n  T_cam_imu:\n  - [0.0, 1.0, 0.0, 0.1]\n  - [-1.0, 0.0, 0.0, 0.2]\n  - [0.0, 0.0, 1.0, 0.3]\n  - [0.0, 0.0, 0.0, 1.0]\n  \
                cam_overlaps: [1]\n  camera_model: pinhole\n  distortion_coeffs: [0.1, 0.2, 0.3, 0.4]\n  distortion_model: equidistant\n  \
                intrinsics: [500.0, 501.0, 320.0, 240.0]\n  resolution: [640, 480]\n  rostopic: /cam0/image_raw\n  timeshift_cam_imu: 0.0\n\
                cam1:\n  camera_model: pinhole\n  distortion_coeffs: [0, 0, 0, 0]\n  distortion_model: none\n  intrinsics: [500, 501, 320, 240]\n  resolution: [640, 480]\n";
    let file = read_as("camchain.yaml", text).unwrap();
    let camera = file.camera("cam0", None).unwrap().unwrap();
    assert_eq!((camera.width(), camera.model().name()), (640, "equidistant"));
    assert_eq!(file.camera("cam1", None).unwrap().unwrap().model(), &Model::Pinhole);
    let camera_from_body = file.body_from_camera("cam0").unwrap().inverse();
    assert!((camera_from_body.translation() - nalgebra::Vector3::new(0.1, 0.2, 0.3)).norm() < 1e-12);
}

#[test]
fn what_cannot_be_a_camera_is_refused_when_it_is_read() {
    let says = |name, text: &str, expected: &str| {
        let error = read_as(name, text).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains(name), "{error}");
    };
    says("c.toml", "[cam0]\nintrinsics = [-458, 457, 367, 248]\n", "focal length fx = -458 is not positive");
    says("c.toml", "[cam0]\nmodel = 'fov'\n", "unknown camera model `fov`");
    says("c.toml", "[cam0]\nmodel = 'radtan'\ndistortion = [1]\n", "takes 4 or 5");
    says("c.toml", "[cam0]\nresolution = [0, 480]\n", "0x480 is empty");
    says("c.toml", "[cam0]\nintrinsics = [nan, 457, 367, 248]\n", "not finite");
    says("c.toml", "[cam0]\nintrinsic = [458, 457, 367, 248]\n", "unknown field `intrinsic`");
    says("c.toml", "[cam0]\n", "empty");
    says("c.toml", "# nothing\n", "says nothing");
    says("c.toml", "offset = 1\n", "`offset` is not known");
    says("c.toml", "time_offset_s = 'x'\n", "no number of seconds");
    says("c.toml", "[cam0]\nbody_from_camera = [1, 0]\n", "has 2 numbers");
    says(
        "c.yaml",
        "cam0: {camera_model: omni, intrinsics: [1, 2, 3, 4, 5]}\n",
        "unknown camera_model `omni`",
    );
    says("c.yaml", "cam0: {camera_model: pinhole, intrinsics: [1, 2, 3, 4, 5]}\n", "not 5");
    says("c.yaml", "cam0: {distortion_model: fov, distortion_coeffs: [1]}\n", "unknown camera model `fov`");
    says("c.yaml", "cam0: {intrinsics: [458, -1, 367, 248]}\n", "focal length fy = -1");
    says("c.yaml", "just text\n", "is not the YAML expected");
    says("c.yaml", "\n", "the file is empty");
}

proptest! {
    #[test]
    fn a_calibration_comes_back_as_it_was(
        f in 1.0..2000.0_f64, c in -100.0..2000.0_f64, k in -1.0..1.0_f64, offset in -5_000_000_000_i64..5_000_000_000,
        angle in -3.0..3.0_f64, name in "[a-z/ .0-9]{1,8}",
    ) {
        let model = Model::from_name("radtan", &[k, k / 3.0, 1e-7 * k, 0.0]).unwrap();
        let camera = Camera::new(752, 480, [f, f + 0.1, c, c / 7.0], model).unwrap();
        let rotation = nalgebra::UnitQuaternion::from_scaled_axis(nalgebra::Vector3::new(angle, 0.2, -angle));
        let body_from_camera = BodyFromCamera::from_parts(nalgebra::Vector3::new(k, f, c), rotation);
        let mut file = CalibrationFile::new();
        file.insert(name.clone(), CameraOverride::of(&camera, Some(body_from_camera)));
        file.time_offset = Some(Span::from_nanos(offset));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.toml");
        file.write(&path, Overwrite::Refuse).unwrap();
        let again = CalibrationFile::read(&path).unwrap();
        prop_assert_eq!(again.camera(&name, None).unwrap(), Some(camera));
        prop_assert_eq!(again.time_offset, file.time_offset);
        let moved = again.body_from_camera(&name).unwrap().inverse() * body_from_camera;
        prop_assert!(moved.translation().norm() < 1e-9 && vice_core::frames::rotation_angle_rad(&moved.rotation()) < 1e-9);
        prop_assert!(file.write(&path, Overwrite::Refuse).is_err());
    }
}
