//! Results through a plugin are byte for byte those of the format built in, but for the plugin that the request names.

use std::path::Path;

use vice_core::dataset::{DatasetFactory, GROUND_TRUTH, OpenOptions};
use vice_core::error::one_line;
use vice_host::{LoadOptions, Plugin};
use vice_tests::{plugin, shared, vice};

use crate::plugin_check::small_euroc;
use crate::plugin_hostile::text;

/// Evaluates with and without the plugin and compares the documents.
fn same(format: &str, dataset: &Path, more: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let library = plugin(format);
    let run = |name: &str, plugin: &[&str]| {
        let out = folder.path().join(name);
        let args = ["evaluate", text(dataset), "--json", text(&out)];
        let run = vice(&[&args[..], more, plugin].concat());
        assert_eq!(run.code, 0, "{format} {name}: {}{}", run.stdout, run.stderr);
        (std::fs::read_to_string(&out).unwrap(), run.stderr)
    };
    let (built_in, said) = run("built_in.json", &[]);
    let (through, said_through) = run("through.json", &["--plugin", text(&library)]);
    let named = format!(",\"plugins\":{{\"files\":[\"{}\"],\"allow_writable\":false}}", text(&library));
    assert!(through.contains(&named), "{format}: the request does not name the plugin");
    let through = through.replacen(&named, "", 1);
    assert!(built_in.len() > 1000);
    assert!(built_in == through, "{format}: the documents differ");
    assert_eq!(said, said_through, "{format}: the warnings differ");
}

#[test]
fn euroc_through_its_plugin() {
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let labels = data.join("labels/floor.csv");
    let estimates = format!("imu-euler,{}", data.join("estimates/imu_euler.txt").display());
    let args = ["--labels", text(&labels), "--estimate", &estimates, "--depth", "floor,zmap"];
    same("euroc", &data, &args);
}

#[test]
fn blackbird_through_its_plugin() {
    let Some(data) = shared("data/blackbird") else { return };
    let labels = data.join("labels.csv");
    let flight = data.join("picasso/yawForward/maxSpeed1p0");
    same(
        "blackbird",
        &flight,
        &["--labels", text(&labels), "--estimate", "imu-euler", "--depth", "floor,zcam"],
    );
}

#[test]
fn locobot_through_its_plugin() {
    let Some(data) = shared("data/locobot") else { return };
    let labels = data.join("labels.csv");
    for recording in ["locobot_ros1.bag", "locobot_ros2_mcap"] {
        let args = ["--labels", text(&labels), "--estimate", "odom,slam", "--depth", "floor,zcam"];
        same("locobot", &data.join(recording), &args);
    }
}

#[test]
fn information_and_images_through_plugins() {
    for (format, path) in [
        ("euroc", "data/euroc_v1_01"),
        ("blackbird", "data/blackbird/picasso/yawForward/maxSpeed1p0"),
        ("locobot", "data/locobot/locobot_ros1_compressed.bag"),
    ] {
        let Some(path) = shared(path) else { return };
        let library = plugin(format);
        let more = ["--plugin", text(&library)];
        let (built_in, through) =
            (vice(&["info", text(&path)]), vice(&[&["info", text(&path)], &more[..]].concat()));
        assert_eq!((built_in.code, through.code), (0, 0), "{format}: {}", through.stderr);
        assert_eq!(built_in.stdout, through.stdout, "{format}");
    }
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let library = plugin("euroc");
    let depth = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let args =
            ["depth", text(&data), "--at", "1403715280562142976", "--depth", "floor", "--out", text(&out)];
        let run = vice(&[&args[..], more].concat());
        assert_eq!(run.code, 0, "{}", run.stderr);
        ["image.png", "floor.npy"].map(|f| std::fs::read(out.join(f)).unwrap())
    };
    assert!(depth("built_in", &[]) == depth("through", &["--plugin", text(&library)]));
}

/// What figures do not show: stored images, suspicions, and errors with their kind and hint.
#[test]
fn nothing_is_lost_on_the_way() {
    let folder = tempfile::tempdir().unwrap();
    small_euroc(folder.path());
    // A row twice, which is left out and said.
    let list = folder.path().join("mav0/state_groundtruth_estimate0/data.csv");
    let rows = std::fs::read_to_string(&list).unwrap();
    let last = rows.lines().last().unwrap();
    std::fs::write(&list, format!("{rows}{last}\n")).unwrap();
    let loaded = Plugin::load(plugin("euroc"), &LoadOptions { allow_writable: true }).unwrap();
    let formats: [&dyn DatasetFactory; 2] = [&vice_euroc::Euroc, &loaded];
    let options = OpenOptions::default();
    let [built_in, through] = formats.map(|f| f.open(folder.path(), &options).unwrap());
    let file = built_in.image_file("cam0", 0).unwrap().unwrap();
    assert_eq!(through.image_file("cam0", 0).unwrap(), Some(file));
    let [one, two] = [&built_in, &through].map(|d| d.trajectory(GROUND_TRUTH).unwrap());
    assert_eq!((one.stamps(), one.poses()), (two.stamps(), two.poses()));
    let suspicions = built_in.suspicions();
    assert!(!suspicions.is_empty());
    assert_eq!(through.suspicions(), suspicions);
    assert_eq!(through.checks(), built_in.checks());
    for path in ["/no/such/folder", folder.path().join("mav0/cam0/data").to_str().unwrap()] {
        let [one, two] = formats.map(|f| f.open(Path::new(path), &options).err().unwrap());
        assert_eq!(
            (one.kind(), one.hint_text(), one_line(&one)),
            (two.kind(), two.hint_text(), one_line(&two))
        );
    }
    let odd = OpenOptions { settings: [("no-such".to_string(), "1".to_string())].into() };
    let [one, two] = formats.map(|f| f.open(folder.path(), &odd).err());
    assert_eq!(one.as_ref().map(|e| (e.kind(), one_line(e))), two.as_ref().map(|e| (e.kind(), one_line(e))));
}
