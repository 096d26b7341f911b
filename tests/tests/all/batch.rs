//! Batches of points against OpenCV, and `vice bench`.

use serde_json::Value;
use vice_core::camera::{Camera, Model};
use vice_tests::{shared_json, vice};

#[test]
fn batches_agree_with_opencv() {
    let Some(oracle) = shared_json("oracle/camera_models.json") else { return };
    let numbers =
        |v: &Value| -> Vec<f64> { v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect() };
    for case in oracle["cases"].as_array().unwrap() {
        let name = case["name"].as_str().unwrap();
        let k: [f64; 4] = numbers(&case["fx_fy_cx_cy"]).try_into().unwrap();
        let model = Model::from_name(case["model"].as_str().unwrap(), &numbers(&case["distortion"])).unwrap();
        let camera = Camera::new(1024, 768, k, model).unwrap();
        let rows = |key: &str| case[key].as_array().unwrap().iter().map(numbers).collect::<Vec<_>>();
        let column = |rows: &[Vec<f64>], k: usize| rows.iter().map(|r| r[k]).collect::<Vec<f64>>();
        let (points, pixels) = (rows("points_camera_m"), rows("pixels"));
        let n = points.len();
        let [x, y, z] = [0, 1, 2].map(|k| column(&points, k));
        let [u, v] = [0, 1].map(|k| column(&pixels, k));
        let (mut a, mut b, mut valid) = (vec![0.0; n], vec![0.0; n], vec![false; n]);
        assert_eq!(camera.project_batch([&x, &y, &z], [&mut a, &mut b], &mut valid), n, "{name}");
        for i in 0..n {
            assert!((a[i] - u[i]).hypot(b[i] - v[i]) < 1e-6, "{name}: {:?}", points[i]);
        }
        assert_eq!(camera.unproject_batch([&u, &v], [&mut a, &mut b], &mut valid), n, "{name}");
        for i in 0..n {
            assert!((a[i] - x[i] / z[i]).hypot(b[i] - y[i] / z[i]) < 1e-9, "{name}: {:?}", pixels[i]);
        }
    }
}

#[test]
fn bench_says_how_fast_and_how_near_the_limit() {
    let run = vice(&["bench", "project", "track", "--points", "2000", "--threads", "2", "--json", "-"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let document: Value = serde_json::from_str(&run.stdout).unwrap();
    let results = document["results"].as_array().unwrap();
    assert_eq!(results.len(), 16, "two kernels, eight models");
    for result in results {
        assert!(["project", "track"].contains(&result["kernel"].as_str().unwrap()));
        assert!(
            ["pinhole", "radtan", "rational", "equidistant", "ds", "eucm", "omni", "fov"]
                .contains(&result["model"].as_str().unwrap())
        );
        assert_eq!((result["points"].as_u64(), result["threads"].as_u64()), (Some(2000), Some(2)));
        assert!(result["points_per_second"].as_f64().unwrap() > 1e4);
        assert!(result["fraction_of_limit"].as_f64().unwrap() > 0.0);
    }
    let table = vice(&["bench", "project", "--model", "radtan", "--points", "1000", "--threads", "1"]);
    assert!(table.stdout.contains("memcpy") && table.stdout.contains("radtan"), "{}", table.stdout);
    assert_eq!(vice(&["bench", "project", "--points", "0"]).code, 2);
    assert_eq!(vice(&["bench", "paint"]).code, 2);
}
