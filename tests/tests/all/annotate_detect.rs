//! The annotator looks for targets: what it adds, what it leaves alone, and how it ends.

use std::fs;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use vice_tests::shared;

use crate::annotate::{Run, bad, good, place};
use crate::annotator::Annotator;

/// Frames 1 to 9 of EuRoC: the board is in sight from 1 to 7.
const SOME: [&str; 4] = ["--start", "7", "--duration", "11"];
/// Frames around the one with the most tags.
const TAGS: [&str; 4] = ["--start", "30", "--duration", "4"];

struct Euroc {
    folder: tempfile::TempDir,
    data: String,
}

impl Euroc {
    fn new() -> Option<Self> {
        let data = shared("data/euroc_v1_01")?.to_str()?.to_string();
        Some(Self { folder: tempfile::tempdir().unwrap(), data })
    }

    fn open(&self, more: &[&str]) -> Annotator {
        let labels = self.folder.path().join("my.json");
        let fixed = ["annotate", &self.data, "--labels", labels.to_str().unwrap(), "--no-open"];
        Annotator::start(&fixed.iter().chain(more).map(ToString::to_string).collect::<Vec<_>>())
    }
}

fn detect(annotator: &Annotator, request: Value) -> Value {
    let answer = annotator.post("/api/detect", &request.to_string());
    assert_eq!(answer.status, 202, "{answer:?}");
    let job = answer.json();
    assert_eq!((&job["kind"], &job["state"]), (&json!("detect"), &json!("running")), "{job}");
    annotator.wait_for_job(&job["id"])
}

fn observation<'s>(state: &'s Value, point: &str, frame: usize) -> Option<&'s Value> {
    let points = state["points"].as_array().unwrap();
    let list = points.iter().find(|p| p["name"] == point)?["observations"].as_array().unwrap();
    list.iter().find(|o| o["frame"] == frame)
}

#[test]
fn a_board_is_added_as_one_step_and_a_hand_is_left_alone() {
    let Some(euroc) = Euroc::new() else { return };
    let annotator = euroc.open(&SOME);
    // A person has named a corner, not quite where it is.
    good(annotator.edit(0, &[place("board.r0c0", 2, 300.0, 200.0), place("7", 1, 5.0, 6.0)]));
    let before = annotator.state();
    let heard = annotator.listen();
    let job = detect(&annotator, json!({ "revision": 1, "chessboard": "6x7" }));
    assert_eq!((&job["state"], &job["done"]), (&json!("done"), &job["total"]), "{job}");
    let message = job["message"].as_str().unwrap();
    assert!(message.contains("7 with the chessboard") && message.contains("42 points added"), "{job}");
    let state = annotator.state();
    assert_eq!(state["revision"], 2);
    assert_eq!(state["points"].as_array().unwrap().len(), 43);
    for frame in 1..=7 {
        let corner = observation(&state, "board.r3c2", frame).unwrap();
        assert_eq!(corner["source"], "detected", "{corner}");
        assert!((0.0..=1.0).contains(&corner["confidence"].as_f64().unwrap()), "{corner}");
        assert_eq!(corner["keyframe"], frame == 1, "{corner}");
    }
    assert_eq!(observation(&state, "board.r0c0", 2), observation(&before, "board.r0c0", 2));
    assert_eq!(observation(&state, "board.r0c0", 3).unwrap()["source"], "detected");
    // Again: there is nothing to add.
    let job = detect(&annotator, json!({ "revision": 2, "chessboard": "6x7", "apriltag": null }));
    assert!(job["message"].as_str().unwrap().contains("labelled already"), "{job}");
    assert_eq!(annotator.state()["revision"], 2);
    let undone = good(annotator.post("/api/undo", "{\"revision\": 2}"));
    assert_eq!(undone["label"], "detect chessboard 6x7");
    assert_eq!(annotator.state()["points"], before["points"]);
    good(annotator.post("/api/redo", "{\"revision\": 3}"));
    assert_eq!(annotator.state()["points"], state["points"]);
    let mut annotator = annotator;
    annotator.interrupt();
    let heard = heard.join().unwrap();
    assert!(heard.contains("\"by\":\"detect\"") && heard.contains("\"kind\":\"detect\""), "{heard}");
    let saved = fs::read_to_string(euroc.folder.path().join("my.json")).unwrap();
    assert!(saved.contains("\"detected\""));
}

#[test]
fn tags_are_added_or_it_is_said_that_there_are_none() {
    let Some(euroc) = Euroc::new() else { return };
    let annotator = euroc.open(&TAGS);
    for request in [
        json!({ "revision": 0, "apriltag": "16h5", "border_bits": 1 }),
        json!({ "revision": 0, "chessboard": "9x4" }),
    ] {
        let job = detect(&annotator, request);
        let message = job["message"].as_str().unwrap();
        assert!(message.contains("nothing has changed") && job["state"] == "done", "{job}");
    }
    assert_eq!(annotator.state()["revision"], 0);
    let job =
        detect(&annotator, json!({ "revision": 0, "apriltag": "36h11", "border_bits": 2, "select": 4 }));
    assert!(job["message"].as_str().unwrap().contains("with tags"), "{job}");
    let state = annotator.state();
    let points = state["points"].as_array().unwrap();
    assert_eq!(points.len(), 4);
    assert!(points.iter().all(|p| p["name"].as_str().unwrap().starts_with("tag")), "{points:?}");
}

#[test]
fn a_search_can_be_stopped_and_leaves_nothing() {
    let Some(euroc) = Euroc::new() else { return };
    let annotator = euroc.open(&[]);
    let request = json!({ "revision": 0, "apriltag": "36h11", "chessboard": "6x7" });
    let answer = annotator.post("/api/detect", &request.to_string());
    let id = answer.json()["id"].clone();
    assert_eq!(annotator.delete(&format!("/api/track/{id}")).status, 204);
    assert_eq!(annotator.wait_for_job(&id)["state"], "stopped");
    assert_eq!(annotator.state()["revision"], 0);
}

#[test]
fn suggestions_say_where_they_lie() {
    let Some(euroc) = Euroc::new() else { return };
    let lie = |annotator: &Annotator, frame: usize| {
        let answer = annotator.get(&format!("/api/suggestions?frame={frame}")).json();
        assert!(!answer["suggestions"].as_array().unwrap().is_empty(), "{answer}");
        let depths: Vec<bool> =
            answer["suggestions"].as_array().unwrap().iter().map(|s| s["depth_m"].is_number()).collect();
        (answer["surface"].as_str().unwrap().to_string(), depths.iter().all(|d| *d))
    };
    assert_eq!(lie(&euroc.open(&[]), 1), ("floor".to_string(), true));
    // A reference of six seconds knows nothing of a later frame.
    let reference = format!("{}/estimates/imu_euler.txt", euroc.data);
    let short = euroc.open(&["--reference", &reference]);
    assert_eq!(lie(&short, 2), ("floor".to_string(), true));
    assert_eq!(lie(&short, 50), ("any".to_string(), false));
}

#[test]
fn what_is_no_target_is_refused() {
    let run = Run::new();
    let annotator = run.open();
    let ask = |request: Value| annotator.post("/api/detect", &request.to_string());
    bad(&ask(json!({ "revision": 0 })), 422, "name a family");
    bad(&ask(json!({ "revision": 0, "apriltag": "36h12" })), 422, "36h12");
    bad(&ask(json!({ "revision": 0, "chessboard": "0x7" })), 422, "0x7");
    bad(&ask(json!({ "revision": 3, "chessboard": "6x7" })), 409, "changed");
    bad(&ask(json!({ "revision": 0, "chessboard": "6x7", "folder": "/" })), 400, "folder");
    bad(
        &annotator.raw(&format!("POST /api/detect HTTP/1.1\r\nHost: {}\r\n", annotator.host()), "{}"),
        401,
        "let in",
    );
    let second = run.open();
    bad(&second.post("/api/detect", "{\"revision\": 0, \"chessboard\": \"6x7\"}"), 403, "read-only");
}

#[test]
fn a_labels_file_that_falls_behind_is_told_at_once_and_so_is_its_catching_up() {
    let run = Run::new();
    let mut annotator = run.open();
    let heard = annotator.listen();
    let until = |holds: &dyn Fn(&Value) -> bool| {
        let deadline = Instant::now() + Duration::from_secs(20);
        while !holds(&annotator.state()) {
            assert!(Instant::now() < deadline, "{}", annotator.state());
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    // No file can take the place of a folder, whoever the tests run as.
    fs::create_dir(run.path("my.json")).unwrap();
    good(annotator.edit(0, &[place("1", 0, 5.0, 5.0)]));
    until(&|state| state["save_problem"].as_str().is_some_and(|p| p.contains("my.json")));
    fs::remove_dir(run.path("my.json")).unwrap();
    // Without another change: it is tried again.
    until(&|state| state["save_problem"].is_null());
    assert!(fs::read_to_string(run.path("my.json")).unwrap().contains("vice.labels/1"));
    annotator.interrupt();
    let heard = heard.join().unwrap();
    let told: Vec<&str> = heard.split("event: save").skip(1).collect();
    assert_eq!(told.len(), 2, "{heard}");
    assert!(told[0].contains("my.json") && told[1].contains("{\"save_problem\":null}"), "{heard}");
}
