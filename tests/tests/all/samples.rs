//! What `vice evaluate --samples` does with the scored samples.

use serde_json::Value;
use vice_tests::{shared, vice_in};

#[test]
fn samples_go_into_the_json_nowhere_or_into_lines_beside_it() {
    let Some(dataset) = shared("data/euroc_v1_01") else { return };
    let dataset = dataset.canonicalize().unwrap();
    let labels = dataset.join("labels/floor.csv");
    let folder = tempfile::tempdir().unwrap();
    let run = |more: &[&str]| {
        let mut args = vec!["evaluate", dataset.to_str().unwrap(), "--labels", labels.to_str().unwrap()];
        args.extend(["--estimate", "imu-euler", "--depth", "floor"]);
        args.extend(more);
        vice_in(folder.path(), &args)
    };
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(run(&["--json", "all.json"]).code, 0);
    assert_eq!(run(&["--json", "none.json", "--samples", "none"]).code, 0);
    assert_eq!(run(&["--json", "lines.json", "--samples", "jsonl"]).code, 0);
    let all: Value = serde_json::from_str(&read("all.json")).unwrap();
    let mut expected = Vec::new();
    for part in all["pixel"].as_array().unwrap() {
        for sample in part["samples"].as_array().unwrap() {
            let mut sample = sample.clone();
            sample["stream"] = part["stream"].clone();
            sample["depth"] = part["depth"].clone();
            expected.push(sample);
        }
    }
    assert_eq!(expected.len(), 40, "two streams of twenty");
    let lines: Vec<Value> =
        read("lines.samples.jsonl").lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines, expected);
    let mut without = all;
    for part in without["pixel"].as_array_mut().unwrap() {
        part["samples"] = Value::Array(vec![]);
    }
    // What is there for plots goes with the samples.
    without.as_object_mut().unwrap().remove("paths");
    for trajectory in without["trajectory"].as_array_mut().unwrap() {
        for plotted in ["frames", "since_keyframe"] {
            trajectory.as_object_mut().unwrap().remove(plotted);
        }
    }
    for name in ["none.json", "lines.json"] {
        let document: Value = serde_json::from_str(&read(name)).unwrap();
        assert_eq!(document, without, "{name}");
    }
}

#[test]
fn lines_need_a_file_to_lie_beside_and_are_not_left_half_done() {
    let Some(dataset) = shared("data/euroc_v1_01") else { return };
    let dataset = dataset.canonicalize().unwrap();
    let labels = dataset.join("labels/floor.csv");
    let folder = tempfile::tempdir().unwrap();
    let base =
        ["evaluate", dataset.to_str().unwrap(), "--labels", labels.to_str().unwrap(), "--samples", "jsonl"];
    for json in [&[][..], &["--json", "-"]] {
        let run = vice_in(folder.path(), &[&base[..], &["--estimate", "imu-euler"], json].concat());
        assert_eq!(run.code, 2);
        assert!(run.stderr.contains("name a file with --json"), "{}", run.stderr);
    }
    let run = vice_in(
        folder.path(),
        &[&base[..], &["--estimate", "no-such-file.txt", "--json", "out.json"]].concat(),
    );
    assert_eq!(run.code, 1, "{}", run.stderr);
    assert!(run.stderr.contains("no-such-file.txt"), "{}", run.stderr);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
