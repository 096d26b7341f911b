//! Cameras against OpenCV.

use nalgebra::Point3;
use vice_core::camera::{Camera, Model, Pixel};

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
