//! What `vice check --images` says of cameras by their images alone: rendered flights whose extrinsics and stamps are known,
//! and spoiled, and real recordings.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use nalgebra::UnitQuaternion;
use serde_json::Value;
use vice_synthetic::{Synthetic, SyntheticOptions, write_euroc};
use vice_tests::{shared, vice};

/// A rendered flight of 12 s, written once.
fn flight() -> &'static Path {
    static FLIGHT: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, path) = FLIGHT.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        let options = SyntheticOptions {
            duration_s: 12.0,
            width: 320,
            height: 240,
            cloud_spacing_m: 0.05,
            ..SyntheticOptions::default()
        };
        write_euroc(&Synthetic::new(options).unwrap(), &path, false, &|_, _| ()).unwrap();
        (folder, path)
    });
    path
}

/// A copy whose files can be spoiled; images are linked.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let there = to.join(entry.file_name());
        match entry.path() {
            path if path.is_dir() => copy(&path, &there),
            path if path.extension().is_some_and(|e| e == "png") => {
                fs::hard_link(&path, &there)
                    .map(|()| 0)
                    .or_else(|_| fs::copy(&path, &there))
                    .map(|_| ())
                    .unwrap();
            }
            path => {
                fs::copy(&path, &there).unwrap();
            }
        }
    }
}

fn check(path: &Path, more: &[&str]) -> Value {
    let run = vice(&[&["check", path.to_str().unwrap(), "--images", "--json", "-"], more].concat());
    assert!([0, 3].contains(&run.code), "{path:?}: {}", run.stderr);
    serde_json::from_str(&run.stdout).unwrap()
}

/// Findings of a check about something.
fn about<'a>(document: &'a Value, check: &str, about: &str) -> &'a Value {
    let list = document["findings"].as_array().unwrap();
    list.iter()
        .find(|f| f["check"] == check && f["about"] == about)
        .unwrap_or_else(|| panic!("no {check} about {about}: {document:#}"))
}

fn wrongs(document: &Value) -> Vec<String> {
    let list = document["findings"].as_array().unwrap().iter().filter(|f| f["state"] == "wrong");
    list.map(|f| format!("{}: {}", f["check"].as_str().unwrap(), f["about"].as_str().unwrap_or_default()))
        .collect()
}

fn number(finding: &Value, name: &str) -> f64 {
    let list = finding["numbers"].as_array().unwrap();
    list.iter().find(|n| n["name"] == name).unwrap_or_else(|| panic!("no {name}: {finding:#}"))["value"]
        .as_f64()
        .unwrap()
}

/// Replaces the rotation of `T_BS` in a sensor's file.
fn turn_camera(folder: &Path, change: impl Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>) {
    let path = folder.join("mav0/cam0/sensor.yaml");
    let text = fs::read_to_string(&path).unwrap();
    let from = text.find("data:").map(|i| i + text[i..].find('[').unwrap() + 1).unwrap();
    let to = from + text[from..].find(']').unwrap();
    let mut m: Vec<f64> = text[from..to].split(',').map(|n| n.trim().parse().unwrap()).collect();
    assert_eq!(m.len(), 16, "{text}");
    let matrix = nalgebra::Matrix3::from_fn(|i, k| m[4 * i + k]);
    let turned = change(UnitQuaternion::from_matrix(&matrix)).to_rotation_matrix();
    for (i, k) in (0..3).flat_map(|i| (0..3).map(move |k| (i, k))) {
        m[4 * i + k] = turned[(i, k)];
    }
    let list: Vec<String> = m.iter().map(ToString::to_string).collect();
    fs::write(&path, format!("{}{}{}", &text[..from], list.join(", "), &text[to..])).unwrap();
}

#[test]
fn the_extrinsics_of_a_rendered_flight_are_right_by_its_images() {
    let document = check(flight(), &[]);
    assert_eq!(wrongs(&document), [""; 0], "{document:#}");
    for source in ["imu", "ground-truth"] {
        let hand_eye = about(&document, "hand-eye", &format!("{source} / cam0"));
        assert_eq!(hand_eye["state"], "ok", "{hand_eye:#}");
        // Small images: what is left lies within twice the interval, and below what is worth a look.
        let (off, half) = (number(hand_eye, "off"), number(hand_eye, "half-of-95%-interval"));
        assert!(off < 1.0 && off < 2.0 * half, "{hand_eye:#}");
        assert!(number(hand_eye, "correlation-then") > 0.98, "{hand_eye:#}");
        let clock = about(&document, "clock", &format!("{source} / cam0"));
        assert_eq!(clock["state"], "ok", "{clock:#}");
        let (offset, half) = (number(clock, "offset"), number(clock, "half-of-95%-interval"));
        assert!(offset.abs() < 2.0 * half, "{clock:#}");
    }
    let scan = about(&document, "depth", "cam0 / cloud");
    assert_eq!(scan["state"], "ok", "{scan:#}");
}

#[test]
fn spoiled_extrinsics_are_found_by_what_they_are_off() {
    let folder = tempfile::tempdir().unwrap();
    let spoiled = |name: &str, change: &dyn Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>| {
        let path = folder.path().join(name);
        copy(flight(), &path);
        turn_camera(&path, change);
        about(&check(&path, &[]), "hand-eye", "imu / cam0").clone()
    };
    let inverse = spoiled("inverse", &|r| r.inverse());
    assert!(
        inverse["state"] == "wrong" && inverse["says"].as_str().unwrap().contains("inverse"),
        "{inverse:#}"
    );
    for (name, axis) in [("x", [1.0, 0.0, 0.0]), ("y", [0.0, 1.0, 0.0]), ("z", [0.0, 0.0, 1.0])] {
        let axis = nalgebra::Vector3::from(axis);
        let off = spoiled(name, &|r| r * UnitQuaternion::from_scaled_axis(axis * 6_f64.to_radians()));
        assert_eq!(off["state"], "wrong", "{name}: {off:#}");
        assert!((number(&off, "off") - 6.0).abs() < 0.8, "{name}: {off:#}");
    }
}

/// Turns what the gyroscope and the accelerometer measure: the IMU is screwed on otherwise, and the camera hence lies otherwise
/// in the body, with the extrinsics as they were.
fn turn_imu(folder: &Path, turn: UnitQuaternion<f64>) {
    let list = folder.join("mav0/imu0/data.csv");
    let text = fs::read_to_string(&list).unwrap();
    let rows: Vec<String> = text
        .lines()
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            if line.starts_with('#') || fields.len() != 7 {
                return line.to_string();
            }
            let numbers: Vec<f64> = fields[1..].iter().map(|f| f.trim().parse().unwrap()).collect();
            let turned = |k: usize| turn * nalgebra::Vector3::from_column_slice(&numbers[k..k + 3]);
            let (gyro, accel) = (turned(0), turned(3));
            let all: Vec<String> = gyro.iter().chain(accel.iter()).map(ToString::to_string).collect();
            format!("{},{}", fields[0], all.join(","))
        })
        .collect();
    fs::remove_file(&list).unwrap();
    fs::write(&list, rows.join("\n") + "\n").unwrap();
}

#[test]
fn a_camera_that_moved_since_an_earlier_recording_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("knocked");
    copy(flight(), &path);
    turn_imu(&path, UnitQuaternion::from_euler_angles(0.0, 6_f64.to_radians(), 0.0));
    let before = flight().to_str().unwrap();
    let same = check(flight(), &["--before", before]);
    assert_eq!(about(&same, "moved", "cam0")["state"], "ok", "{same:#}");
    let knocked = check(&path, &["--before", before]);
    let moved = about(&knocked, "moved", "cam0");
    assert_eq!(moved["state"], "wrong", "{moved:#}");
    assert!((number(moved, "turned") - 6.0).abs() < 0.8, "{moved:#}");
    let run = vice(&["check", before, "--before", before]);
    assert!(run.code == 2 && run.stderr.contains("--images"), "{}", run.stderr);
}

#[test]
fn a_camera_that_is_late_is_found_by_its_images() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("late");
    copy(flight(), &path);
    let list = path.join("mav0/cam0/data.csv");
    let text = fs::read_to_string(&list).unwrap();
    let rows: Vec<String> = text
        .lines()
        .map(|line| match line.split_once(',') {
            Some((stamp, rest)) if !line.starts_with('#') => {
                format!("{},{rest}", stamp.trim().parse::<i64>().unwrap() + 60_000_000)
            }
            _ => line.to_string(),
        })
        .collect();
    // A new file: the old one may be linked.
    fs::remove_file(&list).unwrap();
    fs::write(&list, rows.join("\n") + "\n").unwrap();
    let (right, document) = (check(flight(), &[]), check(&path, &[]));
    for source in ["imu", "ground-truth"] {
        let clock = about(&document, "clock", &format!("{source} / cam0"));
        let before = about(&right, "clock", &format!("{source} / cam0"));
        assert_eq!(clock["state"], "wrong", "{clock:#}");
        // Within 2 ms of what no offset gives, as for poses.
        let moved = number(clock, "offset") - number(before, "offset");
        assert!((moved + 60.0).abs() < 2.0, "{before:#} {clock:#}");
        assert!(clock["mend"].as_str().unwrap().starts_with("`time-offset` 0.0"), "{clock:#}");
        // The rotation is known all the same.
        let hand_eye = about(&document, "hand-eye", &format!("{source} / cam0"));
        assert_eq!(hand_eye["state"], "ok", "{hand_eye:#}");
    }
}

#[test]
fn nothing_is_called_wrong_in_real_images_that_is_not() {
    for (path, hand_eye) in [
        ("euroc_v1_01", Some("imu / cam0")),
        // Hardly any motion, and tags that place the camera with noise: nothing is said.
        ("visp_tags_rgbd", None),
        ("hololens_rgbd", Some("ground-truth / cam0")),
        ("chess_opencv", None),
    ] {
        let Some(data) = shared(&format!("data/{path}")) else { return };
        let document = check(&data, &[]);
        assert_eq!(wrongs(&document), [""; 0], "{path}: {document:#}");
        if let Some(subject) = hand_eye {
            let found = about(&document, "hand-eye", subject);
            assert_eq!(found["state"], "ok", "{path}: {found:#}");
        }
    }
}

#[test]
fn stereo_cameras_of_a_real_flight_lie_as_their_extrinsics_say_and_spoiled_ones_do_not() {
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let found = about(&check(&data, &[]), "cameras", "cam0 / cam1").clone();
    assert_eq!(found["state"], "ok", "{found:#}");
    assert!(number(&found, "off") < 0.5 && number(&found, "direction-off") < 8.0, "{found:#}");
    // Each camera's extrinsics given to the other.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("swapped");
    copy(&data.join("mav0"), &path.join("mav0"));
    let file = |camera: &str| path.join(format!("mav0/{camera}/sensor.yaml"));
    let place = |text: &str| {
        let from = text.find('[').unwrap();
        (from, from + text[from..].find(']').unwrap())
    };
    let texts = ["cam0", "cam1"].map(|c| fs::read_to_string(file(c)).unwrap());
    for (k, camera) in ["cam0", "cam1"].into_iter().enumerate() {
        let (own, other) = (&texts[k], &texts[1 - k]);
        let ((from, to), (a, b)) = (place(own), place(other));
        fs::remove_file(file(camera)).unwrap();
        fs::write(file(camera), format!("{}{}{}", &own[..from], &other[a..b], &own[to..])).unwrap();
    }
    let found = about(&check(&path, &[]), "cameras", "cam0 / cam1").clone();
    assert_eq!(found["state"], "wrong", "{found:#}");
    assert!(number(&found, "direction-off") > 150.0, "{found:#}");
}
