//! `vice plugin check` on plugins that end the process, hang or lose memory; the suite on every built-in format.

use std::fs;
use std::path::Path;
use std::process::Command;

use vice_core::dataset::{DatasetFactory, OpenOptions};
use vice_host::conformance::{Event, Subject, Thoroughness, Verdict, check};
use vice_tests::{compile_plugin, plugin, root, shared, vice, vice_program};

use crate::plugin_hostile::{Hostile, text};

#[test]
fn a_crash_is_a_line_of_the_report() {
    for (define, words) in [
        ("ABORTS", "it crashes (abort"),
        ("CRASHES", "it crashes (segmentation fault"),
        ("EXITS", "it ends the program with exit code 0 during: image"),
        ("LEAKS_FILES", "files are left open"),
        ("LEAKS", "memory grows by"),
    ] {
        let bad = Hostile::new(&[define]);
        let run = bad.check(&["--cycles", "400"]);
        assert_eq!(run.code, 1, "{define}: {}{}", run.stdout, run.stderr);
        let said = run.stdout.lines().any(|l| l.starts_with("FAULT") && l.contains(words));
        assert!(said, "{define}: {}{}", run.stdout, run.stderr);
    }
    let prints = Hostile::new(&["PRINTS"]).check(&[]);
    assert!(prints.stdout.contains("suspicious  it prints to standard output"), "{}", prints.stdout);
}

#[test]
fn what_hangs_is_ended() {
    let run = Hostile::new(&["HANGS"]).check(&["--timeout", "2"]);
    assert_eq!(run.code, 1);
    assert!(run.stdout.contains("FAULT       it hangs: no answer for 2 s during: image"), "{}", run.stdout);
}

#[test]
fn an_exception_that_leaves_a_call_ends_the_check_alone() {
    let folder = tempfile::tempdir().unwrap();
    let library = compile_plugin("throwing.cpp", &["RAW"], folder.path(), "throwing");
    let run = vice(&["plugin", "check", text(&library), text(folder.path())]);
    assert_eq!(run.code, 1, "{}{}", run.stdout, run.stderr);
    assert!(run.stdout.contains("FAULT       it crashes"), "{}", run.stdout);
}

#[test]
fn what_cannot_be_checked_is_wrong_usage() {
    let good = Hostile::new(&[]);
    let run = vice(&["plugin", "check", text(&good.library), "no/such/folder"]);
    assert_eq!(run.code, 2, "{}", run.stderr);
    assert!(run.stderr.contains("no such file or folder"), "{}", run.stderr);
}

/// No memory lost and nothing read that is not there, in a thousand times opening and closing.
#[test]
fn valgrind_finds_nothing() {
    if Command::new("valgrind").arg("--version").output().is_err() {
        assert!(std::env::var("VICE_REQUIRE_DATA").is_err(), "valgrind is missing");
        eprintln!("skipped: valgrind is missing");
        return;
    }
    let good = Hostile::new(&[]);
    let robot = tempfile::tempdir().unwrap();
    small_euroc(robot.path());
    for (library, data) in
        [(good.library.clone(), good.data()), (plugin("euroc"), robot.path().to_path_buf())]
    {
        let output = Command::new("valgrind")
            .args(["--quiet", "--leak-check=full", "--errors-for-leak-kinds=definite,indirect"])
            // Freed blocks are not kept for long, so that the suite's own look at memory is not misled.
            .arg("--freelist-vol=100000")
            .args(["--show-leak-kinds=definite,indirect", "--error-exitcode=77", "--num-callers=30"])
            .arg(vice_program())
            .args(["plugin", "check", text(&library), text(&data), "--cycles", "1000", "--as-child"])
            .output()
            .unwrap();
        let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{out}{err}");
        assert!(out.contains("opened and closed 1000 times") && !out.contains("fault "), "{out}");
    }
}

/// A sequence in the EuRoC layout that is read fast: two black images, a floor below.
pub(crate) fn small_euroc(folder: &Path) {
    let camera = folder.join("mav0/cam0");
    let truth = folder.join("mav0/state_groundtruth_estimate0");
    fs::create_dir_all(camera.join("data")).unwrap();
    fs::create_dir_all(&truth).unwrap();
    let stamps = [1403715280562142976_i64, 1403715280612143104];
    let mut list = "#timestamp [ns],filename\n".to_string();
    let mut poses = "#timestamp\n".to_string();
    for stamp in stamps {
        list += &format!("{stamp},{stamp}.png\n");
        poses += &format!("{stamp},0.0,0.0,2.0,1.0,0.0,0.0,0.0\n");
        fs::write(camera.join(format!("data/{stamp}.png")), PNG_8X4).unwrap();
    }
    fs::write(camera.join("data.csv"), list).unwrap();
    fs::write(truth.join("data.csv"), poses).unwrap();
    let sensor = "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [0.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, \
                  0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [8, 4]\ncamera_model: pinhole\n\
                  intrinsics: [6.0, 6.0, 3.5, 1.5]\ndistortion_model: radial-tangential\n\
                  distortion_coefficients: [0.0, 0.0, 0.0, 0.0]\n";
    fs::write(camera.join("sensor.yaml"), sensor).unwrap();
}

/// A black image of 8 x 4 px, 8 bit gray.
const PNG_8X4: &[u8] = b"\x89\x50\x4e\x47\x0d\x0a\x1a\x0a\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x08\x00\x00\x00\x04\x08\x00\x00\x00\x00\x96\xa6\x21\x2c\x00\x00\x00\x0b\x49\x44\x41\x54\x78\xda\x63\x60\x20\x0c\x00\x00\x24\x00\x01\x25\xc2\xa8\xe3\x00\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82";

/// Each format that is built in, on its shared data.
#[test]
fn built_in_formats_conform() {
    let euroc: (&dyn DatasetFactory, &str) = (&vice_euroc::Euroc, "data/euroc_v1_01");
    let formats = [
        euroc,
        (&vice_blackbird::Blackbird, "data/blackbird"),
        (&vice_locobot::Locobot, "data/locobot/locobot_ros1.bag"),
        (&vice_locobot::Locobot, "data/locobot/locobot_ros2_mcap"),
        (&vice_locobot::Locobot, "data/locobot/locobot_ros2_db3"),
    ];
    for (factory, path) in formats {
        let Some(path) = shared(path) else { return };
        let options = OpenOptions::default();
        let subject = Subject { factory, plugin: None, path: &path, options: &options };
        let thorough = Thoroughness { cycles: 10, images: 8, threads: 3, ..Thoroughness::default() };
        let mut said = Vec::new();
        let good = check(&subject, &thorough, &mut |event| {
            if let Event::Finding(verdict @ (Verdict::Fault | Verdict::Suspicious), text) = event {
                said.push((verdict, text));
            }
        });
        assert!(good && said.is_empty(), "{}: {said:#?}", path.display());
    }
}

/// The same through the plugins, as people run it.
#[test]
fn our_plugins_pass_their_check() {
    for (format, path) in [("euroc", "data/euroc_v1_01"), ("locobot", "data/locobot/locobot_ros2_mcap")] {
        let Some(path) = shared(path) else { return };
        let (library, path) = (plugin(format), path.to_str().unwrap().to_string());
        let args = ["plugin", "check", text(&library), &path, "--cycles", "20", "--images", "8"];
        let run = vice(&args);
        assert_eq!(run.code, 0, "{format}: {}{}", run.stdout, run.stderr);
        assert!(run.stdout.contains("0 suspicious, 0 faults"), "{}", run.stdout);
    }
}

/// The suite asks all that the trait has: a method that is added there is missed here.
#[test]
fn each_method_of_the_trait_is_asked() {
    let core = fs::read_to_string(root().join("vice-core/src/dataset/mod.rs")).unwrap();
    let methods = core.split("pub trait Dataset: ").nth(1).unwrap().split("\n}\n").next().unwrap();
    let methods: Vec<&str> =
        methods.split("\n    fn ").skip(1).map(|m| m.split('(').next().unwrap()).collect();
    assert!(methods.len() > 15 && methods.contains(&"suspicions"), "{methods:?}");
    let suite = suite();
    for method in methods {
        assert!(suite.contains(&format!("dataset.{method}(")), "the suite does not ask `{method}`");
    }
}

/// What the check advises can be done.
#[test]
fn options_that_the_check_names_exist() {
    let help: String = ["evaluate", "formats", "plugin check", "info"]
        .map(|c| vice(&[c.split(' ').collect(), vec!["--help"]].concat()).stdout)
        .concat();
    let suite = suite();
    let mut names: Vec<&str> = suite
        .match_indices("--")
        .map(|(at, _)| {
            let rest = &suite[at + 2..];
            &rest[..rest.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(rest.len())]
        })
        .filter(|name| !name.is_empty())
        .collect();
    names.sort_unstable();
    names.dedup();
    assert!(names.len() >= 4, "{names:?}");
    for name in names {
        let option =
            help.lines().any(|l| l.trim_start().split([' ', '=', ',']).any(|w| w == format!("--{name}")));
        assert!(option, "`--{name}` is advised, but no option");
    }
}

/// The source of the suite.
fn suite() -> String {
    let folder = root().join("adapters/plugin/host/src/conformance");
    let files = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    files.map(|f| fs::read_to_string(f).unwrap()).collect()
}
