//! `vice evaluate` on a real EuRoC flight against OpenCV and SciPy.

use serde_json::Value;
use vice_tests::{shared, shared_json, vice};

/// Runs the program and gives the pixel part of one stream and depth source.
fn evaluate(labels: &str, estimate: &str, depth: &str, more: &[&str]) -> Option<Value> {
    let dataset = shared("data/euroc_v1_01")?;
    let labels = dataset.join("labels").join(labels);
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("out.json");
    let path = |p: &std::path::Path| p.to_str().unwrap().to_string();
    let estimate = match estimate.ends_with(".txt") {
        true => path(&dataset.join("estimates").join(estimate)),
        false => estimate.to_string(),
    };
    let mut args = vec!["evaluate".to_string(), path(&dataset), "--labels".into(), path(&labels)];
    args.extend([
        "--estimate".into(),
        estimate,
        "--depth".into(),
        depth.into(),
        "--json".into(),
        path(&json),
    ]);
    args.extend(more.iter().map(|s| (*s).to_string()));
    let run = vice(&args);
    assert_eq!(run.code, 0, "{}", run.stderr);
    Some(serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap())
}

fn part<'a>(document: &'a Value, role: &str, depth: &str) -> &'a Value {
    let parts = document["pixel"].as_array().unwrap();
    parts.iter().find(|p| p["role"] == role && p["depth"] == depth).unwrap()
}

fn px(value: &Value) -> [f64; 2] {
    [value[0].as_f64().unwrap(), value[1].as_f64().unwrap()]
}

/// Every sample and key frame of the oracle is in the part, at the same place.
fn compare(part: &Value, oracle: &Value, tracked_px: f64, depth_m: f64) {
    let find = |list: &str, sample: &Value| {
        let point = sample["point"].to_string();
        let mut entries = part[list].as_array().unwrap().iter();
        entries.find(|e| e["point"] == point.as_str() && e["timestamp_ns"] == sample["timestamp_ns"]).cloned()
    };
    let (mut keyframes, mut samples) = (0, 0);
    for sample in oracle["samples"].as_array().unwrap() {
        if sample["keyframe"] == true {
            keyframes += 1;
            let ours = find("keyframes", sample).expect("the key frame was used");
            let off = ours["depth_z_m"].as_f64().unwrap() - sample["depth_z_m"].as_f64().unwrap();
            assert!(off.abs() < depth_m, "depth off by {off}: {sample}");
        } else {
            samples += 1;
            let ours = find("samples", sample).expect("the sample was scored");
            let (got, want) = (px(&ours["tracked_px"]), px(&sample["tracked_px"]));
            let off = (got[0] - want[0]).hypot(got[1] - want[1]);
            assert!(off < tracked_px, "tracked pixel off by {off}: {sample}");
        }
    }
    assert_eq!(keyframes, part["keyframes"].as_array().unwrap().len());
    assert_eq!(part["scored"], samples);
    assert_eq!(part["skipped"].as_array().unwrap().len(), 0);
    for (size, want) in oracle["rmse_2d"].as_object().unwrap() {
        let got = &part["rmse_px"][size];
        for (ours, theirs) in [("mean", "mean_px"), ("std", "std_px")] {
            let off = got[ours].as_f64().unwrap() - want[theirs].as_f64().unwrap();
            assert!(off.abs() < tracked_px, "{size} points: {ours} off by {off}");
        }
        assert_eq!(got["subsets"], want["subsets"]);
    }
}

#[test]
fn floor_depth_agrees_with_opencv() {
    let Some(oracle) = shared_json("oracle/euroc_v1_01_vice.json") else { return };
    let all = ["--subsets", "1,2,3,4"];
    let Some(document) = evaluate("floor.csv", "imu_euler.txt", "floor", &all) else { return };
    compare(part(&document, "reference", "floor"), &oracle["labels_floor"]["ground_truth/floor"], 1e-4, 1e-5);
    compare(part(&document, "estimate", "floor"), &oracle["labels_floor"]["imu_euler/floor"], 1e-4, 1e-5);
}

#[test]
fn zmap_depth_agrees_with_scipy() {
    let Some(oracle) = shared_json("oracle/euroc_v1_01_vice.json") else { return };
    let all = ["--subsets", "1,2,3,4", "--zmap-occlusion", "off"];
    for labels in ["floor", "board"] {
        let Some(document) = evaluate(&format!("{labels}.csv"), "imu_euler.txt", "zmap", &all) else {
            return;
        };
        let oracle = &oracle[format!("labels_{labels}")];
        compare(part(&document, "reference", "zmap"), &oracle["ground_truth/zmap"], 1e-3, 1e-5);
        compare(part(&document, "estimate", "zmap"), &oracle["imu_euler/zmap"], 1e-3, 1e-5);
    }
}

#[test]
fn integrating_the_imu_gives_the_estimate_in_the_file() {
    let Some(ours) = evaluate("floor.csv", "imu-euler", "floor", &[]) else { return };
    let Some(file) = evaluate("floor.csv", "imu_euler.txt", "floor", &[]) else { return };
    let pooled = |d: &Value| part(d, "estimate", "floor")["pooled_rmse_px"].as_f64().unwrap();
    // The file holds nine decimals.
    assert!((pooled(&ours) - pooled(&file)).abs() < 1e-3, "{} {}", pooled(&ours), pooled(&file));
    assert!((pooled(&ours) - 98.098).abs() < 0.01);
    assert_eq!(ours["schema"], "vice.result/2");
    assert_eq!(ours["pixel"][0]["stream"], "ground-truth");
    assert_eq!(ours["trajectory"][0]["matched"], 7);
}

#[test]
fn a_sparse_estimate_is_skipped_and_says_so() {
    let Some(dataset) = shared("data/euroc_v1_01") else { return };
    let path = |p: &str| dataset.join(p).to_str().unwrap().to_string();
    let run = vice(&[
        "evaluate".to_string(),
        path(""),
        "--labels".into(),
        path("labels/floor.csv"),
        "--estimate".into(),
        path("estimates/svo_ba.txt"),
        "--estimate-frame".into(),
        "camera".into(),
    ]);
    assert_eq!(run.code, 3, "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("keyframe-gap"), "{}", run.stdout);
    assert!(run.stderr.contains("100.0 % of the labels"), "{}", run.stderr);
}
