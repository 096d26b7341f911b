//! Batches: the same bytes in parts, after being killed, and with bad rows among the good.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::Duration;

use serde_json::Value;
use vice_core::random::SplitMix;
use vice_tests::{shared, vice_in, vice_program};

/// A short flight that all tests here read.
fn flight() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let run = vice_in(folder.path(), &["synth", "flight", "--duration", "3", "--rate", "5"]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        folder
    });
    folder.path()
}

/// A manifest beside the flight, of runs that differ in where they start.
fn manifest(name: &str, runs: usize) -> PathBuf {
    manifest_with(name, runs, "scene.csv,\"imu-euler,flight/estimates/drift.txt\",\"floor,zmap\",on")
}

/// The same of runs that take no time.
fn quick_manifest(name: &str, runs: usize) -> PathBuf {
    manifest_with(name, runs, "floor.csv,flight/estimates/drift.txt,floor,off")
}

fn manifest_with(name: &str, runs: usize, asked: &str) -> PathBuf {
    let mut text = String::from("run_id,group,dataset,labels,estimate,depth,depth-check,start\n");
    text.push_str(&format!("defaults,g,flight,flight/labels/{asked},\n"));
    for k in 0..runs {
        text.push_str(&format!("run{k:03},g{},,,,,,{}\n", k % 3, k as f64 * 0.001));
    }
    let path = flight().join(name);
    fs::write(&path, text).unwrap();
    path
}

fn batch(manifest: &Path, out: &Path, more: &[&str]) -> vice_tests::Run {
    let fixed = ["batch", manifest.to_str().unwrap(), "--out", out.to_str().unwrap()];
    vice_in(flight(), &[&fixed[..], more].concat())
}

/// `results.csv`, and all results, samples and tables by the names of their files.
fn bytes(out: &Path) -> (String, BTreeMap<String, Vec<u8>>) {
    let formats = ["--format", "csv,parquet,latex,html"];
    let run = vice_in(flight(), &[&["batch", "collect", out.to_str().unwrap()][..], &formats].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    let runs = fs::read_dir(out.join("runs")).unwrap().map(|e| e.unwrap().path());
    // What a killed run had begun to write is none of its results.
    let runs = runs.filter(|p| !p.file_name().is_some_and(|n| n.to_string_lossy().starts_with(".vice-")));
    let runs = runs.chain(["results.parquet", "table.tex", "table.html"].map(|name| out.join(name)));
    let files = runs.map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), fs::read(&p).unwrap()));
    (fs::read_to_string(out.join("results.csv")).unwrap(), files.collect())
}

#[test]
fn shards_in_any_order_are_one_batch() {
    let manifest = manifest("shards.csv", 11);
    let folder = tempfile::tempdir().unwrap();
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    assert_eq!(batch(&manifest, &whole, &["--jobs", "1"]).code, 0);
    for shard in ["3/4", "1/4", "4/4", "2/4"] {
        let run = batch(&manifest, &parts, &["--shard", shard, "--jobs", "2"]);
        assert_eq!(run.code, 0, "{}", run.stderr);
    }
    let (one, four) = (bytes(&whole), bytes(&parts));
    // A result and its samples for each, and three tables.
    assert_eq!(one.1.len(), 2 * 11 + 3);
    // A heading; two estimates and the reference with two depth sources each.
    assert_eq!(one.0.lines().count(), 1 + 11 * 3 * 2);
    assert_eq!(one, four);
    let table = vice_in(flight(), &["table", whole.join("results.csv").to_str().unwrap()]);
    assert_eq!(table.stdout, vice_in(flight(), &["table", parts.to_str().unwrap()]).stdout);
    assert!(table.stdout.contains("run010") && table.stdout.contains("drift"), "{}", table.stdout);
}

#[test]
fn a_batch_that_is_killed_goes_on_where_it_was() {
    let manifest = quick_manifest("killed.csv", 120);
    let folder = tempfile::tempdir().unwrap();
    let (whole, killed) = (folder.path().join("whole"), folder.path().join("killed"));
    assert_eq!(batch(&manifest, &whole, &[]).code, 0);
    let mut random = SplitMix::new(19);
    for _ in 0..50 {
        let mut child = Command::new(vice_program())
            .current_dir(flight())
            .args(["batch", manifest.to_str().unwrap(), "--out", killed.to_str().unwrap()])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(5 + random.below(120)));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let run = batch(&manifest, &killed, &[]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert_eq!(bytes(&whole), bytes(&killed));
}

#[cfg(unix)]
#[test]
fn a_signal_ends_a_batch_cleanly() {
    let manifest = quick_manifest("signal.csv", 600);
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let child = Command::new(vice_program())
        .current_dir(flight())
        .args(["batch", manifest.to_str().unwrap(), "--out", out.to_str().unwrap()])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !fs::read_dir(out.join("runs")).is_ok_and(|mut d| d.next().is_some()) {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let run: vice_tests::Run = child.wait_with_output().unwrap().into();
    assert_eq!(run.code, 130, "{}", run.stderr);
    assert!(run.stderr.contains("are left: run the same again"), "{}", run.stderr);
    for entry in fs::read_dir(out.join("runs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "parquet") {
            continue;
        }
        serde_json::from_slice::<Value>(&fs::read(&path).unwrap()).unwrap();
    }
}

#[test]
fn samples_and_reports_are_kept_where_they_are_asked_for() {
    let csv = manifest("same.csv", 3);
    let folder = tempfile::tempdir().unwrap();
    let (one, two) = (folder.path().join("one"), folder.path().join("two"));
    assert_eq!(batch(&csv, &one, &["--reports"]).code, 0);
    assert!(!bytes(&one).0.is_empty());
    assert_eq!(fs::read_dir(one.join("reports")).unwrap().count(), 3);
    let page = fs::read_to_string(one.join("table.html")).unwrap();
    let link = page.split("href=\"").nth(1).unwrap().split('"').next().unwrap().to_string();
    assert!(one.join(&link).is_file(), "{link}");
    let collected = vice_in(
        flight(),
        &["batch", "collect", one.to_str().unwrap(), "--format", "parquet", "--samples", "parquet"],
    );
    assert_eq!(collected.code, 0, "{}", collected.stderr);
    let samples = fs::read_dir(one.join("samples")).unwrap().count();
    assert_eq!(samples, 3);
    let elsewhere = folder.path().join("results.parquet");
    fs::copy(one.join("results.parquet"), &elsewhere).unwrap();
    let of_file = vice_in(flight(), &["table", elsewhere.to_str().unwrap()]);
    let of_folder = vice_in(flight(), &["table", one.to_str().unwrap()]);
    assert_eq!(of_file.code, 0, "{}", of_file.stderr);
    assert!(of_folder.stdout.contains("at the labels that both scored"), "{}", of_folder.stdout);
    assert!(of_file.stdout.contains("each at its own labels"), "{}", of_file.stdout);
    // Without samples nothing but what needs them is missing.
    assert_eq!(batch(&csv, &two, &["--samples", "none"]).code, 0);
    let run = vice_in(flight(), &["batch", "collect", two.to_str().unwrap(), "--samples", "parquet"]);
    assert!(run.code == 1 && run.stderr.contains("samples of run000 were not kept"), "{}", run.stderr);
    assert_eq!(fs::read(one.join("results.csv")).unwrap(), fs::read(two.join("results.csv")).unwrap());
    let again = batch(&csv, &two, &[]);
    assert!(again.code == 0 && again.stderr.contains("3 of 3 runs evaluated"), "{}", again.stderr);
}

#[test]
fn a_bad_run_is_a_row_and_tried_again() {
    let text = "run_id,dataset,labels,estimate,subsets\n\
                good,flight,flight/labels/scene.csv,imu-euler,\n\
                gone,nowhere,flight/labels/scene.csv,imu-euler,\n\
                many,flight,flight/labels/scene.csv,imu-euler,99\n\
                late,flight,late.csv,imu-euler,\n";
    let manifest = flight().join("bad.csv");
    fs::write(&manifest, text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let run = batch(&manifest, &out, &["--progress", "json", "--retry", "1"]);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let mut ended: BTreeMap<String, (String, u64)> = BTreeMap::new();
    for line in run.stdout.lines() {
        let line: Value = serde_json::from_str(line).unwrap();
        let state = line["state"].as_str().unwrap().to_string();
        ended.insert(
            line["run_id"].as_str().unwrap().to_string(),
            (state, line["exit_code"].as_u64().unwrap()),
        );
    }
    let of = |name: &str| (ended[name].0.as_str(), ended[name].1);
    assert_eq!(of("good"), ("done", 0));
    assert_eq!(of("gone"), ("failed", 1));
    assert_eq!(of("many"), ("failed", 2));
    assert_eq!(of("late"), ("failed", 1));
    let (results, _) = bytes(&out);
    assert!(
        results.contains(",failed,1,\"nowhere: no such file or folder")
            || results.contains(",failed,1,nowhere: no such file or folder"),
        "{results}"
    );
    let table = vice_in(flight(), &["table", out.to_str().unwrap()]);
    assert!(table.stdout.contains("\nno result\n- gone: nowhere: no such"), "{}", table.stdout);

    fs::copy(flight().join("flight/labels/scene.csv"), flight().join("late.csv")).unwrap();
    let again = batch(&manifest, &out, &["--keep-going"]);
    assert_eq!(again.code, 0, "{}", again.stderr);
    assert!(again.stderr.contains("1 of 4 runs evaluated"), "{}", again.stderr);
    assert!(bytes(&out).0.contains("\nvice.results/2,late,,late,flight,"));
}

#[test]
fn what_is_wrong_with_a_manifest_is_one_line_and_nothing_is_written() {
    let manifest = flight().join("wrong.csv");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let told = |text: &str, more: &[&str]| {
        fs::write(&manifest, text).unwrap();
        let run = batch(&manifest, &out, more);
        assert_eq!((run.code, run.stderr.lines().count()), (2, 1), "{}", run.stderr);
        assert!(!out.exists());
        run.stderr
    };
    let error = told("run_id,dataset,fsp\na,flight,3\n", &[]);
    assert!(error.contains("wrong.csv:1: there is no column `fsp`"), "{error}");
    let error = told("run_id,dataset,fps\na,flight,-3\n", &[]);
    assert!(error.contains("wrong.csv:2: fps: must be a number above zero"), "{error}");
    told("dataset\nflight\n", &["--shard", "5/4"]);
    fs::write(&manifest, "dataset\nflight\n").unwrap();
    let inside = flight().join("flight/out");
    let run = batch(&manifest, &inside, &[]);
    assert!(run.code == 2 && run.stderr.contains("lies in the data set"), "{}", run.stderr);
    assert!(!inside.exists());
    let planned = batch(&manifest, &out, &["--dry-run"]);
    assert!(planned.code == 0 && planned.stdout.starts_with("to run\tflight\t"), "{}", planned.stdout);
    assert!(!out.exists());
    // A changed manifest whose batch was stopped at once: the old result is no answer to it.
    fs::write(&manifest, "run_id,dataset,labels,estimate\na,flight,flight/labels/floor.csv,imu-euler\n")
        .unwrap();
    assert_eq!(batch(&manifest, &out, &[]).code, 0);
    assert!(bytes(&out).0.contains(",done,0,"));
    let text = "run_id,dataset,labels,estimate,fps\nb,flight,flight/labels/floor.csv,imu-euler,2\na,flight,flight/labels/floor.csv,imu-euler,2\n";
    fs::write(&manifest, text).unwrap();
    assert_eq!(batch(&manifest, &out, &["--shard", "1/2"]).code, 0);
    assert!(bytes(&out).0.contains("vice.results/2,a,,a,flight,,missing,"), "{}", bytes(&out).0);
    let table = vice_in(flight(), &["table", flight().to_str().unwrap()]);
    assert!(table.code == 1 && table.stderr.contains("is no folder of a batch"), "{}", table.stderr);
}

#[test]
fn what_is_there_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let written = folder.path().join("m.csv");
    let args = ["batch", "--scan", flight().to_str().unwrap(), written.to_str().unwrap()];
    assert_eq!(vice_in(flight(), &args).code, 0);
    let text = fs::read_to_string(&written).unwrap();
    assert!(text.starts_with("run_id,group,dataset,labels,estimate\nflight,euroc,"), "{text}");
    assert!(text.contains("labels/floor.csv,imu-euler"), "{text}");
    assert_eq!(vice_in(flight(), &args).code, 1, "a manifest is not written over");
    let run = batch(&written, &folder.path().join("out"), &[]);
    assert_eq!(run.code, 0, "{}", run.stderr);
}

#[test]
fn the_papers_manifest_makes_its_table() {
    if shared("data/euroc_v1_01").is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let run = vice_tests::vice(&["batch", "examples/paper/manifest.toml", "--out", out.to_str().unwrap()]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let table = vice_tests::vice(&["table", out.to_str().unwrap()]).stdout;
    for name in ["V1_01_easy", "LoCoBot (rendered)", "Blackbird (rendered)", "slam", "zmap"] {
        assert!(table.contains(name), "{table}");
    }
    assert!(!table.contains("no result"), "{table}");
}
