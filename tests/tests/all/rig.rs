//! Several cameras in one run, and labels that say which camera they are of.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use vice_tests::vice;

/// A flight whose second camera sits where the first does, and its labels.
struct Flight {
    _folder: tempfile::TempDir,
    flight: PathBuf,
    labels: String,
}

fn text(path: &Path) -> String {
    path.to_str().unwrap().to_string()
}

fn flight() -> Flight {
    let folder = tempfile::tempdir().unwrap();
    let flight = folder.path().join("flight");
    let run = vice(&["synth", &text(&flight), "--duration", "2", "--rate", "5"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let (one, other) = (flight.join("mav0/cam0"), flight.join("mav0/cam1"));
    fs::create_dir_all(other.join("data")).unwrap();
    for name in ["sensor.yaml", "data.csv"] {
        fs::copy(one.join(name), other.join(name)).unwrap();
    }
    for file in fs::read_dir(one.join("data")).unwrap() {
        let file = file.unwrap().path();
        fs::copy(&file, other.join("data").join(file.file_name().unwrap())).unwrap();
    }
    let labels = fs::read_to_string(flight.join("labels/floor.csv")).unwrap();
    Flight { _folder: folder, flight, labels }
}

impl Flight {
    /// The labels with a column `camera`, those of some points in each.
    fn of_cameras(&self, camera: impl Fn(&str) -> &'static str) -> String {
        let mut lines = self.labels.lines().filter(|l| !l.starts_with('#'));
        let heading = lines.next().unwrap();
        let (already, own) = match heading.strip_suffix(",camera") {
            Some(own) => (true, own),
            None => (false, heading),
        };
        let mut table = format!("{own},camera\n");
        for line in lines {
            let line = if already { line.rsplit_once(',').unwrap().0 } else { line };
            let point = line.split(',').next().unwrap();
            table.push_str(&format!("{line},{}\n", camera(point)));
        }
        table
    }

    /// The labels as files had them before they named a camera.
    fn plain(&self) -> String {
        let table = self.of_cameras(|_| "");
        table.lines().map(|l| l.rsplit_once(',').unwrap().0.to_string() + "\n").collect()
    }

    fn write(&self, name: &str, content: &str) -> String {
        let path = self.flight.parent().unwrap().join(name);
        fs::write(&path, content).unwrap();
        text(&path)
    }

    fn evaluate(&self, labels: &str, more: &[&str]) -> vice_tests::Run {
        let estimate = text(&self.flight.join("estimates/drift.txt"));
        let flight = text(&self.flight);
        let args = ["evaluate", &flight, "--labels", labels, "--estimate", &estimate];
        vice(&[&args[..], more].concat())
    }
}

fn json(run: &vice_tests::Run) -> Value {
    serde_json::from_str(&run.stdout).unwrap_or_else(|e| panic!("{e}: {}", run.stderr))
}

#[test]
fn a_rig_is_evaluated_camera_by_camera_and_together() {
    let flight = flight();
    let names: Vec<String> =
        flight.labels.lines().map(|l| l.split(',').next().unwrap().to_string()).collect();
    let last = names.last().unwrap().clone();
    let both =
        flight.write("both.csv", &flight.of_cameras(|point| if point == last { "cam1" } else { "cam0" }));
    let run = flight.evaluate(&both, &["--camera", "cam0,cam1", "--json", "-"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let rig = json(&run);
    assert_eq!(rig["schema"], "vice.rig/1");
    let cameras = rig["cameras"].as_array().unwrap();
    assert_eq!(cameras.len(), 2);
    let mut sums = [0.0, 0.0];
    for (camera, name) in cameras.iter().zip(["cam0", "cam1"]) {
        assert_eq!(camera["schema"], "vice.result/2");
        assert_eq!(camera["dataset"]["camera"], name);
        // The same as of that camera alone.
        let alone = json(&flight.evaluate(&both, &["--camera", name, "--json", "-"]));
        assert_eq!(alone, *camera);
        let part = camera["pixel"].as_array().unwrap().iter().find(|p| p["role"] == "estimate").unwrap();
        let (rmse, scored) = (part["pooled_rmse_px"].as_f64().unwrap(), part["scored"].as_f64().unwrap());
        sums[0] += rmse * rmse * scored;
        sums[1] += scored;
    }
    let part = rig["together"].as_array().unwrap().iter().find(|p| p["role"] == "estimate").unwrap();
    assert!((part["pooled_rmse_px"].as_f64().unwrap() - (sums[0] / sums[1]).sqrt()).abs() < 1e-9, "{part}");
    assert_eq!(part["scored"].as_f64(), Some(sums[1]));

    // Together they score what one file without cameras does, since both sit at one place.
    let plain = flight.write("plain.csv", &flight.plain());
    let all = json(&flight.evaluate(&plain, &["--json", "-"]));
    let of_all = all["pixel"].as_array().unwrap().iter().find(|p| p["role"] == "estimate").unwrap();
    assert!(
        (part["pooled_rmse_px"].as_f64().unwrap() - of_all["pooled_rmse_px"].as_f64().unwrap()).abs() < 1e-9
    );

    // The document asks for the same once more; a file for each camera gives the same numbers.
    let written = flight.write("rig.json", &run.stdout);
    let again = json(&vice(&["evaluate", "--request", &written, "--json", "-"]));
    assert_eq!(again, rig);
    for (name, content) in [("cam0", true), ("cam1", false)] {
        let table = flight.of_cameras(|point| if (point == last) == content { "other" } else { "mine" });
        let mine: String = table
            .lines()
            .filter_map(|l| {
                if l.ends_with(",other") { None } else { l.rsplit_once(',').map(|l| l.0.to_string() + "\n") }
            })
            .collect();
        flight.write(&format!("l_{name}.csv"), &mine);
    }
    let pattern = text(&flight.flight.parent().unwrap().join("l_{camera}.csv"));
    let run = flight.evaluate(&pattern, &["--camera", "cam0,cam1", "--json", "-"]);
    assert_eq!(json(&run)["together"], rig["together"]);

    // Table, CSV and page name the cameras.
    let (csv, page) = (flight.write("out.csv", ""), flight.write("out.html", ""));
    let run = flight.evaluate(&both, &["--camera", "cam0,cam1", "--csv", &csv, "--report", &page]);
    assert!(run.code == 0 && run.stdout.contains("cam0 and cam1 together"), "{}{}", run.stdout, run.stderr);
    let csv = fs::read_to_string(csv).unwrap();
    assert!(csv.starts_with("camera,stream,") && csv.contains("\ncam1,drift,"), "{csv}");
    assert!(fs::read_to_string(page).unwrap().contains(": cam1"));

    // What does not say whose it is.
    for (labels, more, problem) in [
        (&plain, vec!["--camera", "cam0,cam1"], "does not say which camera its labels are of"),
        (&both, vec!["--camera", "cam0,cam0"], "is no camera of its own in the list"),
        (&both, vec!["--camera", "cam0,cam7"], "there is no camera cam7"),
        (&both, vec!["--camera", "cam0,cam1", "--intrinsics", "90,90,80,60"], "is of one camera"),
        (&both, vec!["--camera", "cam0,cam1", "--json", "x.json", "--samples", "jsonl"], "is of one camera"),
    ] {
        let run = flight.evaluate(labels, &more);
        assert!(run.code == 2 && run.stderr.contains(problem), "{more:?} {}", run.stderr);
    }
    let run = vice(&["compare", &written, &written]);
    assert!(run.code == 1 && run.stderr.contains("results of several cameras"), "{}", run.stderr);
}

#[test]
fn labels_of_another_camera_are_refused_and_old_files_are_of_the_one_that_is_asked_for() {
    let flight = flight();
    let of_cam1 = flight.write("cam1.csv", &flight.of_cameras(|_| "cam1"));
    let run = flight.evaluate(&of_cam1, &["--camera", "cam0"]);
    assert!(
        run.code == 1 && run.stderr.contains("holds labels of camera cam1, not of cam0"),
        "{}",
        run.stderr
    );
    assert!(run.stderr.contains("cam1.csv") && run.stderr.contains("--camera"), "{}", run.stderr);
    assert_eq!(flight.evaluate(&of_cam1, &["--camera", "cam1"]).code, 0);
    // Each format keeps the camera.
    let folder = flight.flight.parent().unwrap();
    for name in ["a.json", "a.parquet", "b.csv"] {
        let to = text(&folder.join(name));
        assert_eq!(vice(&["labels", "convert", &of_cam1, &to]).code, 0, "{name}");
        assert_eq!(flight.evaluate(&to, &["--camera", "cam1"]).code, 0, "{name}");
        let run = flight.evaluate(&to, &["--camera", "cam0"]);
        assert!(run.code == 1 && run.stderr.contains("holds labels of camera cam1"), "{name} {}", run.stderr);
    }
    // A camera that the data set does not have is another name of the one that is asked for, or another recording's: doubted.
    let elsewhere = flight.write("elsewhere.csv", &flight.of_cameras(|_| "front"));
    let run = flight.evaluate(&elsewhere, &["--camera", "cam0"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let said = format!("{}{}", run.stdout, run.stderr);
    assert!(said.contains("a camera front, which the data set does not have"), "{said}");
    // A file of several cameras is no set of labels before one is chosen.
    let both =
        flight.write("both.csv", &flight.of_cameras(|point| if point == "0" { "cam0" } else { "cam1" }));
    let to = text(&folder.join("c.json"));
    let run = vice(&["labels", "convert", &both, &to]);
    assert!(run.code != 0 && run.stderr.contains("--camera"), "{}", run.stderr);
    assert!(!folder.join("c.json").exists());
    let run = vice(&["labels", "convert", &both, &to, "--camera", "cam1"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let written: Value = serde_json::from_str(&fs::read_to_string(&to).unwrap()).unwrap();
    assert_eq!(written["camera"], "cam1");
    // An old file gets its camera so.
    let old = flight.write("old.csv", &flight.plain());
    assert_eq!(flight.evaluate(&old, &["--camera", "cam1"]).code, 0);
    let named = text(&folder.join("named.csv"));
    assert_eq!(vice(&["labels", "convert", &old, &named, "--camera", "cam1"]).code, 0);
    assert!(fs::read_to_string(named).unwrap().lines().next().unwrap().ends_with(",camera"));
}
