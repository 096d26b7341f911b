//! Cameras against OpenCV, and wide lenses against their papers' formulas in 40 digits.

use nalgebra::Point3;
use vice_core::camera::{Camera, Model, Pixel};
use vice_files::calibration::CalibrationFile;

#[test]
fn cameras_agree_with_opencv() {
    let Some(oracle) = vice_tests::shared_json("oracle/camera_models.json") else { return };
    let cases = oracle["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 5);
    for case in cases {
        let name = case["name"].as_str().unwrap();
        let numbers = |v: &serde_json::Value| -> Vec<f64> {
            v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
        };
        let k: [f64; 4] = numbers(&case["fx_fy_cx_cy"]).try_into().unwrap();
        let model = Model::from_name(case["model"].as_str().unwrap(), &numbers(&case["distortion"])).unwrap();
        let camera = Camera::new(1024, 768, k, model).unwrap();
        let points = case["points_camera_m"].as_array().unwrap();
        let pixels = case["pixels"].as_array().unwrap();
        assert!(points.len() >= 40 && points.len() == pixels.len());
        for (point, pixel) in points.iter().zip(pixels) {
            let (p, px) = (numbers(point), numbers(pixel));
            let point = Point3::new(p[0], p[1], p[2]);
            let got = camera.project(&point).unwrap();
            assert!(
                got.distance_px(Pixel::new(px[0], px[1])) < 1e-6,
                "{name}: {point} gave {got:?}, not {px:?}"
            );
            let ray = camera.unproject(Pixel::new(px[0], px[1])).unwrap();
            let off = (ray - point.coords / point.z).norm();
            assert!(off < 1e-9, "{name}: {px:?} gave a ray {off:e} off");
        }
    }
}

#[test]
fn wide_lenses_agree_with_their_papers() {
    let oracle: serde_json::Value =
        serde_json::from_str(include_str!("../../oracles/camera_models_more.json")).unwrap();
    let numbers = |v: &serde_json::Value| -> Vec<f64> {
        v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let rows =
        |v: &serde_json::Value| -> Vec<Vec<f64>> { v.as_array().unwrap().iter().map(numbers).collect() };
    let cases = oracle["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 11);
    for case in cases {
        let name = case["name"].as_str().unwrap();
        let k: [f64; 4] = numbers(&case["fx_fy_cx_cy"]).try_into().unwrap();
        let model = Model::from_name(case["model"].as_str().unwrap(), &numbers(&case["distortion"])).unwrap();
        let camera = Camera::new(752, 480, k, model).unwrap();
        let rim = case["rim_rad"].as_f64().unwrap();
        match camera.max_radius() {
            radius if radius.is_finite() => {
                assert!((radius.atan() - rim).abs() < 1e-7, "{name}: {radius} {rim}")
            }
            _ => assert!(rim > 1.57, "{name}: {rim}"),
        }
        let (points, pixels) = (rows(&case["points_camera_m"]), rows(&case["pixels"]));
        assert!(points.len() >= 100 && points.len() == pixels.len());
        for (p, px) in points.iter().zip(&pixels) {
            let got = camera.project(&Point3::new(p[0], p[1], p[2])).unwrap();
            let off = got.distance_px(Pixel::new(px[0], px[1]));
            // Near a pole the pixels are far out, and known to their own rounding.
            let size = px[0].hypot(px[1]).max(1e3);
            assert!(off < 1e-12 * size, "{name}: {p:?} gave {got:?}, not {px:?}");
        }
        let rays = rows(&case["rays_u_v_x_y"]);
        assert!(rays.len() >= 100, "{name}");
        for ray in &rays {
            let px = Pixel::new(ray[0], ray[1]);
            let got = camera.unproject(px).unwrap_or_else(|e| panic!("{name}: {px:?}: {e}"));
            // As an angle between rays: far off the axis the numbers themselves are large.
            let expected = nalgebra::Vector3::new(ray[2], ray[3], 1.0);
            let off = got.cross(&expected).norm() / (got.norm() * expected.norm());
            assert!(off < 1e-12, "{name}: {px:?} gave a ray {off:e} rad off");
            let back = camera.project(&Point3::from(expected)).unwrap().distance_px(px);
            assert!(back < 1e-9, "{name}: the ray of {px:?} comes back {back:e} px off");
        }
        for px in rows(&case["pixels_without_ray"]) {
            assert!(camera.unproject(Pixel::new(px[0], px[1])).is_err(), "{name}: {px:?}");
        }
    }
}

/// COLMAP's (0, 0) is the corner of the top left pixel.
#[test]
fn cameras_that_colmap_wrote_project_as_it_does() {
    let oracle: serde_json::Value =
        serde_json::from_str(include_str!("../../oracles/colmap_cameras.json")).unwrap();
    let numbers = |v: &serde_json::Value| -> Vec<f64> {
        v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let points: Vec<Vec<f64>> = oracle["points_camera_m"].as_array().unwrap().iter().map(numbers).collect();
    let cases = oracle["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 13);
    for case in cases {
        let model = case["model"].as_str().unwrap();
        let text = case["cameras_bin"].as_str().unwrap();
        let bytes: Vec<u8> =
            (0..text.len()).step_by(2).map(|i| u8::from_str_radix(&text[i..i + 2], 16).unwrap()).collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cameras.bin");
        std::fs::write(&path, bytes).unwrap();
        let file = CalibrationFile::read(&path).unwrap().for_camera("cam0", &["cam0".to_string()]).unwrap();
        let camera = file.camera("cam0", None).unwrap().unwrap();
        assert_eq!((camera.width(), camera.height()), (640, 480), "{model}");
        for (point, pixel) in points.iter().zip(case["pixels_colmap"].as_array().unwrap()) {
            let px = numbers(pixel);
            let got = camera.project(&Point3::new(point[0], point[1], point[2])).unwrap();
            let off = got.distance_px(Pixel::new(px[0] - 0.5, px[1] - 0.5));
            assert!(off < 1e-9, "{model}: {point:?} is {off:e} px off");
        }
    }
}
