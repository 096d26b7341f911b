//! A foreign plugin: the TUM RGB-D example in C++, built with the system's compiler, against the oracle.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;
use vice_tests::{Run, root, shared, shared_json, vice};

/// The example as a library, built once.
fn library() -> &'static Path {
    static BUILT: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, library) = BUILT.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let library = folder.path().join("libtum_rgbd.so");
        let output = Command::new("make")
            .arg("-C")
            .arg(root().join("adapters/plugin/examples/tum_rgbd_cpp"))
            .arg(format!("OUT={}", library.display()))
            .arg("CXXFLAGS=-O1 -Werror")
            .output()
            .expect("the system has make");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        (folder, library)
    });
    library
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Evaluates a sequence with its own labels, ground truth and depth images.
fn evaluate(dataset: &Path, more: &[&str]) -> Run {
    let labels = dataset.join("labels.csv");
    let mut args = vec!["evaluate", text(dataset), "--plugin", text(library()), "--labels", text(&labels)];
    args.extend(["--estimate", "ground-truth", "--depth", "zcam"]);
    args.extend(more);
    vice(&args)
}

fn px(value: &Value) -> [f64; 2] {
    [value[0].as_f64().unwrap(), value[1].as_f64().unwrap()]
}

#[test]
fn plugin_in_cpp_agrees_with_the_oracle() {
    let (Some(dataset), Some(oracle)) = (shared("data/tum_rgbd5"), shared_json("oracle/tum_rgbd5_vice.json"))
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let json = folder.path().join("out.json");
    let run = evaluate(&dataset, &["--subsets", "1,2,3,4", "--json", text(&json)]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let document: Value = serde_json::from_str(&std::fs::read_to_string(json).unwrap()).unwrap();
    let part = &document["pixel"][0];
    let samples = oracle["samples"].as_array().unwrap();
    assert_eq!(part["scored"], samples.len());
    for sample in samples {
        let point = sample["point"].to_string();
        let ours = part["samples"]
            .as_array()
            .unwrap()
            .iter()
            .find(|s| s["point"] == point.as_str() && s["timestamp_ns"] == sample["timestamp_ns"])
            .expect("each sample of the oracle was scored");
        let (got, want) = (px(&ours["tracked_px"]), px(&sample["tracked_px"]));
        let off = (got[0] - want[0]).hypot(got[1] - want[1]);
        assert!(off < 0.01, "off by {off} px: {sample}");
    }
    for (size, want) in oracle["rmse_2d"].as_object().unwrap() {
        let got = part["rmse_px"][size]["mean"].as_f64().unwrap();
        let off = got - want["mean_px"].as_f64().unwrap();
        assert!(off.abs() < 0.01, "RMSE_2D of {size} points is off by {off} px");
    }
}

#[test]
fn plugin_in_cpp_passes_the_check() {
    let Some(dataset) = shared("data/tum_rgbd5") else { return };
    let run = vice(&["plugin", "check", text(library()), text(&dataset)]);
    assert_eq!(run.code, 0, "{}\n{}", run.stdout, run.stderr);
}

/// A copy of the sequence, one of its text files changed.
fn copy_with(dataset: &Path, name: &str, change: impl Fn(String) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["rgb.txt", "depth.txt", "groundtruth.txt", "camera.json", "labels.csv"] {
        let whole = std::fs::read_to_string(dataset.join(file)).unwrap();
        let whole = if file == name { change(whole) } else { whole };
        std::fs::write(folder.path().join(file), whole).unwrap();
    }
    for images in ["rgb", "depth"] {
        std::fs::create_dir(folder.path().join(images)).unwrap();
        for entry in std::fs::read_dir(dataset.join(images)).unwrap() {
            let entry = entry.unwrap();
            std::fs::copy(entry.path(), folder.path().join(images).join(entry.file_name())).unwrap();
        }
    }
    folder
}

#[test]
fn plugin_in_cpp_names_the_line_at_fault() {
    let Some(dataset) = shared("data/tum_rgbd5") else { return };
    type Change<'a> = &'a dyn Fn(String) -> String;
    let cases: [(&str, Change<'_>, &str); 5] = [
        ("rgb.txt", &|t| t.replace("1700000001.000000 ", "1.7e9 "), "rgb.txt:5: `1.7e9` is no stamp"),
        ("rgb.txt", &|t| t.replace(" rgb/", " ../"), "leads out of the data set"),
        (
            "groundtruth.txt",
            &|t| t.replace("0.0287837", "nan"),
            "groundtruth.txt:3: `nan` is no finite number",
        ),
        ("groundtruth.txt", &|t| t.replace("0.993042", "0.5"), "groundtruth.txt:3: the quaternion's length"),
        ("camera.json", &|t| t.replace("\"fx\"", "\"f\""), "camera.json: has no \"fx\""),
    ];
    for (file, change, expected) in cases {
        let broken = copy_with(&dataset, file, change);
        let run = evaluate(broken.path(), &[]);
        assert_eq!(run.code, 1, "{file}: {}", run.stdout);
        assert!(run.stderr.contains(expected), "{file}: {}", run.stderr);
    }
}

#[test]
fn plugin_in_cpp_survives_a_damaged_image() {
    let Some(dataset) = shared("data/tum_rgbd5") else { return };
    let broken = copy_with(&dataset, "", |t| t);
    let image = broken.path().join("depth/1700000000.000000.png");
    let whole = std::fs::read(&image).unwrap();
    std::fs::write(&image, &whole[..whole.len() / 2]).unwrap();
    let run = evaluate(broken.path(), &[]);
    assert_ne!(run.code, 0, "{}", run.stdout);
    assert!(run.stderr.contains("the PNG breaks off or is damaged"), "{}", run.stderr);
}
