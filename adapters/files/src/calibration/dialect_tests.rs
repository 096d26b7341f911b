//! One camera in each dialect that can say it.

use nalgebra::{UnitQuaternion, Vector3};

use vice_core::frames::{Camera as CameraFrame, Rigid};

use super::*;

fn read_as(name: &str, content: &[u8]) -> DataResult<CalibrationFile> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, content).unwrap();
    CalibrationFile::read(&path)
}

fn place() -> BodyFromCamera {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -1.1, 1.7));
    BodyFromCamera::from_parts(Vector3::new(0.11, -0.052, 0.33), rotation)
}

/// Rows of a matrix, as YAML has them.
fn rows(m: &[f64; 16]) -> String {
    let row = |r: &[f64]| format!("[{}]", r.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", "));
    format!("[{}]", m.chunks(4).map(row).collect::<Vec<_>>().join(", "))
}

/// `!!opencv-matrix` of four rows.
fn opencv(m: &[f64; 16]) -> String {
    let numbers: Vec<String> = m.iter().map(|v| format!("{v:?}")).collect();
    format!("!!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: f\n   data: [{}]\n", numbers.join(", "))
}

fn colmap_bytes(kind: i32, parameters: &[f64]) -> Vec<u8> {
    let mut bytes = 1_u64.to_le_bytes().to_vec();
    bytes.extend(1_u32.to_le_bytes());
    bytes.extend(kind.to_le_bytes());
    bytes.extend(640_u64.to_le_bytes());
    bytes.extend(480_u64.to_le_bytes());
    parameters.iter().for_each(|p| bytes.extend(p.to_le_bytes()));
    bytes
}

struct Case {
    model: &'static str,
    coefficients: Vec<f64>,
    /// Files that say the lens, and whether they say the place in the body as well.
    files: Vec<(&'static str, Vec<u8>, bool)>,
}

#[expect(clippy::too_many_lines, reason = "a list of texts")]
fn cases() -> Vec<Case> {
    let body_from_camera = place().to_row_major();
    let camera_from_body = place().inverse().to_row_major();
    let (t, q) = (place().translation(), place().rotation());
    let kalibr = |lens: &str| {
        format!(
            "cam0:\n  {lens}\n  resolution: [640, 480]\n  T_cam_imu: {}\n  rostopic: /a\n",
            rows(&camera_from_body)
        )
        .into_bytes()
    };
    let openvins = |lens: &str| {
        format!(
            "%YAML:1.0\ncam0:\n  {lens}\n  resolution: [640, 480]\n  T_imu_cam: {}\n  rostopic: /a\n",
            rows(&body_from_camera)
        )
        .into_bytes()
    };
    let basalt = |kind: &str, lens: &str| {
        format!(
            "{{\n\t\"value0\": {{\n\"T_imu_cam\": [{{\"px\": {:?}, \"py\": {:?}, \"pz\": {:?}, \"qx\": {:?}, \"qy\": {:?}, \"qz\": {:?}, \"qw\": {:?}}}],\n\
             \"intrinsics\": [{{\"camera_type\": \"{kind}\", \"intrinsics\": {{\"fx\": 500.0, \"fy\": 501.0, \"cx\": 320.0, \"cy\": 240.0{lens}}}}}],\n\
             \"resolution\": [[640, 480]], \"imu_update_rate\": 200.0, \"cam_time_offset_ns\": 0, \"vignette\": []\n}}\n}}\n",
            t.x, t.y, t.z, q.i, q.j, q.k, q.w
        )
        .into_bytes()
    };
    let orb = |prefix: &str, kind: &str, key: &str, lens: &[(&str, f64)]| {
        let lens: String = lens.iter().map(|(k, v)| format!("{prefix}.{k}: {v:?}\n")).collect();
        format!(
            "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"{kind}\"\n{prefix}.fx: 500.0\n{prefix}.fy: 501.0\n{prefix}.cx: 320.0\n\
             {prefix}.cy: 240.0\n{lens}Camera.width: 640\nCamera.height: 480\nCamera.newWidth: 600\nCamera.newHeight: 350\nCamera.fps: 20\n\
             {key}: {}ORBextractor.nFeatures: 1000\n",
            opencv(&body_from_camera)
        )
        .into_bytes()
    };
    let vins = |kind: &str, parts: &str| {
        format!(
            "%YAML:1.0\nmodel_type: {kind}\ncamera_name: camera\nimage_width: 640\nimage_height: 480\n{parts}body_T_cam0: {}",
            opencv(&body_from_camera)
        )
        .into_bytes()
    };
    let toml = |model: &str, d: &[f64]| {
        format!(
            "[cam0]\nmodel = '{model}'\nresolution = [640, 480]\nintrinsics = [500.0, 501.0, 320.0, 240.0]\ndistortion = {d:?}\nbody_from_camera = {body_from_camera:?}\n"
        )
        .into_bytes()
    };
    let colmap = |row: &str| {
        format!("# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 {row}\n").into_bytes()
    };
    let k = "intrinsics: [500.0, 501.0, 320.0, 240.0]";
    let (radtan, angles) = ([-0.28, 0.07, 2e-4, -3e-4], [0.003, -0.002, 0.004, -0.001]);
    let rational = [0.1, -0.2, 0.001, 0.002, 0.03, 0.3, 0.2, 0.1];
    vec![
        Case {
            model: "radtan",
            coefficients: radtan.to_vec(),
            files: vec![
                ("a.toml", toml("radtan", &radtan), true),
                ("kalibr.yaml", kalibr(&format!("camera_model: pinhole\n  distortion_model: radtan\n  distortion_coeffs: {radtan:?}\n  {k}")), true),
                ("openvins.yaml", openvins(&format!("camera_model: pinhole\n  distortion_model: radtan\n  distortion_coeffs: {radtan:?}\n  {k}")), true),
                ("basalt.json", basalt("pinhole-radtan8", ", \"k1\": -0.28, \"k2\": 0.07, \"p1\": 2e-4, \"p2\": -3e-4, \"k3\": 0, \"k4\": 0, \"k5\": 0, \"k6\": 0"), true),
                ("orb2.yaml", orb("Camera", "PinHole", "Tbc", &[("k1", -0.28), ("k2", 0.07), ("p1", 2e-4), ("p2", -3e-4)]), true),
                ("orb3.yaml", orb("Camera1", "PinHole", "IMU.T_b_c1", &[("k1", -0.28), ("k2", 0.07), ("p1", 2e-4), ("p2", -3e-4)]), true),
                (
                    "vins.yaml",
                    vins("PINHOLE", "distortion_parameters:\n   k1: -0.28\n   k2: 0.07\n   p1: 2.0e-4\n   p2: -3.0e-4\nprojection_parameters:\n   fx: 500.0\n   fy: 501.0\n   cx: 320.0\n   cy: 240.0\n"),
                    true,
                ),
                ("cameras.txt", colmap("OPENCV 640 480 500 501 320.5 240.5 -0.28 0.07 2e-4 -3e-4"), false),
                ("cameras.bin", colmap_bytes(4, &[500.0, 501.0, 320.5, 240.5, -0.28, 0.07, 2e-4, -3e-4]), false),
            ],
        },
        Case {
            model: "rational",
            coefficients: rational.to_vec(),
            files: vec![
                ("basalt.json", basalt("pinhole-radtan8", ", \"k1\": 0.1, \"k2\": -0.2, \"p1\": 0.001, \"p2\": 0.002, \"k3\": 0.03, \"k4\": 0.3, \"k5\": 0.2, \"k6\": 0.1"), true),
                ("cameras.txt", colmap("FULL_OPENCV 640 480 500 501 320.5 240.5 0.1 -0.2 0.001 0.002 0.03 0.3 0.2 0.1"), false),
                ("camera_info.yaml", "image_width: 640\nimage_height: 480\ndistortion_model: rational_polynomial\ncamera_matrix: {rows: 3, cols: 3, data: [500, 0, 320, 0, 501, 240, 0, 0, 1]}\ndistortion_coefficients: {rows: 1, cols: 8, data: [0.1, -0.2, 0.001, 0.002, 0.03, 0.3, 0.2, 0.1]}\n".into(), false),
            ],
        },
        Case {
            model: "equidistant",
            coefficients: angles.to_vec(),
            files: vec![
                ("a.toml", toml("equidistant", &angles), true),
                ("kalibr.yaml", kalibr(&format!("camera_model: pinhole\n  distortion_model: equidistant\n  distortion_coeffs: {angles:?}\n  {k}")), true),
                ("equi.yaml", kalibr(&format!("camera_model: pinhole\n  distortion_model: equi\n  distortion_coeffs: {angles:?}\n  {k}")), true),
                ("basalt.json", basalt("kb4", ", \"k1\": 0.003, \"k2\": -0.002, \"k3\": 0.004, \"k4\": -0.001"), true),
                ("orb3.yaml", orb("Camera1", "KannalaBrandt8", "IMU.T_b_c1", &[("k1", 0.003), ("k2", -0.002), ("k3", 0.004), ("k4", -0.001)]), true),
                ("orb.yaml", orb("Camera", "KannalaBrandt8", "Tbc", &[("k1", 0.003), ("k2", -0.002), ("k3", 0.004), ("k4", -0.001)]), true),
                (
                    "vins.yaml",
                    vins("KANNALA_BRANDT", "projection_parameters:\n   k2: 0.003\n   k3: -0.002\n   k4: 0.004\n   k5: -0.001\n   mu: 500.0\n   mv: 501.0\n   u0: 320.0\n   v0: 240.0\n"),
                    true,
                ),
                ("cameras.txt", colmap("OPENCV_FISHEYE 640 480 500 501 320.5 240.5 0.003 -0.002 0.004 -0.001"), false),
            ],
        },
        Case {
            model: "ds",
            coefficients: vec![-0.2, 0.6],
            files: vec![
                ("a.toml", toml("ds", &[-0.2, 0.6]), true),
                ("kalibr.yaml", kalibr("camera_model: ds\n  distortion_model: none\n  distortion_coeffs: []\n  intrinsics: [-0.2, 0.6, 500.0, 501.0, 320.0, 240.0]"), true),
                ("basalt.json", basalt("ds", ", \"xi\": -0.2, \"alpha\": 0.6"), true),
            ],
        },
        Case {
            model: "eucm",
            coefficients: vec![0.6, 1.1],
            files: vec![
                ("a.toml", toml("eucm", &[0.6, 1.1]), true),
                ("kalibr.yaml", kalibr("camera_model: eucm\n  distortion_model: none\n  distortion_coeffs: []\n  intrinsics: [0.6, 1.1, 500.0, 501.0, 320.0, 240.0]"), true),
                ("basalt.json", basalt("eucm", ", \"alpha\": 0.6, \"beta\": 1.1"), true),
            ],
        },
        Case {
            model: "omni",
            coefficients: vec![1.4, -0.2, 0.05, 2e-4, -3e-4],
            files: vec![
                ("a.toml", toml("omni", &[1.4, -0.2, 0.05, 2e-4, -3e-4]), true),
                ("kalibr.yaml", kalibr("camera_model: omni\n  distortion_model: radtan\n  distortion_coeffs: [-0.2, 0.05, 2.0e-4, -3.0e-4]\n  intrinsics: [1.4, 500.0, 501.0, 320.0, 240.0]"), true),
                (
                    "vins.yaml",
                    vins("MEI", "mirror_parameters:\n   xi: 1.4\ndistortion_parameters:\n   k1: -0.2\n   k2: 0.05\n   p1: 2.0e-4\n   p2: -3.0e-4\nprojection_parameters:\n   gamma1: 500.0\n   gamma2: 501.0\n   u0: 320.0\n   v0: 240.0\n"),
                    true,
                ),
            ],
        },
        Case {
            model: "fov",
            coefficients: vec![0.9],
            files: vec![
                ("a.toml", toml("fov", &[0.9]), true),
                ("kalibr.yaml", kalibr(&format!("camera_model: pinhole\n  distortion_model: fov\n  distortion_coeffs: [0.9]\n  {k}")), true),
                ("basalt.json", basalt("fov", ", \"w\": 0.9"), true),
                ("cameras.bin", colmap_bytes(7, &[500.0, 501.0, 320.5, 240.5, 0.9]), false),
            ],
        },
    ]
}

/// The coefficients as long as the longer of the two lists.
fn padded(model: &Model, length: usize) -> Vec<f64> {
    let mut all = model.coefficients();
    all.resize(length.max(all.len()), 0.0);
    all
}

#[test]
fn every_dialect_gives_the_same_camera() {
    for Case { model, coefficients, files } in cases() {
        let expected = Model::from_name(model, &coefficients).unwrap();
        for (name, content, placed) in files {
            let file = read_as(name, &content).unwrap_or_else(|e| panic!("{model}: {e}"));
            let said: Vec<String> = file.suspicions().iter().map(Suspicion::line).collect();
            assert!(said.is_empty(), "{model} {name}: {said:?}");
            let file = file.for_camera("left", &["left".to_string()]).unwrap();
            let camera = file.camera("left", None).unwrap().unwrap();
            assert_eq!((camera.width(), camera.height()), (640, 480), "{model} {name}");
            let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off(&camera.fx_fy_cx_cy(), &[500.0, 501.0, 320.0, 240.0]) < 1e-12, "{model} {name}");
            // Basalt's radtan8 with zeros is the rational model with zeros, which is the same lens.
            let [got, wanted] = [camera.model(), &expected].map(|m| padded(m, 8));
            assert!(off(&got, &wanted) < 1e-12, "{model} {name}: {got:?}");
            let same = camera.model().name() == model || (model, name) == ("radtan", "basalt.json");
            assert!(same, "{model} {name}: {}", camera.model().name());
            let found = file.body_from_camera("left");
            assert_eq!(found.is_some(), placed, "{model} {name}");
            if let Some(found) = found {
                let moved = found.inverse() * place();
                let turned = vice_core::frames::rotation_angle_rad(&moved.rotation());
                assert!(moved.translation().norm() < 1e-12 && turned < 1e-12, "{model} {name}: {turned:e}");
            }
        }
    }
}

#[test]
fn the_models_of_colmap_with_fewer_parameters_are_those_with_zeros() {
    let read = |row: &str| {
        let file = read_as("cameras.txt", format!("7 {row}\n").as_bytes())?;
        let file = file.for_camera("a", &["a".to_string()])?;
        Ok::<_, DataError>(file.camera("a", None)?.unwrap())
    };
    for (row, model, coefficients) in [
        ("SIMPLE_PINHOLE 640 480 500 320.5 240.5", "pinhole", &[] as &[f64]),
        ("PINHOLE 640 480 500 500 320.5 240.5", "pinhole", &[]),
        ("SIMPLE_RADIAL 640 480 500 320.5 240.5 0.1", "radtan", &[0.1, 0.0, 0.0, 0.0]),
        ("RADIAL 640 480 500 320.5 240.5 0.1 0.2", "radtan", &[0.1, 0.2, 0.0, 0.0]),
        ("SIMPLE_RADIAL_FISHEYE 640 480 500 320.5 240.5 0.1", "equidistant", &[0.1, 0.0, 0.0, 0.0]),
        ("RADIAL_FISHEYE 640 480 500 320.5 240.5 0.1 0.2", "equidistant", &[0.1, 0.2, 0.0, 0.0]),
    ] {
        let camera = read(row).unwrap();
        assert_eq!(camera.model(), &Model::from_name(model, coefficients).unwrap(), "{row}");
        assert_eq!(camera.fx_fy_cx_cy(), [500.0, 500.0, 320.0, 240.0], "{row}");
    }
    for (row, expected) in [
        (
            "THIN_PRISM_FISHEYE 640 480 1 2 3 4 5 6 7 8 9 10 11 12",
            "the camera model THIN_PRISM_FISHEYE of COLMAP is not read",
        ),
        ("PINHOLE 640 480 500 500 320.5", "PINHOLE has 4 parameters, not 3"),
        ("PINHOLE 640 480 500 500 x 240", "the parameter `x` is no number"),
        ("PINHOLE 640 480 -500 500 320 240", "focal length fx = -500"),
    ] {
        let error = read(row).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains("cameras.txt"), "{error}");
    }
    let two = "1 PINHOLE 640 480 1 1 0 0\n1 PINHOLE 640 480 1 1 0 0\n";
    let error = read_as("cameras.txt", two.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("cameras.txt:2: camera 1 is in the file twice"), "{error}");
}

#[test]
fn a_binary_list_of_cameras_that_is_none_is_refused() {
    let whole = colmap_bytes(1, &[500.0, 501.0, 320.5, 240.5]);
    assert!(read_as("cameras.bin", &whole).is_ok());
    for length in 1..whole.len() {
        assert!(read_as("cameras.bin", &whole[..length]).is_err(), "{length} bytes");
    }
    let mut more = whole.clone();
    more.push(0);
    let error = read_as("cameras.bin", &more).unwrap_err().to_string();
    assert!(error.contains("bytes are left behind the last camera"), "{error}");
    let error = read_as("cameras.bin", &colmap_bytes(99, &[])).unwrap_err().to_string();
    assert!(error.contains("the camera model 99 of COLMAP is not read"), "{error}");
    let error = read_as("cameras.bin", &[0xff; 64]).unwrap_err().to_string();
    assert!(error.contains("more than the file can hold"), "{error}");
}

#[test]
fn a_lens_that_two_keys_make_and_no_model_has_is_refused() {
    for (text, expected) in [
        (
            "cam0: {camera_model: omni, intrinsics: [500, 501, 320, 240]}\n",
            "intrinsics are xi, fx, fy, cx, cy: 5 numbers, not 4",
        ),
        (
            "cam0: {camera_model: ds, intrinsics: [0.1, 0.5, 1, 1, 0, 0], distortion_model: radtan, distortion_coeffs: [0.1, 0, 0, 0]}\n",
            "camera_model ds with radtan distortion is none",
        ),
        (
            "cam0: {camera_model: omni, intrinsics: [1.1, 1, 1, 0, 0], distortion_model: equidistant, distortion_coeffs: [0.1, 0, 0, 0]}\n",
            "camera_model omni with equidistant distortion",
        ),
        (
            "cam0: {camera_model: ds, intrinsics: [0.1, 1.5, 1, 1, 0, 0]}\n",
            "alpha = 1.5 of model ds is not from 0 to 1",
        ),
        ("model_type: MEI\nmirror_parameters: {alpha: 1.0}\n", "the key `alpha` is about geometry"),
        ("Camera.type: Rectified\nCamera.fx: 1\n", "is of images that were rectified"),
        (
            "{\"value0\": {\"intrinsics\": [{\"camera_type\": \"kb9\", \"intrinsics\": {}}]}}",
            "unknown camera_type `kb9`",
        ),
        (
            "{\"value0\": {\"intrinsics\": [{\"camera_type\": \"ds\", \"intrinsics\": {\"fx\": 1}}]}}",
            "camera_type ds has no xi",
        ),
        (
            "{\"value0\": {\"T_imu_cam\": [], \"intrinsics\": [{\"camera_type\": \"ds\", \"intrinsics\": {}}]}}",
            "intrinsics has 1 cameras and T_imu_cam 0",
        ),
        ("{\"value0\": {\"intrinsics\": [\n", "is not the JSON expected"),
    ] {
        let error = read_as("c.yaml", text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let text = "{\"value0\": {\"cam_time_offset_ns\": 2000000, \"more\": 1, \"intrinsics\": [{\"camera_type\": \"ucm\", \"intrinsics\": {\"fx\": 1, \"fy\": 1, \"cx\": 0, \"cy\": 0, \"alpha\": 0.4}}]}}";
    let file = read_as("b.json", text.as_bytes()).unwrap();
    assert_eq!(file.time_offset_of("cam0"), Some(Span::from_millis(-2)));
    assert_eq!(file.cameras()["cam0"].distortion, Some(vec![0.4, 1.0]));
    assert!(file.suspicions().iter().any(|s| s.line().contains("more")));
}

#[test]
fn the_second_camera_of_orb_slam_is_placed_by_the_first() {
    let first = place();
    let first_from_second: Rigid<CameraFrame, CameraFrame> = Rigid::from_parts(
        Vector3::new(0.11, 0.002, -0.001),
        UnitQuaternion::from_scaled_axis([0.01, -0.02, 0.003].into()),
    );
    let lens = |prefix: &str, fx: f64| {
        format!(
            "{prefix}.fx: {fx:?}\n{prefix}.fy: 501.0\n{prefix}.cx: 320.0\n{prefix}.cy: 240.0\n{prefix}.k1: 0.01\n{prefix}.k2: 0.0\n{prefix}.k3: 0.0\n{prefix}.k4: 0.0\n"
        )
    };
    let text = format!(
        "%YAML:1.0\nCamera.type: \"KannalaBrandt8\"\n{}{}Stereo.T_c1_c2: {}Stereo.ThDepth: 60.0\nCamera.width: 640\nCamera.height: 480\nIMU.T_b_c1: {}",
        lens("Camera1", 500.0),
        lens("Camera2", 510.0),
        opencv(&first_from_second.to_row_major()),
        opencv(&first.to_row_major()),
    );
    let file = read_as("stereo.yaml", text.as_bytes()).unwrap();
    for (name, fx, expected) in [("cam0", 500.0, first), ("cam1", 510.0, first * first_from_second)] {
        let camera = file.camera(name, None).unwrap().unwrap();
        assert_eq!(
            (camera.fx_fy_cx_cy()[0], camera.width(), camera.model().name()),
            (fx, 640, "equidistant")
        );
        let off = file.body_from_camera(name).unwrap().inverse() * expected;
        assert!(off.translation().norm() < 1e-12, "{name}");
        assert!(vice_core::frames::rotation_angle_rad(&off.rotation()) < 1e-12, "{name}");
    }
    // Without the place of the second nobody guesses it.
    let without: String = text.split("Stereo.T_c1_c2").next().unwrap().to_string();
    let file = read_as("stereo.yaml", format!("{without}Camera.width: 640\nCamera.height: 480\n").as_bytes())
        .unwrap();
    assert!(file.body_from_camera("cam1").is_none());
    assert_eq!(file.cameras().len(), 2);
}
