//! `vice trajectory` on several estimates, on data sets and on streams of recordings.

use std::fs;
use std::path::Path;

use serde_json::Value;
use vice_tests::{shared, vice};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn json(args: &[&str]) -> Value {
    let run = vice(args);
    assert_eq!(run.code, 0, "{args:?}: {}{}", run.stdout, run.stderr);
    serde_json::from_str(&run.stdout).unwrap_or_else(|e| panic!("{args:?}: {e}: {}", run.stdout))
}

/// One table and one plot, with the numbers that each has alone; a data set stands for its ground truth.
#[test]
fn several_estimates_have_the_numbers_that_each_has_alone() {
    let Some(recording) = shared("data/hololens_rgbd") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (truth, near) = (folder.path().join("truth.txt"), folder.path().join("near.txt"));
    for path in [&truth, &near] {
        assert_eq!(vice(&["convert", text(&recording), "--to", "tum", text(path)]).code, 0);
    }
    // 10 cm to the side.
    let moved: String = fs::read_to_string(&truth)
        .unwrap()
        .lines()
        .map(|line| match line.split_once(' ') {
            Some((stamp, rest)) if !line.starts_with('#') => {
                let (x, rest) = rest.split_once(' ').unwrap();
                format!("{stamp} {} {rest}\n", x.parse::<f64>().unwrap() + 0.1)
            }
            _ => format!("{line}\n"),
        })
        .collect();
    fs::write(&near, moved).unwrap();
    let set = text(&recording);
    let both = json(&["trajectory", set, text(&truth), text(&near), "--json", "-"]);
    assert_eq!(both["schema"], "vice.trajectories/1");
    for (index, path) in [&truth, &near].into_iter().enumerate() {
        let alone = json(&["trajectory", set, text(path), "--json", "-"]);
        assert_eq!(alone["schema"], "vice.trajectory/1");
        assert_eq!(both["estimates"][index], alone);
    }
    let rmse = |index: usize| both["estimates"][index]["rmse_3d_m"].as_f64().unwrap();
    assert!(rmse(0) < 1e-6 && (rmse(1) - 0.1).abs() < 1e-6, "{} {}", rmse(0), rmse(1));
    let plot = folder.path().join("all.svg");
    let table = vice(&["trajectory", set, text(&truth), text(&near), "--deg", "--plot", text(&plot)]);
    assert!(table.stdout.contains("AOE deg") && table.stdout.lines().count() >= 4, "{}", table.stdout);
    let svg = fs::read_to_string(&plot).unwrap();
    assert!(svg.contains("near.txt") && svg.contains("truth.txt"), "each has its path");
    let zip = folder.path().join("a.zip");
    let refused = vice(&["trajectory", set, text(&truth), text(&near), "--evo-zip", text(&zip)]);
    assert!(refused.code == 2 && !zip.exists(), "{}", refused.stderr);
    // What is quiet says nothing where its result goes to a file.
    let out = folder.path().join("out.json");
    let quiet = vice(&["-q", "trajectory", set, text(&near), "--json", text(&out)]);
    assert!(quiet.code == 0 && quiet.stdout.is_empty() && out.is_file(), "{}", quiet.stdout);
}

#[test]
fn streams_of_recordings_are_named_behind_a_colon() {
    let Some(bag) = shared("data/locobot/locobot_ros1.bag") else { return };
    let (bag, truth) = (text(&bag), bag.with_file_name("truth_base_footprint.txt"));
    let of = |stream: &str| json(&["trajectory", text(&truth), &format!("{bag}:{stream}"), "--json", "-"]);
    let (slam, tf) = (of("slam"), of("/tf:map.base_footprint"));
    assert_eq!(slam["rmse_3d_m"], tf["rmse_3d_m"]);
    // The fixture's README: the SLAM estimate is at most 8 mm off.
    assert!(slam["rmse_3d_m"].as_f64().unwrap() < 0.008, "{slam}");
    assert!(of("odom")["rmse_3d_m"].as_f64().unwrap() > slam["rmse_3d_m"].as_f64().unwrap());
    let which = vice(&["trajectory", text(&truth), bag]);
    assert!(which.code == 2 && which.stderr.contains("several pose streams"), "{}", which.stderr);
    let gone = vice(&["trajectory", text(&truth), &format!("{bag}:nowhere")]);
    assert!(gone.code == 1 && gone.stderr.contains("nowhere"), "{}", gone.stderr);
}

/// The integration of the IMU is what `evaluate` integrates, started at the first frame.
#[test]
fn an_integrated_imu_can_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let (flight, out) = (folder.path().join("flight"), folder.path().join("imu.txt"));
    let run = vice(&["synth", text(&flight), "--duration", "2", "--rate", "10"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let args = ["convert", text(&flight), "--stream", "imu-euler", "--to", "tum", text(&out), "--json"];
    let document = json(&args);
    assert!(document["poses"].as_u64().unwrap() > 100, "{document}");
    let compared = json(&["trajectory", text(&flight), text(&out), "--json", "-"]);
    let off = compared["rmse_3d_m"].as_f64().unwrap();
    assert!(off > 0.0 && off < 0.3, "two seconds of a good IMU: {off} m");
}

#[test]
fn documents_for_programs() {
    let Some(recording) = shared("data/hololens_rgbd") else { return };
    let info = json(&["info", text(&recording), "--json"]);
    assert_eq!(
        (info["schema"].as_str(), &info["cameras"][0]["frames"]["count"]),
        (Some("vice.info/1"), &100.into())
    );
    assert_eq!(info["streams"][0]["name"], "ground-truth");
    let formats = json(&["formats", "--json"]);
    let names: Vec<&str> =
        formats["formats"].as_array().unwrap().iter().filter_map(|f| f["name"].as_str()).collect();
    assert!(names.contains(&"images") && names.contains(&"euroc"), "{names:?}");
}
