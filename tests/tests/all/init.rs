//! A newcomer's way: a folder that nobody described, `vice init`, and the first number.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::Value;
use vice_tests::{shared, vice};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    found.sort();
    found
}

/// What is left of a recording where somebody exported its images: their names count, the poses are a TUM file, the
/// calibration is Kalibr's.
pub(crate) fn plain(recording: &Path, folder: &Path, poses: &str) {
    for (from, to) in [("cam0", "images"), ("depth0", "depth")] {
        fs::create_dir_all(folder.join(to)).unwrap();
        for (number, file) in files(&recording.join("mav0").join(from).join("data")).iter().enumerate() {
            let ending = file.extension().unwrap().to_str().unwrap();
            fs::copy(file, folder.join(to).join(format!("{number:04}.{ending}"))).unwrap();
        }
    }
    let run = vice(&["convert", text(recording), "--to", "tum", text(&folder.join(poses))]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let sensor = fs::read_to_string(recording.join("mav0/cam0/sensor.yaml")).unwrap();
    let line = |key: &str| {
        let found = sensor.lines().find_map(|l| l.strip_prefix(key)).unwrap();
        found.trim().to_string()
    };
    let chain = format!(
        "cam0:\n  camera_model: pinhole\n  intrinsics: {}\n  distortion_model: radtan\n  distortion_coeffs: {}\n  \
         resolution: {}\n  rostopic: /cam0/image_raw\n",
        line("intrinsics:"),
        line("distortion_coefficients:"),
        line("resolution:")
    );
    fs::write(folder.join("camchain.yaml"), chain).unwrap();
}

fn json(args: &[&str]) -> Value {
    let run = vice(args);
    assert_eq!(run.code, 0, "{args:?}: {}{}", run.stdout, run.stderr);
    serde_json::from_str(&run.stdout).unwrap()
}

#[test]
fn a_plain_folder_gives_the_numbers_of_the_recording_it_was_made_of() {
    let Some(recording) = shared("data/hololens_rgbd") else { return };
    let below = tempfile::tempdir().unwrap();
    let folder = below.path().join("robot");
    plain(&recording, &folder, "poses.txt");
    let before = vice(&["info", text(&folder)]);
    assert!(before.code != 0 && before.stderr.contains("vice init"), "{}", before.stderr);
    let start = Instant::now();
    let found = json(&["init", text(&folder), "--json"]);
    assert_eq!(found["unknown"].as_array().unwrap().len(), 0, "{found}");
    assert!(found["guessed"].to_string().contains("as many rows as there are pictures"), "{found}");
    let again = vice(&["init", text(&folder)]);
    assert!(again.code == 2 && again.stderr.contains("exists already"), "{}", again.stderr);
    assert_eq!(vice(&["init", text(&folder), "--force", "-q"]).code, 0);
    let check = vice(&["check", text(&folder)]);
    assert!([0, 3].contains(&check.code), "{}{}", check.stdout, check.stderr);
    let labels = below.path().join("L.csv");
    let track = [
        "labels",
        "track",
        text(&folder),
        "--points",
        "6",
        "--depth",
        "zcam",
        "--duration",
        "6",
        "--out",
        text(&labels),
    ];
    let run = vice(&track);
    assert_eq!(run.code, 0, "{}", run.stderr);
    // No estimate is named: those of the folder are taken.
    let own = json(&["evaluate", text(&folder), "--labels", text(&labels), "--depth", "zcam", "--json", "-"]);
    eprintln!("from a plain folder to the first number: {:.1} s", start.elapsed().as_secs_f64());
    let theirs = [
        "evaluate",
        text(&recording),
        "--labels",
        text(&labels),
        "--depth",
        "zcam",
        "--json",
        "-",
        "--estimate",
    ];
    let theirs = json(&[&theirs[..], &[text(&folder.join("poses.txt"))]].concat());
    let rmse = |document: &Value, stream: &str| -> Value {
        let parts = document["pixel"].as_array().unwrap();
        parts.iter().find(|p| p["stream"] == stream).unwrap_or_else(|| panic!("{stream}"))["pooled_rmse_px"]
            .clone()
    };
    assert!(rmse(&own, "poses").to_string().len() > 5, "{own}");
    assert_eq!(rmse(&own, "poses"), rmse(&theirs, "poses"));
}

/// Labels without a hand, the poses as ground truth by their name, and no edit by hand.
#[test]
fn labels_without_a_hand_on_a_folder_that_init_described() {
    let Some(recording) = shared("data/hololens_rgbd") else { return };
    let below = tempfile::tempdir().unwrap();
    let folder = below.path().join("robot");
    plain(&recording, &folder, "groundtruth.txt");
    let start = Instant::now();
    assert_eq!(vice(&["init", text(&folder)]).code, 0);
    let run = vice(&["evaluate", text(&folder), "--labels", "auto:6", "--depth", "zcam", "--duration", "6"]);
    assert!(run.code == 0 && run.stdout.contains("RMSE_2D"), "{}{}", run.stdout, run.stderr);
    eprintln!("init and evaluate --labels auto: {:.1} s", start.elapsed().as_secs_f64());
}

/// A folder of eight images of 8 x 4 px with stamps in their names, for mistakes.
fn small(folder: &Path, name: &dyn Fn(usize) -> String) {
    fs::create_dir_all(folder.join("images")).unwrap();
    let image =
        vice_core::dataset::Image::new(8, 4, vice_core::dataset::PixelFormat::Gray8, vec![9; 32]).unwrap();
    let png = vice_files::image_file::encode_png(&image).unwrap();
    for i in 0..8 {
        fs::write(folder.join("images").join(name(i)), &png).unwrap();
    }
    let camera = "cam0:\n  camera_model: pinhole\n  intrinsics: [6, 6, 3.5, 1.5]\n  distortion_model: none\n  resolution: [8, 4]\n";
    fs::write(folder.join("camchain.yaml"), camera).unwrap();
}

#[test]
fn what_cannot_be_known_is_asked_for_and_a_rate_fills_it_in() {
    let below = tempfile::tempdir().unwrap();
    let folder = below.path();
    small(folder, &|i| format!("frame{i}.png"));
    let run = vice(&["init", text(folder)]);
    assert!(run.stdout.contains("fps of cam0: nothing says"), "{}", run.stdout);
    let run = vice(&["info", text(folder)]);
    assert!(
        run.code == 1 && run.stderr.contains("vice.toml") && run.stderr.contains("fill in fps"),
        "{}",
        run.stderr
    );
    let run = vice(&["info", text(folder), "--set", "fps=10"]);
    assert!(run.stdout.contains("8, 10.0 Hz on average"), "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("cam0: 8x4, pinhole"), "{}", run.stdout);
    assert_eq!(vice(&["init", text(folder), "--force", "--fps", "4"]).code, 0);
    let run = vice(&["info", text(folder)]);
    assert!(run.stdout.contains("8, 4.0 Hz on average"), "{}{}", run.stdout, run.stderr);
    let toml = fs::read_to_string(folder.join("vice.toml")).unwrap();
    assert!(
        toml.contains("[images.cameras.cam0]") && toml.contains("calibration = \"camchain.yaml\""),
        "{toml}"
    );
}

/// Each mistake is one line with the file, and with what to do.
#[test]
fn mistakes_of_a_folder_are_one_line_each() {
    let below = tempfile::tempdir().unwrap();
    let folder = below.path();
    small(folder, &|i| format!("{}.png", 1_700_000_000_000_000_000_i64 + i as i64 * 100_000_000));
    assert_eq!(vice(&["init", text(folder)]).code, 0);
    let toml = fs::read_to_string(folder.join("vice.toml")).unwrap();
    let fails = |words: &[&str]| {
        let run = vice(&["floor", "fit", text(folder), "--at", "0"]);
        let line = run
            .stderr
            .lines()
            .find(|l| l.contains("error"))
            .unwrap_or_else(|| panic!("{}", run.stderr))
            .to_string();
        assert!(run.code == 1 || run.code == 2, "{}", run.stderr);
        for word in words {
            assert!(line.contains(word), "{word}: {line}");
        }
    };
    let write = |text: &str| fs::write(folder.join("vice.toml"), text).unwrap();
    // A key that is not known, with its line.
    write(&format!("calibraton = \"x\"\n{toml}"));
    fails(&["vice.toml:1", "`calibraton` is not known"]);
    write(&toml.replace("folder = \"images\"", "foldr = \"images\""));
    fails(&["vice.toml:", "foldr"]);
    // A calibration of another size.
    write(&toml);
    let chain = fs::read_to_string(folder.join("camchain.yaml")).unwrap();
    fs::write(folder.join("camchain.yaml"), chain.replace("[8, 4]", "[16, 8]")).unwrap();
    fails(&["camchain.yaml", "16x8", "8x4"]);
    fs::write(folder.join("camchain.yaml"), &chain).unwrap();
    // A file that is not there.
    write(&format!("cloud = \"scan.ply\"\n{toml}"));
    fails(&["scan.ply", "no such file"]);
    // A list that has too few stamps, and one with a stamp twice.
    let list = toml.replace("names = \"nanoseconds\"", "list = \"times.txt\"");
    write(&list);
    fs::write(folder.join("times.txt"), "0.0\n0.1\n").unwrap();
    let run = vice(&["info", text(folder)]);
    assert!(run.stderr.contains("times.txt: 2 stamps for the 8 pictures"), "{}{}", run.stdout, run.stderr);
    let rows: String = (0..8).map(|i| format!("{}\n", f64::from(i.min(6)) / 10.0)).collect();
    fs::write(folder.join("times.txt"), rows).unwrap();
    let run = vice(&["info", text(folder)]);
    assert!(run.stderr.contains("times.txt:8: ") && run.stderr.contains("appears twice"), "{}", run.stderr);
    fs::remove_file(folder.join("times.txt")).unwrap();
    // A depth image of another size.
    fs::create_dir_all(folder.join("depth")).unwrap();
    let depth =
        vice_core::dataset::DepthImage::new(vice_core::time::Stamp::default(), 4, 4, vec![1500.0; 16])
            .unwrap();
    let png = vice_files::image_file::encode_depth_png(&depth, 1.0).unwrap();
    for file in files(&folder.join("images")) {
        fs::write(folder.join("depth").join(file.file_name().unwrap()), &png).unwrap();
    }
    assert_eq!(vice(&["init", text(folder), "--force"]).code, 0);
    fails(&["depth", "4x4", "8x4", "registered"]);
}

#[test]
fn a_vice_toml_is_honoured_beside_any_format() {
    let Some(recording) = shared("data/euroc_v1_01") else { return };
    let below = tempfile::tempdir().unwrap();
    let folder = below.path().join("V1");
    fs::create_dir(&folder).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(recording.join("mav0"), folder.join("mav0")).unwrap();
    assert_eq!(vice(&["init", text(&folder)]).code, 0);
    let convert = vice(&["convert", text(&folder), "--to", "tum", text(&folder.join("slam.txt"))]);
    assert_eq!(convert.code, 0, "{}", convert.stderr);
    fs::write(
        folder.join("vice.toml"),
        "floor = [0, 0, 1, -0.5]\ntime_offset_s = 0.25\n[streams]\nslam = \"slam.txt\"\n[labels]\nfile = \"labels.csv\"\n",
    )
    .unwrap();
    fs::copy(recording.join("labels/board.csv"), folder.join("labels.csv")).unwrap();
    let info = vice(&["info", text(&folder)]);
    assert!(
        info.stdout.contains("z + -0.5000 m = 0 in the world") && info.stdout.contains("slam: "),
        "{}",
        info.stdout
    );
    let run = vice(&["evaluate", text(&folder), "--json", "-"]);
    let document: Value = serde_json::from_str(&run.stdout).unwrap_or_else(|_| panic!("{}", run.stderr));
    assert_eq!(document["used"]["time_offset_s"], 0.25, "{}", document["used"]);
    assert_eq!(document["request"]["streams"]["estimates"], serde_json::json!(["slam"]));
}
