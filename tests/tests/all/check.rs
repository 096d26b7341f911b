//! What `vice check` and `vice clock` say of real recordings.

use std::path::{Path, PathBuf};

use serde_json::Value;
use vice_core::check::clock::{ClockDoubt, ClockOffset, clock_offset};
use vice_core::check::turning::Turning;
use vice_core::dataset::{DatasetFactory, OpenOptions};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_files::trajectory::{ReadOptions, read};
use vice_tests::{shared, vice};

fn turning(trajectory: &Trajectory) -> Turning {
    Turning::of_poses(trajectory).unwrap()
}

fn file(path: &Path) -> Trajectory {
    read(path, &ReadOptions::default()).unwrap().trajectory
}

/// All files of a folder, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    files
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap().to_str().unwrap().to_string()
}

#[test]
fn published_runs_are_where_turn_rates_put_them() {
    let Some(data) = shared("data/euroc_trajectories") else { return };
    let truths: Vec<(String, Turning)> = files(&data.join("truth"))
        .iter()
        .filter(|p| !stem(p).contains("original"))
        .map(|p| (stem(p)[..5].to_string(), turning(&file(p))))
        .collect();
    let mut seen = 0;
    for path in files(&data.join("estimates")) {
        let name = stem(&path);
        let (flight, truth) = truths.iter().find(|(flight, _)| name.contains(flight.as_str())).unwrap();
        let found =
            clock_offset(truth, &turning(&file(&path)), None).unwrap_or_else(|e| panic!("{name}: {e}"));
        let expected = if name.starts_with("vislam_rp") { -0.05 } else { 0.0 };
        let off = found.offset_s - expected;
        assert!(found.correlation > 0.98, "{name}: {found:?}");
        // The clock of that truth runs 100 ppm fast against the cameras: from -4 to +7 ms over the flight, by all four
        // algorithms alike, so that its mean is no one number.
        if flight == "V2_03" && name.starts_with("vio") {
            let early = found.parts.iter().take(4).map(|p| p.1).fold(f64::INFINITY, f64::min);
            let late = found.parts.iter().rev().take(4).map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
            assert!(early < -2e-3 && late > 4e-3, "{name}: {:?}", found.parts);
            assert!(off.abs() < 3e-3, "{name}: {found:?}");
        } else {
            assert!(off.abs() < 2e-3, "{name}: {} ms", 1e3 * found.offset_s);
        }
        seen += 1;
    }
    assert_eq!(seen, 56);
}

fn euroc() -> Option<(Turning, Trajectory)> {
    let path = shared("data/euroc_v1_01")?;
    let dataset = vice_euroc::Euroc.open(&path, &OpenOptions::default()).unwrap();
    let truth = dataset.trajectory("ground-truth").unwrap();
    Some((Turning::of_gyro(&dataset.imu().unwrap()).unwrap(), truth))
}

fn of_gyro(gyro: &Turning, poses: &Trajectory) -> Result<ClockOffset, ClockDoubt> {
    clock_offset(gyro, &turning(poses), None)
}

#[test]
fn an_offset_between_gyroscope_and_poses_is_found_on_real_data() {
    let Some((gyro, truth)) = euroc() else { return };
    let none = of_gyro(&gyro, &truth).unwrap();
    assert!(none.offset_s.abs() < 1e-3 && none.correlation > 0.999, "{none:?}");
    for millis in [-100, -50, -20, -5, 5, 20, 50, 100] {
        let found = of_gyro(&gyro, &truth.shifted(Span::from_millis(millis)).unwrap()).unwrap();
        let off = found.offset_s - none.offset_s + 1e-3 * millis as f64;
        assert!(off.abs() < 1e-4, "{millis} ms: off by {} ms", 1e3 * off);
        assert!((found.half_95_s - none.half_95_s).abs() < 1e-4);
    }
}

#[test]
fn intervals_of_the_offset_hold_on_parts_of_a_real_flight() {
    let Some((gyro, truth)) = euroc() else { return };
    let whole = of_gyro(&gyro, &truth).unwrap();
    let (mut inside, mut all) = (0, 0);
    for start in (0..120).step_by(15) {
        let first = truth.start() + Span::from_millis(1000 * start);
        let Some(part) = truth.between(first, first + Span::from_millis(20_000)) else { continue };
        match of_gyro(&gyro, &part) {
            Ok(found) => {
                all += 1;
                inside +=
                    i32::from((found.offset_s - whole.offset_s).abs() < found.half_95_s + whole.half_95_s);
            }
            // At the start and the end it stands on the floor.
            Err(doubt) => assert!(
                matches!(doubt, ClockDoubt::TooQuiet { .. } | ClockDoubt::Uncorrelated { .. }),
                "{doubt}"
            ),
        }
    }
    assert!(all >= 6 && inside >= all - 1, "{inside} of {all}");
}

/// `vice check` with `--json -`: exit code and document.
fn check(args: &[&str]) -> (i32, Value) {
    let run = vice(&[&["check"][..], args, &["--json", "-"]].concat());
    assert!([0, 3].contains(&run.code), "{args:?}: {}", run.stderr);
    (run.code, serde_json::from_str(&run.stdout).unwrap())
}

/// Findings of a state as `check: about`.
fn named(document: &Value, state: &str) -> Vec<String> {
    let word = |f: &Value, key: &str| f[key].as_str().unwrap_or_default().to_string();
    let found = document["findings"].as_array().unwrap().iter().filter(|f| f["state"] == state);
    found.map(|f| format!("{}: {}", word(f, "check"), word(f, "about"))).collect()
}

/// Recordings of the shared data, and what is wrong with each. docs/check.md says why.
const TRUE_WRONGS: [(&str, &[&str]); 8] = [
    ("euroc_v1_01", &[]),
    ("visp_tags_rgbd", &[]),
    ("hololens_rgbd", &[]),
    ("chess_opencv", &[]),
    ("blackbird/picasso/yawForward/maxSpeed1p0", &[]),
    ("locobot/locobot_ros1.bag", &[]),
    ("locobot/locobot_ros2_mcap", &[]),
    ("locobot/locobot_raw3.bag", &[]),
];

#[test]
fn nothing_is_called_wrong_that_is_not() {
    for (path, wrong) in TRUE_WRONGS {
        let Some(data) = shared(&format!("data/{path}")) else { return };
        let (code, document) = check(&[data.to_str().unwrap()]);
        assert_eq!(named(&document, "wrong"), wrong, "{path}: {document:#}");
        assert_eq!(code, if wrong.is_empty() { 0 } else { 3 }, "{path}");
    }
}

#[test]
fn an_estimate_that_is_late_or_of_another_convention_is_named_with_its_cure() {
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let truth = file(&data.join("mav0/state_groundtruth_estimate0/data.csv"));
    let write = |name: &str, conjugate: bool, late_ns: i64| {
        let mut text = String::new();
        for (stamp, pose) in truth.iter() {
            let (t, q) = (pose.translation(), pose.rotation());
            let s = if conjugate { -1.0 } else { 1.0 };
            let at = Stamp::from_nanos(stamp.as_nanos() + late_ns).to_seconds_text();
            text.push_str(&format!(
                "{at} {} {} {} {} {} {} {}\n",
                t.x,
                t.y,
                t.z,
                s * q.i,
                s * q.j,
                s * q.k,
                q.w
            ));
        }
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_string()
    };
    let data = data.to_str().unwrap();
    let late = write("late.tum", false, 50_000_000);
    let (code, document) = check(&[data, "--estimate", &late]);
    assert_eq!(code, 3);
    assert_eq!(named(&document, "wrong"), ["clock: ground-truth / late", "clock: imu / late"]);
    let (code, _) = check(&[data, "--estimate", &late, "--time-offset", "-0.05"]);
    assert_eq!(code, 0, "mended");
    let conjugate = write("conjugate.tum", true, 0);
    let (code, document) = check(&[data, "--estimate", &conjugate]);
    assert_eq!(code, 3);
    let wrong = named(&document, "wrong");
    assert!(wrong.contains(&"motion: ground-truth / conjugate".to_string()), "{wrong:?}");
    assert!(wrong.contains(&"inertial: imu / conjugate".to_string()), "{wrong:?}");
    let mends: Vec<&str> =
        document["findings"].as_array().unwrap().iter().filter_map(|f| f["mend"].as_str()).collect();
    assert!(mends.contains(&"`estimate-as` conjugate"), "{mends:?}");
    assert_eq!(check(&[data, "--estimate", &conjugate, "--estimate-as", "conjugate"]).0, 0, "mended");

    // Whoever does not ask is told beside the numbers, and whoever mends it is not.
    let labels = format!("{data}/labels/floor.csv");
    let suspected = |args: &[&str]| {
        let run = vice(
            &[&["evaluate", data, "--labels", &labels, "--depth", "zmap", "--json", "-"], args].concat(),
        );
        // Labels beside an edge have no depth where a wrong pose places the camera.
        assert!([0, 3].contains(&run.code), "{}", run.stderr);
        let document: Value = serde_json::from_str(&run.stdout).unwrap();
        let list = document["suspicions"].as_array().cloned().unwrap_or_default();
        let found = list
            .iter()
            .filter_map(|s| Some((s["code"].as_str()?.to_string(), s["advice"].as_str()?.to_string())));
        found.filter(|(code, _)| code.starts_with("check-")).collect::<Vec<_>>()
    };
    let told = |code: &str, advice: &str| (code.to_string(), advice.to_string());
    let reference = ["--estimate", conjugate.as_str()];
    assert_eq!(suspected(&reference), [told("check-motion", "`estimate-as` conjugate")]);
    let alone = [&reference[..], &["--reference", "none"]].concat();
    assert_eq!(suspected(&alone), [told("check-inertial", "`estimate-as` conjugate")]);
    assert_eq!(suspected(&[&reference[..], &["--estimate-as", "conjugate"]].concat()), []);
    assert_eq!(suspected(&["--estimate", late.as_str()])[0].0, "check-clock");

    let imu = format!("{data}/mav0/imu0/data.csv");
    let run = vice(&["clock", &imu, &late]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("--time-offset -0.050"), "{}", run.stdout);
    let named = vice(&["clock", "imu", "ground-truth", "--dataset", data, "--json", "-"]);
    let document: Value = serde_json::from_str(&named.stdout).unwrap();
    assert_eq!(document["schema"], "vice.clock/1");
    assert!(document["time_offset_s"].as_f64().unwrap().abs() < 1e-3, "{document}");
}

#[test]
fn the_list_explains_each_check_and_bad_input_is_one_line() {
    let run = vice(&["check", "--list"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    for check in vice_core::check::CHECKS {
        assert!(run.stdout.contains(&format!("{}: {}", check.name, check.title)), "{}", check.name);
    }
    for args in [
        &["check", "no-such-run"][..],
        &["clock", "no-such-a.txt", "no-such-b.txt"],
        &["calibration", "diff", "no-a.toml", "no-b.toml"],
    ] {
        let run = vice(args);
        assert!(
            run.code == 1 && run.stderr.trim_end().lines().count() == 1,
            "{args:?}: {} {}",
            run.code,
            run.stderr
        );
    }
    assert_eq!(vice(&["check"]).code, 2);
}

#[test]
fn two_calibrations_are_pixels_apart() {
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let data = data.to_str().unwrap();
    let same = vice(&["calibration", "diff", data, data]);
    assert!(
        same.code == 0 && same.stdout.contains("the intrinsics are the same"),
        "{} {}",
        same.stdout,
        same.stderr
    );
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other.toml");
    let text = "[cam0]\nmodel = \"radtan\"\nresolution = [752, 480]\nintrinsics = [467.82708, 466.44192, 367.215, 248.375]\n\
                distortion = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n";
    std::fs::write(&other, text).unwrap();
    let plot = folder.path().join("diff.svg");
    let run = vice(&[
        "calibration",
        "diff",
        data,
        other.to_str().unwrap(),
        "--camera",
        "cam0",
        "--plot",
        plot.to_str().unwrap(),
        "--json",
        "-",
    ]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let document: Value = serde_json::from_str(&run.stdout).unwrap();
    let number = |key: &str| document[key].as_f64().unwrap();
    // Two percent of focal length: two percent of the distorted radius, up to the corner.
    assert!(number("most_px") > 7.0 && number("most_px") < 10.0, "{}", number("most_px"));
    assert!(number("rms_px") < number("rms_unrotated_px") + 1e-9);
    assert!(std::fs::read_to_string(&plot).unwrap().contains("<svg"));
}
