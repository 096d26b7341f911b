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
    says("c.toml", "[cam0]\nmodel = 'fishbowl'\n", "unknown camera model `fishbowl`");
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
        "cam0: {camera_model: fishbowl, intrinsics: [1, 2, 3, 4, 5]}\n",
        "unknown camera_model `fishbowl`",
    );
    says("c.yaml", "cam0: {camera_model: pinhole, intrinsics: [1, 2, 3, 4, 5]}\n", "not 5");
    says("c.yaml", "cam0: {distortion_model: fish, distortion_coeffs: [1]}\n", "unknown camera model `fish`");
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

const ROWS: &str =
    "[[0.0, -1.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.05], [0.0, 0.0, 1.0, 0.2], [0.0, 0.0, 0.0, 1.0]]";
/// The inverse of [`ROWS`].
const INVERSE: &str =
    "[[0.0, 1.0, 0.0, -0.05], [-1.0, 0.0, 0.0, 0.1], [0.0, 0.0, 1.0, -0.2], [0.0, 0.0, 0.0, 1.0]]";
const LENS: &str = "intrinsics: [500.0, 501.0, 320.0, 240.0], resolution: [640, 480], distortion_model: radtan, distortion_coeffs: [0.1, 0.2, 0.003, 0.004]";

fn said(file: &CalibrationFile) -> Vec<String> {
    file.suspicions().iter().map(|s| s.line()).collect()
}

#[test]
fn extrinsics_are_read_by_the_direction_of_their_key() {
    for (key, matrix) in [
        ("T_imu_cam", ROWS),
        ("T_BS", ROWS),
        ("body_T_cam0", ROWS),
        ("T_cam_imu", INVERSE),
        ("T_SB", INVERSE),
    ] {
        let file = read_as("c.yaml", &format!("cam0: {{{key}: {matrix}, {LENS}}}\n")).unwrap();
        let found = file.body_from_camera("cam0").unwrap();
        let expected = nalgebra::Vector3::new(0.1, 0.05, 0.2);
        assert!((found.translation() - expected).norm() < 1e-12, "{key}: {}", found.translation());
    }
    // Both ways, as long as they agree.
    read_as("c.yaml", &format!("cam0: {{T_imu_cam: {ROWS}, T_cam_imu: {INVERSE}, {LENS}}}\n")).unwrap();
    let error =
        read_as("c.yaml", &format!("cam0: {{T_imu_cam: {ROWS}, T_cam_imu: {ROWS}, {LENS}}}\n")).unwrap_err();
    assert!(error.to_string().contains("T_cam_imu and T_imu_cam contradict each other"), "{error}");
    // A chain from camera to camera.
    let step = "[[1.0, 0.0, 0.0, -0.11], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]";
    let chain = |own: &str| {
        read_as(
            "c.yaml",
            &format!("cam0: {{T_imu_cam: {ROWS}, {LENS}}}\ncam1: {{T_cn_cnm1: {step}, {own}{LENS}}}\n"),
        )
    };
    let second = chain("").unwrap().body_from_camera("cam1").unwrap();
    assert!(
        (second.translation() - nalgebra::Vector3::new(0.1, 0.16, 0.2)).norm() < 1e-12,
        "{}",
        second.translation()
    );
    let error = chain(&format!("T_imu_cam: {ROWS}, ")).unwrap_err().to_string();
    assert!(error.contains("[cam1]: T_cn_cnm1 after cam0") && error.contains("0.110 m"), "{error}");
    let file =
        read_as("c.yaml", &format!("cam0: {{{LENS}}}\ncam1: {{T_cn_cnm1: {step}, {LENS}}}\n")).unwrap();
    assert_eq!(file.body_from_camera("cam1"), None);
    assert!(said(&file)[0].contains("T_cn_cnm1 of cam1"), "{:?}", said(&file));
}

#[test]
fn files_of_every_tool_give_the_same_camera() {
    let opencv = |root: &str| {
        format!(
            "%YAML:1.0\n---\n{root}calibration_time: \"now\"\nimage_width: 640\nimage_height: 480\nboard_width: 9\ncamera_matrix: !!opencv-matrix\n   \
         rows: 3\n   cols: 3\n   dt: d\n   data: [ 500., 0., 320., 0., 501., 240., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   \
         rows: 5\n   cols: 1\n   dt: d\n   data: [ 0.1, 0.2, 0.003, 0.004, 0. ]\navg_reprojection_error: 0.2\n"
        )
    };
    let ros = "image_width: 640\nimage_height: 480\ncamera_name: narrow\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [500, 0, 320, 0, 501, 240, 0, 0, 1]\n\
               distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 8\n  data: [0.1, 0.2, 0.003, 0.004, 0, 0, 0, 0]\n\
               rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\nprojection_matrix:\n  rows: 3\n  cols: 4\n  \
               data: [480, 0, 320, 0, 0, 480, 240, 0, 0, 0, 1, 0]\n";
    let xml = "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_Width>640</image_Width>\n<image_Height>480</image_Height>\n\
               <Camera_Matrix type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt><data>\n 500. 0. 320. 0. 501. 240. 0. 0. 1.</data></Camera_Matrix>\n\
               <Distortion_Coefficients type_id=\"opencv-matrix\"><rows>5</rows><cols>1</cols><dt>d</dt><data>0.1 0.2 0.003 0.004 0.</data></Distortion_Coefficients>\n\
               <square_Size>25.</square_Size>\n</opencv_storage>\n";
    let orb = "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.fx: 500\nCamera.fy: 501\nCamera.cx: 320\nCamera.cy: 240\nCamera.k1: 0.1\nCamera.k2: 0.2\nCamera.p1: 0.003\n\
               Camera.p2: 0.004\nCamera.width: 640\nCamera.height: 480\nCamera.fps: 20\nORBextractor.nFeatures: 1000\n";
    let vins = "%YAML:1.0\nmodel_type: PINHOLE\ncamera_name: camera\nimage_width: 640\nimage_height: 480\ndistortion_parameters:\n   k1: 0.1\n   k2: 0.2\n   p1: 0.003\n   p2: 0.004\n\
                projection_parameters:\n   fx: 500\n   fy: 501\n   cx: 320\n   cy: 240\n";
    let sensor = "sensor_type: camera\ncomment: x\nresolution: [640, 480]\nintrinsics: [500, 501, 320, 240]\ndistortion_model: radial-tangential\ndistortion_coefficients: [0.1, 0.2, 0.003, 0.004]\n";
    let expected = Camera::new(
        640,
        480,
        [500.0, 501.0, 320.0, 240.0],
        Model::from_name("radtan", &[0.1, 0.2, 0.003, 0.004]).unwrap(),
    )
    .unwrap();
    for (name, text) in [
        ("kalibr.yaml", format!("cam0: {{{LENS}, cam_overlaps: [1], camera_model: pinhole}}\n")),
        ("kalibr_bom.yaml", format!("\u{feff}%YAML:1.0\n\ncam0: {{{LENS}}}\n")),
        ("opencv.yml", opencv("")),
        ("ros.yaml", ros.to_string()),
        ("opencv.xml", xml.to_string()),
        ("orb.yaml", orb.to_string()),
        ("vins.yaml", vins.to_string()),
        ("sensor.yaml", sensor.to_string()),
    ] {
        let file = read_as(name, &text).unwrap_or_else(|e| panic!("{e}"));
        // One camera in the file and one in the data set, whatever its name.
        let file = file.for_camera("left", &["left".to_string()]).unwrap();
        assert_eq!(file.camera("left", None).unwrap(), Some(expected), "{name}");
        assert!(said(&file).is_empty(), "{name}: {:?}", said(&file));
    }
    let rational = opencv("flags: 16384\n")
        .replace("0.004, 0. ]", "0.004, 0.1, 0.2, 0.3, 0.4 ]")
        .replace("rows: 5", "rows: 8");
    let file = read_as("opencv.yml", &rational).unwrap().for_camera("a", &["a".into()]).unwrap();
    assert_eq!(file.camera("a", None).unwrap().unwrap().model().name(), "rational");
}

#[test]
fn keys_about_geometry_time_and_size_are_never_passed_over() {
    for key in [
        "T_cam_lidar",
        "extrinsics",
        "image_scale",
        "time_offset",
        "rolling_shutter_time",
        "crop_left",
        "cam_rotation",
        "pixel_size",
        "line_delay",
    ] {
        for text in [
            format!("cam0: {{{LENS}, {key}: 0.5}}\n"),
            format!("{LENS}, {key}: 0.5")
                .replace(", ", "\n")
                .replace("[500.0\n501.0\n320.0\n240.0]", "[500, 501, 320, 240]")
                .replace("[640\n480]", "[640, 480]")
                .replace("[0.1\n0.2\n0.003\n0.004]", "[0.1, 0.2, 0.003, 0.004]"),
        ] {
            let error = read_as("c.yaml", &text).unwrap_err().to_string();
            assert!(error.contains(&format!("the key `{key}` is about geometry, time or size")), "{error}");
        }
        // One that says nothing is none.
        read_as("c.yaml", &format!("cam0: {{{LENS}, {key}: 0.0}}\n")).unwrap();
    }
    let file =
        read_as("c.yaml", &format!("cam0: {{{LENS}, gain: 3, exposure: 5}}\ncam1: {{{LENS}, gain: 3}}\n"))
            .unwrap();
    assert_eq!(said(&file).len(), 1);
    assert!(
        said(&file)[0].ends_with("keys that are not known are not used: exposure, gain"),
        "{:?}",
        said(&file)
    );
    for (text, expected) in [
        ("camera_matrix: {data: [500, 3, 320, 0, 501, 240, 0, 0, 1]}\n", "has a skew of 3"),
        ("fx: 500\nfy: 501\ncx: 320\n", "not all are given"),
        ("image_width: 640\nintrinsics: [1, 1, 1, 1]\n", "only one is given"),
        ("intrinsics: [1, 1, 1, 1]\nK: [2, 0, 1, 0, 1, 1, 0, 0, 1]\n", "contradict"),
        ("relative_config_imucam: kalibr.yaml\n", "holds no camera"),
        ("model_type: SCARAMUZZA\npoly_parameters: {p0: 1.0}\n", "unknown model_type `SCARAMUZZA`"),
    ] {
        let error = read_as("c.yaml", text).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_time_shift_is_the_offset_that_it_means() {
    let shift = |a: &str, b: &str| {
        read_as(
            "c.yaml",
            &format!("cam0: {{{LENS}, timeshift_cam_imu: {a}}}\ncam1: {{{LENS}, timeshift_cam_imu: {b}}}\n"),
        )
        .unwrap()
    };
    let file = shift("0.003", "-0.5e-2");
    assert_eq!(file.time_offset_of("cam0"), Some(Span::from_millis(-3)));
    assert_eq!(file.time_offset_of("cam1"), Some(Span::from_millis(5)));
    assert_eq!(file.time_offset_of("cam7"), None);
    assert!(said(&file)[0].contains("--time-offset -0.003000000 would"), "{:?}", said(&file));
    assert_eq!(shift("0.0", "0").time_offset_of("cam0"), None);
    let alone = read_as("c.yaml", "td: 0.01\nfx: 1\nfy: 1\ncx: 0\ncy: 0\n").unwrap();
    assert_eq!(alone.time_offset_of("whatever"), Some(Span::from_millis(-10)));
    let toml = read_as("c.toml", "time_offset_s = 0.02\n").unwrap();
    assert_eq!(toml.time_offset_of("cam0"), Some(Span::from_millis(20)));
}

#[test]
fn the_entry_of_a_camera_is_found_by_name_topic_or_because_it_is_the_only_one() {
    let text = format!(
        "cam0: {{{LENS}, rostopic: /left/image_raw}}\ncam1: {{{LENS}, rostopic: /right/image_raw}}\n"
    )
    .replace("500.0", "400.0");
    let file = read_as("c.yaml", &text).unwrap();
    let two = ["left".to_string(), "right".to_string()];
    assert!(file.for_camera("right", &two).unwrap().cameras().contains_key("right"));
    assert!(file.for_camera("cam1", &two).is_ok());
    let error = file.for_camera("color", &["color".to_string()]).unwrap_err().to_string();
    assert!(error.contains("the file is of cam0, cam1, the camera is color"), "{error}");
    let one = read_as("c.yaml", &format!("cam0: {{{LENS}}}\n")).unwrap();
    assert!(one.for_camera("color", &["color".to_string()]).is_ok());
    assert!(one.for_camera("left", &two).is_err(), "which of the two it is was not said");
    let nameless = read_as("sensor.yaml", "intrinsics: [1, 1, 0, 0]\n").unwrap();
    assert!(nameless.for_camera("left", &two).is_ok());
}
