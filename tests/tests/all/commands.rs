//! The commands that people type, on real and on rendered data.

use std::path::Path;

use serde_json::Value;
use vice_tests::{Run, shared, shared_json, vice};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn good(run: Run) -> String {
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    run.stdout
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn pooled(document: &Value, stream: &str) -> f64 {
    let parts = document["pixel"].as_array().unwrap();
    parts.iter().find(|p| p["stream"] == stream).unwrap()["pooled_rmse_px"].as_f64().unwrap()
}

#[test]
fn the_demo_tells_good_from_bad() {
    let folder = tempfile::tempdir().unwrap();
    let said = good(vice(&["demo", "--quiet"]));
    for words in
        ["exact: the dots stay on their points", "drift:", "clock-offset:", "labels without a hand:", "agree"]
    {
        assert!(said.contains(words), "{said}");
    }
    assert!(!said.contains("do not agree"), "{said}");
    assert!(folder.path().read_dir().unwrap().next().is_none());
}

#[test]
fn every_locobot_recording_gives_the_same_pixels() {
    let Some(data) = shared("data/locobot") else { return };
    let folder = tempfile::tempdir().unwrap();
    let labels = data.join("labels.csv");
    let mut first: Option<Value> = None;
    for recording in [
        "locobot_ros1.bag",
        "locobot_ros1_compressed.bag",
        "locobot_ros2_mcap/locobot_ros2.mcap",
        "locobot_ros2_mcap",
        "locobot_ros2_db3",
    ] {
        let out = folder.path().join("out.json");
        let recording = data.join(recording);
        let args = [
            "evaluate",
            text(&recording),
            "--labels",
            text(&labels),
            "--estimate",
            "odom,slam",
            "--depth",
            "zcam",
        ];
        good(vice(&[&args[..], &["--json", text(&out)]].concat()));
        let document = json(&out);
        assert!((pooled(&document, "odom") - 11.466).abs() < 5e-4, "{}", pooled(&document, "odom"));
        assert!((pooled(&document, "slam") - 2.913).abs() < 5e-4, "{}", pooled(&document, "slam"));
        let pixels = document["pixel"].clone();
        assert_eq!(*first.get_or_insert(pixels.clone()), pixels, "{}", recording.display());
    }
}

#[test]
fn blackbird_is_evaluated_with_and_without_ffmpeg() {
    let Some(data) = shared("data/blackbird") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (flight, labels) = (data.join("picasso/yawForward/maxSpeed1p0"), data.join("labels.csv"));
    assert!(good(vice(&["info", text(&data)])).contains("maxSpeed1p0"));
    for ffmpeg in ["ffmpeg=ffmpeg", "ffmpeg=/no/such/program"] {
        let out = folder.path().join("out.json");
        let args = [
            "evaluate",
            text(&flight),
            "--labels",
            text(&labels),
            "--estimate",
            "imu-euler",
            "--depth",
            "zcam",
        ];
        good(vice(&[&args[..], &["--set", ffmpeg, "--json", text(&out)]].concat()));
        let document = json(&out);
        assert!((pooled(&document, "ground-truth") - 0.010).abs() < 5e-4);
        assert!((pooled(&document, "imu-euler") - 19.23).abs() < 5e-3);
    }
}

#[test]
fn depth_images_and_their_differences_are_written() {
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("depth");
    let at = "1403715280562142976";
    let said = good(vice(&["depth", text(&data), "--at", at, "--depth", "floor,zmap", "--out", text(&out)]));
    assert!(said.contains("floor - zmap over"), "{said}");
    for name in [
        "floor.png",
        "floor.npy",
        "floor_picture.png",
        "zmap.png",
        "zmap.npy",
        "floor_minus_zmap.png",
        "image.png",
    ] {
        assert!(out.join(name).metadata().unwrap().len() > 1000, "{name}");
    }
    let labels = data.join("labels/floor.csv");
    let args = ["depth", "compare", text(&data), "--labels", text(&labels), "--depth", "floor,zmap"];
    assert!(good(vice(&args)).contains("over 8 of 8 key points"));
    let wrong = vice(&["depth", text(&data), "--at", "7000", "--depth", "floor", "--out", text(&out)]);
    assert_eq!(wrong.code, 1);
    assert!(wrong.stderr.contains("nearest frame"), "{}", wrong.stderr);
}

#[test]
fn the_floor_is_found_in_the_scan() {
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let said = good(vice(&["floor", "fit", text(&data), "--quiet"]));
    let plane: Vec<f64> = said.lines().next().unwrap().split(',').map(|v| v.parse().unwrap()).collect();
    assert!(plane[2] > 0.999 && plane[3].abs() < 0.05, "{said}");
}

#[test]
fn trajectories_are_compared_as_the_document_says() {
    let Some(oracle) = shared_json("oracle/trajectory_metrics.json") else { return };
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.json");
    let (reference, estimate) =
        (data.join("mav0/state_groundtruth_estimate0/data.csv"), data.join("estimates/svo_ba.txt"));
    let args = ["trajectory", text(&reference), text(&estimate), "--align", "se3", "--json", text(&out)];
    assert!(good(vice(&args)).contains("RMSE_3D 0.0419 m"));
    let (document, want) = (json(&out), &oracle["cases"]["svo_ba"]["se3"]);
    let near = |got: &Value, want: &Value| {
        let (got, want) = (got.as_f64().unwrap(), want.as_f64().unwrap());
        assert!((got - want).abs() < 1e-9 + 1e-6 * want.abs(), "{got} {want}");
    };
    for statistic in ["rmse", "mean", "median", "std", "min", "max", "sse"] {
        near(&document["ape"]["translation_m"][statistic], &want["ape_translation_part"][statistic]);
        near(&document["ape"]["full"][statistic], &want["ape_full_transformation"][statistic]);
        near(&document["rpe"]["translation_m"][statistic], &want["rpe_1frame_translation_part"][statistic]);
    }
    near(&document["aoe_rad"], &want["seed"]["aoe_rad"]);
    near(&document["roe_rad"], &want["seed"]["roe_mean_rad"]);
    assert_eq!(document["matched"], 142);
}

#[test]
fn streams_and_labels_are_converted() {
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for (format, name) in [("tum", "gt.txt"), ("euroc", "gt.csv"), ("kitti", "poses.txt")] {
        let out = path(name);
        good(vice(&["convert", text(&data), "--stream", "ground-truth", "--to", format, text(&out)]));
        let said = good(vice(&["trajectory", text(&path("gt.txt")), text(&out)]));
        assert!(said.contains("RMSE_3D 0.0000 m"), "{said}");
    }
    let (csv, document, again) = (data.join("labels/floor.csv"), path("labels.json"), path("again.csv"));
    good(vice(&["labels", "convert", text(&csv), text(&document)]));
    good(vice(&["labels", "convert", text(&document), text(&again)]));
    let by_file = |labels: &Path| {
        let out = path("out.json");
        let args = [
            "evaluate",
            text(&data),
            "--labels",
            text(labels),
            "--estimate",
            "imu-euler",
            "--json",
            text(&out),
        ];
        good(vice(&args));
        json(&out)["pixel"].clone()
    };
    assert_eq!(by_file(&csv), by_file(&document));
    assert_eq!(by_file(&csv), by_file(&again));
}

#[test]
fn each_command_has_help_with_an_example() {
    for command in [
        "demo",
        "evaluate",
        "trajectory",
        "info",
        "check",
        "clock",
        "depth",
        "synth",
        "convert",
        "completions",
        "report",
        "overlay",
        "compare",
        "batch",
        "table",
    ] {
        let help = good(vice(&[command, "--help"]));
        assert!(help.contains("Example"), "{command}: {help}");
    }
    assert!(good(vice(&["formats"])).contains("euroc"));
    assert!(good(vice(&["completions", "bash"])).contains("vice"));
}
