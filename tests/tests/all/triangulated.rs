//! Depth from the labels themselves: against OpenCV and SciPy, and through the program on a real flight.

use serde_json::Value;
use vice_core::camera::{Camera, Model, Pixel};
use vice_core::frames::WorldFromCamera;
use vice_core::triangulate::triangulate;
use vice_tests::{shared, vice};

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn depths_agree_with_opencv_and_scipy() {
    let oracle: Value = serde_json::from_str(include_str!("../../oracles/triangulated.json")).unwrap();
    let cases = oracle["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 27);
    for case in cases {
        let model =
            Model::from_name(case["camera"].as_str().unwrap(), &numbers(&case["distortion"])).unwrap();
        let k: [f64; 4] = numbers(&case["fx_fy_cx_cy"]).try_into().unwrap();
        let camera = Camera::new(752, 480, k, model).unwrap();
        let pose =
            |value: &Value| WorldFromCamera::try_from_row_major(&numbers(value).try_into().unwrap()).unwrap();
        let px = |value: &Value| {
            let px = numbers(value);
            Pixel::new(px[0], px[1])
        };
        let views = case["views"].as_array().unwrap().iter();
        let views = views.map(|view| (pose(&view["world_from_camera"]), px(&view["px"])));
        let found =
            triangulate(&camera, &pose(&case["at_keyframe"]), px(&case["keyframe_px"]), views).unwrap();
        let z_m = case["depth_z_m"].as_f64().unwrap();
        let off = (found.z_m / z_m - 1.0).abs();
        assert!(off < 1e-6, "{off:e}: {found:?}, {z_m} m ({})", case["camera"]);
        let Some(share) = case["sigma_share"].as_f64() else { continue };
        assert!((found.sigma_m / found.z_m / share - 1.0).abs() < 0.03, "{found:?}, {share}");
        assert!((found.left_px - case["left_px"].as_f64().unwrap()).abs() < 1e-4, "{found:?}");
    }
}

/// `vice evaluate` on the flight, with more options.
fn evaluate(more: &[&str]) -> Option<(i32, String, String)> {
    let data = shared("data/euroc_v1_01")?;
    let text = |path: std::path::PathBuf| path.to_str().unwrap().to_string();
    let (labels, estimate) = (text(data.join("labels/floor.csv")), "imu-euler".to_string());
    let mut args = vec!["evaluate".to_string(), text(data), "--labels".to_string(), labels];
    args.extend(["--estimate".to_string(), estimate]);
    args.extend(more.iter().map(ToString::to_string));
    let run = vice(&args);
    Some((run.code, run.stdout, run.stderr))
}

#[test]
fn a_flight_is_scored_with_half_of_its_labels_and_told_what_that_cannot_show() {
    let Some((_, document, error)) = evaluate(&["--depth", "triangulated", "--json", "-"]) else { return };
    let document: Value = serde_json::from_str(&document).unwrap_or_else(|e| panic!("{e}: {error}"));
    let (_, floor, _) = evaluate(&["--depth", "floor", "--json", "-"]).unwrap();
    let floor: Value = serde_json::from_str(&floor).unwrap();
    for (part, floor) in document["pixel"].as_array().unwrap().iter().zip(floor["pixel"].as_array().unwrap())
    {
        assert_eq!((&part["depth"], &part["stream"]), (&Value::from("triangulated"), &floor["stream"]));
        let told = &part["triangulation"];
        assert!(told["rule"].as_str().unwrap().contains("1st, 3rd, 5th"), "{told}");
        assert!(told["cannot_show"].as_str().unwrap().contains("scale"), "{told}");
        let count = |part: &Value| {
            part["scored"].as_u64().unwrap() + part["skipped"].as_array().unwrap().len() as u64
        };
        assert_eq!(count(part) + told["labels_for_depth"].as_u64().unwrap(), count(floor));
        if part["role"] == "reference" {
            // The truth moves as the labels do: its depths are those of the floor.
            let depths = |part: &Value| -> Vec<(String, f64, f64)> {
                let keyframes = part["keyframes"].as_array().unwrap().iter();
                let sigma = |k: &Value| k["triangulated"]["depth_sigma_m"].as_f64().unwrap_or(0.0);
                keyframes
                    .map(|k| {
                        let name = format!("{} {}", k["point"], k["timestamp_ns"]);
                        (name, k["depth_z_m"].as_f64().unwrap(), sigma(k))
                    })
                    .collect()
            };
            let floor = depths(floor);
            let mut seen = 0;
            for (name, z_m, sigma_m) in depths(part) {
                let (_, floor_m, _) = floor.iter().find(|f| f.0 == name).unwrap();
                assert!(
                    (z_m - floor_m).abs() < 0.1 * floor_m + 4.0 * sigma_m,
                    "{name}: {z_m} {sigma_m} {floor_m}"
                );
                seen += 1;
            }
            assert!(seen > 0);
        }
    }
    let (_, table, _) = evaluate(&["--depth", "triangulated"]).unwrap();
    assert!(table.contains("give the depth of") && table.contains("leave no trace here"), "{table}");
}

#[test]
fn it_stands_beside_no_other_depth_and_frames_alone_have_none() {
    let Some((code, _, error)) = evaluate(&["--depth", "floor,triangulated"]) else { return };
    assert!(code == 2 && error.contains("cannot stand beside other depths"), "{error}");
    let (code, _, error) = evaluate(&["--depth", "triangulated", "--depth-check", "on"]).unwrap();
    assert!(code == 2 && error.contains("cannot stand beside other depths"), "{error}");

    let data = shared("data/euroc_v1_01").unwrap();
    let (labels, data) = (data.join("labels/floor.csv"), data.to_str().unwrap().to_string());
    let labels = labels.to_str().unwrap();
    for args in [
        vec!["diagnose", &data, "--labels", labels, "--estimate", "imu-euler"],
        vec!["depth", &data, "--at", "0", "--out", "never"],
        vec!["labels", "track", &data, "--out", "never.json"],
    ] {
        let run = vice(&[&args[..], &["--depth", "triangulated"]].concat());
        assert!(
            run.code == 2 && run.stderr.contains("only `vice evaluate` has it"),
            "{args:?} {}",
            run.stderr
        );
    }

    // Results with it and without it are not held against each other, nor shown on one page.
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    for depth in ["floor", "triangulated"] {
        let written = file(&format!("{depth}.json"));
        let (code, _, error) = evaluate(&["--depth", depth, "--json", &written]).unwrap();
        assert!(code == 0 || code == 3, "{error}");
    }
    let (floor, triangulated, page) = (file("floor.json"), file("triangulated.json"), file("page.html"));
    for args in
        [vec!["compare", &floor, &triangulated], vec!["report", &floor, &triangulated, "--out", &page]]
    {
        let run = vice(&args);
        assert!(
            run.code == 2 && run.stderr.contains("cannot stand beside other depths"),
            "{args:?} {}",
            run.stderr
        );
    }
    assert!(!std::path::Path::new(&page).exists());
    assert_eq!(vice(&["report", &triangulated, "--out", &page]).code, 0);
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains("leave no trace here"));
}
