//! What `vice evaluate` says beside the paper's columns, and the limits that it judges by.

use serde_json::Value;
use vice_tests::{Run, shared, vice};

fn evaluate(more: &[&str]) -> Option<Run> {
    let dataset = shared("data/euroc_v1_01")?;
    let path = |p: &str| dataset.join(p).to_str().unwrap().to_string();
    let mut args = vec!["evaluate".to_string(), path(""), "--labels".into(), path("labels/floor.csv")];
    args.extend(more.iter().map(|s| (*s).to_string()));
    Some(vice(&args))
}

fn document(more: &[&str]) -> Option<Value> {
    let run = evaluate(&[more, &["--json", "-"]].concat())?;
    assert!([0, 3].contains(&run.code), "{}", run.stderr);
    Some(serde_json::from_str(&run.stdout).unwrap())
}

#[test]
fn a_limit_that_is_broken_or_not_known_to_be_kept_is_exit_code_4() {
    let base = ["--estimate", "imu-euler", "--depth-check", "off"];
    let with = |limits: &[&'static str]| {
        let limits: Vec<&str> = limits.iter().flat_map(|l| ["--require", l]).collect();
        evaluate(&[&base[..], &limits].concat())
    };
    // 98 px.
    let Some(run) = with(&["rmse_2d<2px"]) else { return };
    assert_eq!(run.code, 4, "{}", run.stderr);
    assert!(run.stderr.contains("imu-euler (floor depth) breaks rmse_2d<2px"), "{}", run.stderr);
    assert!(run.stdout.contains("held px [95 %]"), "the table is printed all the same: {}", run.stdout);
    // Nothing lives for ten seconds there.
    let run = with(&["age10s<1000px", "rmse_2d<1000000px"]).unwrap();
    assert_eq!(run.code, 4, "{}", run.stderr);
    assert!(run.stderr.contains("breaks age10s<1000px: there is no number"), "{}", run.stderr);
    for wrong in ["rmse_2d>2px", "rmse_2d<2", "age3s<2px"] {
        let run = with(&[wrong]).unwrap();
        assert_eq!(run.code, 2, "{wrong}: {}", run.stderr);
        assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
    }
}

#[test]
fn an_estimate_that_starts_in_the_references_state_is_aligned_by_its_first_pose() {
    let align = |document: &Value| document["trajectory"][0]["align"].as_str().unwrap().to_string();
    let Some(first) = document(&["--estimate", "imu-euler"]) else { return };
    assert_eq!(align(&first), "first-pose");
    let asked = document(&["--estimate", "imu-euler", "--align", "se3"]).unwrap();
    assert_eq!(align(&asked), "se3");
    let rmse = |d: &Value| d["trajectory"][0]["rmse_3d_m"].as_f64().unwrap();
    assert!(rmse(&first) > rmse(&asked), "moving it onto the path hides its drift");
    // The pixels know no alignment.
    assert_eq!(first["pixel"][1]["pooled_rmse_px"], asked["pixel"][1]["pooled_rmse_px"]);
    let run = evaluate(&["--estimate", "imu-euler"]).unwrap();
    assert!(
        run.stdout.contains("imu-euler: RMSE_3D, AOE and ROE over 7 poses, aligned by first-pose"),
        "{}",
        run.stdout
    );
    assert!(run.stdout.contains("rest on few poses: 7"), "{}", run.stdout);
}

#[test]
fn without_a_reference_the_order_of_the_estimates_does_not_matter() {
    let Some(dataset) = shared("data/euroc_v1_01") else { return };
    let path = |p: &str| dataset.join("estimates").join(p).to_str().unwrap().to_string();
    let (a, b) = (path("imu_euler.txt"), path("../mav0/state_groundtruth_estimate0/data.csv"));
    let errors = |list: String, more: &[&str]| {
        let args = [&["--estimate", &list, "--reference", "none", "--depth-check", "off"], more].concat();
        let found = document(&args).unwrap();
        let mut list: Vec<(String, String)> = found["pixel"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| (p["stream"].to_string(), p["pooled_rmse_px"].to_string()))
            .collect();
        list.sort();
        (list, found["used"]["anchor"].as_str().unwrap().to_string())
    };
    let (one, anchor) = errors(format!("{a},{b}"), &[]);
    assert_eq!(anchor, "each stream its own");
    assert_eq!(one, errors(format!("{b},{a}"), &[]).0);
    let (named, anchor) = errors(format!("{a},{b}"), &["--anchor", "data"]);
    assert_eq!(
        (named.clone(), anchor.as_str()),
        (errors(format!("{b},{a}"), &["--anchor", "data"]).0, "data")
    );
    let unknown = [&["--estimate", &a, "--reference", "none", "--anchor", "nobody"][..]].concat();
    let run = evaluate(&unknown).unwrap();
    assert_eq!(run.code, 2, "{}", run.stderr);
    assert!(run.stderr.contains("there is no stream nobody"), "{}", run.stderr);
}
