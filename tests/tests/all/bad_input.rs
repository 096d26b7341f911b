//! Bad input is normal: one clear line on standard error, a non-zero exit, nothing under the final name.

use std::fs;
use std::path::{Path, PathBuf};

use vice_tests::{Run, vice};

const FRAMES: [i64; 5] =
    [1403715280562142976, 1403715280612143104, 1403715280662142976, 1403715280712143104, 1403715280762142976];

/// A small sequence in the EuRoC layout whose images are empty files: evaluating decodes none.
struct Sequence {
    folder: tempfile::TempDir,
    results: tempfile::TempDir,
}

impl Sequence {
    fn new() -> Self {
        let s = Self { folder: tempfile::tempdir().unwrap(), results: tempfile::tempdir().unwrap() };
        fs::create_dir_all(s.path("mav0/cam0/data")).unwrap();
        fs::create_dir_all(s.path("mav0/state_groundtruth_estimate0")).unwrap();
        s.write("mav0/cam0/sensor.yaml", &sensor("458.654", "radial-tangential"));
        let names: Vec<String> = FRAMES.iter().map(|f| format!("{f},{f}.png\r\n")).collect();
        s.write("mav0/cam0/data.csv", &format!("#timestamp [ns],filename\r\n{}", names.concat()));
        for f in FRAMES {
            s.write(&format!("mav0/cam0/data/{f}.png"), "");
        }
        s.write("mav0/state_groundtruth_estimate0/data.csv", &truth(1));
        s.write("labels.csv", &labels(0));
        s.write("estimate.txt", &tum(""));
        s
    }

    fn path(&self, relative: &str) -> PathBuf {
        self.folder.path().join(relative)
    }

    /// Where the result document goes: not into the data that is read.
    fn document(&self) -> PathBuf {
        self.results.path().join("out.json")
    }

    fn write(&self, relative: &str, text: &str) {
        fs::write(self.path(relative), text).unwrap();
    }

    /// Evaluates with further options.
    fn evaluate(&self, more: &[&str]) -> Run {
        let text = |p: PathBuf| p.to_str().unwrap().to_string();
        let mut args = vec![
            "evaluate".to_string(),
            text(self.path("")),
            "--labels".into(),
            text(self.path("labels.csv")),
        ];
        if !more.contains(&"--estimate") {
            args.extend(["--estimate".to_string(), text(self.path("estimate.txt"))]);
        }
        args.extend(["--json".to_string(), text(self.document())]);
        args.extend(more.iter().map(|m| (*m).to_string()));
        vice(&args)
    }

    /// It fails with one line that holds all the words, and leaves no document.
    fn fails(&self, more: &[&str], words: &[&str]) {
        refused(&self.evaluate(more), words);
        assert!(!self.document().exists(), "a document was left");
    }
}

fn refused(run: &Run, words: &[&str]) {
    assert!(run.code == 1 || run.code == 2, "exit {}: {}{}", run.code, run.stdout, run.stderr);
    let errors: Vec<&str> = run.stderr.lines().filter(|l| l.starts_with("error")).collect();
    assert_eq!(errors.len(), 1, "{}", run.stderr);
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "`{word}` is not in: {}", run.stderr);
    }
}

fn sensor(fu: &str, distortion: &str) -> String {
    format!(
        "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, 0.0,\n    -1.0, 0.0, 0.0, 0.0,\n    \
         0.0, 0.0, -1.0, 0.0,\n    0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\n\
         intrinsics: [{fu}, 457.296, 367.215, 248.375]\ndistortion_model: {distortion}\n\
         distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]\n"
    )
}

/// Two metres over the floor, the camera looking straight down.
fn truth(divide: i64) -> String {
    let row = |(i, f): (usize, &i64)| format!("{},{},0.0,2.0,1.0,0.0,0.0,0.0\n", f / divide, 0.01 * i as f64);
    format!("#timestamp\n{}", FRAMES.iter().enumerate().map(row).collect::<String>())
}

fn tum(last_row: &str) -> String {
    let row = |(i, f): (usize, &i64)| {
        format!("{}.{:09} {} 0 2 0 0 0 1\n", f / 1_000_000_000, f % 1_000_000_000, 0.011 * i as f64)
    };
    format!("# t x y z qx qy qz qw\n{}{last_row}", FRAMES.iter().enumerate().map(row).collect::<String>())
}

fn labels(later_ns: i64) -> String {
    let mut text = "point,timestamp_ns,u_px,v_px,keyframe\n".to_string();
    for point in 0..2 {
        for (i, f) in FRAMES.iter().enumerate() {
            let (u, v) = (300 + 50 * point, 200 + 2 * i);
            text += &format!("{point},{},{u},{v},{}\n", f + later_ns, u8::from(i == 0));
        }
    }
    text
}

#[test]
fn the_sequence_itself_is_good() {
    let s = Sequence::new();
    let run = s.evaluate(&[]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(s.document().exists());
}

#[test]
fn missing_and_empty_files() {
    let s = Sequence::new();
    let missing = |relative: &str| fs::remove_file(s.path(relative)).unwrap();
    s.fails(&["--estimate", "no/such.txt"], &["no/such.txt", "ground-truth", "imu-euler"]);
    s.fails(&["--estimate", "imu-euler"], &["no inertial samples"]);
    s.write("labels.csv", "");
    s.fails(&[], &["labels.csv"]);
    missing("labels.csv");
    s.fails(&[], &["labels.csv"]);
    s.write("labels.csv", &labels(0));
    s.write("estimate.txt", "");
    s.fails(&[], &["estimate.txt"]);
    s.write("estimate.txt", "# nothing\n");
    s.fails(&[], &["estimate.txt"]);
    s.write("estimate.txt", &tum(""));
    s.write("mav0/cam0/data.csv", "");
    s.fails(&[], &["data.csv"]);
    missing("mav0/cam0/data.csv");
    s.fails(&[], &["data.csv"]);
    refused(&vice(&["info", "no/such/folder"]), &["no/such/folder", "no such file or folder"]);
    let empty = tempfile::tempdir().unwrap();
    refused(&vice(&["info", empty.path().to_str().unwrap()]), &["no format recognises"]);
}

#[test]
fn rows_that_are_no_poses_name_their_line() {
    let s = Sequence::new();
    let last = "1403715280.762142976";
    for (row, words) in [
        ("1403715280.8 0 inf 2 0 0 0 1\n", ["estimate.txt:7", "inf"]),
        ("1403715280.8 0 0 2 0 0 0 1.1\n", ["estimate.txt:7", "length"]),
        ("1403715280.1 0 0 2 0 0 0 1\n", ["estimate.txt:7", "earlier"]),
        ("1403715280.8 0 0 2\n", ["estimate.txt:7", "column"]),
    ] {
        s.write("estimate.txt", &tum(row));
        s.fails(&[], &words);
    }
    // What the field writes all the same is left out, and said.
    for (row, words) in [
        ("1403715280.8 nan 0 2 0 0 0 1\n".to_string(), ["rows-left-out", "1 of 6 rows"]),
        (format!("{last} 0 0 2 0 0 0 1\n"), ["duplicate-stamps", "1 of 6 rows"]),
    ] {
        s.write("estimate.txt", &tum(&row));
        let run = s.evaluate(&[]);
        assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
        let document = fs::read_to_string(s.document()).unwrap();
        for word in words {
            assert!(document.contains(word), "`{word}` is not in: {document}");
        }
    }
}

#[test]
fn units_of_time_are_suspected() {
    let s = Sequence::new();
    for (divide, unit) in [(1_000, "microseconds"), (1_000_000, "milliseconds")] {
        s.write("estimate.csv", &truth(divide));
        let estimate = s.path("estimate.csv");
        s.fails(&["--estimate", estimate.to_str().unwrap()], &[unit]);
    }
    // Another flight altogether: both ranges are shown.
    let other: String = tum("").replace("1403715280.", "1503715280.");
    s.write("estimate.txt", &other);
    s.fails(&[], &["do not overlap", "1503715280562142976", "1403715280562142976"]);
}

#[test]
fn labels_that_do_not_fit() {
    let s = Sequence::new();
    s.write("labels.csv", &labels(0).replace(",300,200,", ",752.5,200,"));
    s.fails(&[], &["labels.csv", "line 2", "outside the 752x480 image"]);
    s.write("labels.csv", &labels(5));
    s.fails(&[], &["labels.csv", "none of the labels is at a frame"]);
    s.write("labels.csv", &labels(0).replace(",300,200,", ",x,200,"));
    s.fails(&[], &["labels.csv:2"]);
    s.write("labels.csv", &format!("{}0,{},300,200,0\n", labels(0), FRAMES[1]));
    s.fails(&[], &["labels.csv:12", "twice"]);
    s.write("labels.csv", &labels(0));
    s.fails(&["--subsets", "3"], &["subsets of 3", "2 points"]);
    s.fails(&["--points", "7"], &["no point 7", "0, 1"]);
    s.fails(&["--start", "100"], &["--start"]);
}

#[test]
fn calibrations_that_cannot_be() {
    let s = Sequence::new();
    s.write("mav0/cam0/sensor.yaml", &sensor("-458.654", "radial-tangential"));
    s.fails(&[], &["sensor.yaml", "-458.654", "not positive"]);
    s.write("mav0/cam0/sensor.yaml", &sensor("458.654", "omni-directional"));
    s.fails(&[], &["sensor.yaml", "omni-directional"]);
    s.write("mav0/cam0/sensor.yaml", &sensor("458.654", "radial-tangential"));
    s.write("wrong.toml", "[cam0]\nintrinsics = [-1.0, 1.0, 0.0, 0.0]\n");
    let wrong = s.path("wrong.toml");
    s.fails(&["--calibration", wrong.to_str().unwrap()], &["wrong.toml", "not positive"]);
}

#[test]
fn image_names_do_not_leave_their_folder() {
    let s = Sequence::new();
    let with = |name: &str| format!("#timestamp [ns],filename\n{},{name}\n", FRAMES[0]);
    for name in ["../../../secret.png", "/etc/passwd"] {
        s.write("mav0/cam0/data.csv", &with(name));
        s.fails(&[], &["data.csv:2", name]);
    }
    #[cfg(unix)]
    {
        s.write("secret.png", "");
        std::os::unix::fs::symlink(s.path("secret.png"), s.path("mav0/cam0/data/link.png")).unwrap();
        s.write("mav0/cam0/data.csv", &with("link.png"));
        s.fails(&[], &["data.csv:2", "link.png"]);
    }
}

#[test]
fn options_that_do_not_fit() {
    let s = Sequence::new();
    s.fails(&["--depth", "sonar"], &["sonar"]);
    s.fails(&["--depth", "zmap"], &["no point cloud"]);
    s.fails(&["--floor-plane", "0,0,0,1"], &["normal"]);
    s.fails(&["--floor-plane", "0,0,1"], &["4 numbers"]);
    s.fails(&["--align", "affine"], &["affine"]);
    s.fails(&["--reference", "none", "--anchor", "reference"], &["--anchor"]);
    s.fails(&["--camera", "cam7"], &["cam7", "cam0"]);
    s.fails(&["--max-skipped", "200"], &["max-skipped"]);
    s.fails(&["--fps", "0"], &["fps"]);
    s.fails(&["--set", "colour=red"], &["no setting `colour`"]);
    s.fails(&["--format", "betamax"], &["unknown format"]);
    let run = vice(&["evaluate"]);
    assert_eq!(run.code, 2);
}

#[test]
fn skips_above_the_threshold_exit_with_3_and_are_all_listed() {
    let s = Sequence::new();
    // The camera of the anchor looks up: no key frame meets the floor.
    s.write(
        "mav0/state_groundtruth_estimate0/data.csv",
        &truth(1).replace(",1.0,0.0,0.0,0.0", ",0.0,1.0,0.0,0.0"),
    );
    let run = s.evaluate(&[]);
    assert_eq!(run.code, 3, "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("keyframe-above-horizon"), "{}", run.stdout);
    let document: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(s.document()).unwrap()).unwrap();
    for part in document["pixel"].as_array().unwrap() {
        assert_eq!(part["skipped"].as_array().unwrap().len(), 8);
        assert!(part["pooled_rmse_px"].is_null() && part["scored"] == 0);
    }
    let tolerant = s.evaluate(&["--max-skipped", "100"]);
    assert_eq!(tolerant.code, 0);
}

#[test]
fn nothing_is_overwritten_unasked() {
    let s = Sequence::new();
    let path = |p: &str| s.path(p).to_str().unwrap().to_string();
    let run = vice(&["synth".to_string(), path("")]);
    refused(&run, &["not empty"]);
    s.write("taken.csv", "mine");
    refused(
        &vice(&["labels".to_string(), "convert".into(), path("labels.csv"), path("taken.csv")]),
        &["taken.csv", "--force"],
    );
    assert_eq!(fs::read_to_string(s.path("taken.csv")).unwrap(), "mine");
    let refuse_name = vice(&["labels".to_string(), "convert".into(), path("labels.csv"), path("labels.txt")]);
    refused(&refuse_name, &["labels.txt"]);
    refused(&s.evaluate(&["--csv", "no/such/folder/x.csv"]), &["no/such/folder"]);
}

#[test]
fn what_is_read_is_not_written_over() {
    let s = Sequence::new();
    let path = |p: &str| s.path(p).to_str().unwrap().to_string();
    let before = fs::read_to_string(s.path("labels.csv")).unwrap();
    refused(&s.evaluate(&["--csv", &path("labels.csv")]), &["labels.csv", "name a"]);
    refused(&s.evaluate(&["--csv", &path("estimate.txt")]), &["estimate.txt"]);
    refused(&s.evaluate(&["--csv", &path("mav0/new.csv")]), &["mav0/new.csv"]);
    refused(&s.evaluate(&["--csv", "same.x", "--latex", "same.x"]), &["same.x", "two outputs"]);
    assert_eq!(fs::read_to_string(s.path("labels.csv")).unwrap(), before);
    assert!(!s.document().exists());
}

#[test]
fn a_calibration_must_be_of_the_camera_and_its_images() {
    let s = Sequence::new();
    s.write("other.toml", "[cam5]\nintrinsics = [400.0, 400.0, 300.0, 200.0]\n");
    s.write("size.toml", "[cam0]\nresolution = [700, 400]\n");
    let path = |p: &str| s.path(p).to_str().unwrap().to_string();
    // One camera here and one there are the same, whatever they are called; of two the file has to tell.
    let named = s.evaluate(&["--calibration", &path("other.toml")]);
    assert_eq!(named.code, 0, "{}{}", named.stdout, named.stderr);
    fs::remove_file(s.document()).unwrap();
    s.write(
        "others.toml",
        "[cam5]\nintrinsics = [400.0, 400.0, 300.0, 200.0]\n[cam6]\nintrinsics = [1.0, 1.0, 0.0, 0.0]\n",
    );
    s.fails(&["--calibration", &path("others.toml")], &["cam5", "cam6", "cam0"]);
    s.fails(&["--calibration", &path("size.toml")], &["700x400", "752x480"]);
}

#[test]
fn chained_motions_alone_do_not_know_where_the_floor_is() {
    let s = Sequence::new();
    let second = |i: usize| format!("{}.{:09}", FRAMES[i] / 1_000_000_000, FRAMES[i] % 1_000_000_000);
    let rows: String =
        (1..5).map(|i| format!("{} {} -0.01 0 0 0 0 0 1\n", second(i - 1), second(i))).collect();
    s.write("motions.txt", &rows);
    let spec = format!("rel:{}", s.path("motions.txt").display());
    s.fails(&["--estimate", &spec, "--reference", "none"], &["--initial-pose"]);
    let placed = ["--estimate", &spec, "--reference", "none", "--initial-pose", "0,0,2,0,0,0,1"];
    let run = s.evaluate(&placed);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
}

#[test]
fn a_trajectory_without_a_match_says_both_ranges() {
    let s = Sequence::new();
    let path = |p: &str| s.path(p).to_str().unwrap().to_string();
    s.write("later.txt", &tum("").replace("1403715280.", "1403715999."));
    refused(
        &vice(&["trajectory".to_string(), path("estimate.txt"), path("later.txt")]),
        &["1403715280.562142976", "1403715999.562142976"],
    );
    refused(
        &vice(&[
            "trajectory".to_string(),
            path("estimate.txt"),
            path("estimate.txt"),
            "--delta".into(),
            "0".into(),
        ]),
        &["delta"],
    );
    assert!(Path::new(&path("later.txt")).exists());
}
