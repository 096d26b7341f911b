//! What leads a person to full lanes, through the annotator's HTTP interface: respawns, gaps that are said to be empty, tracking
//! backwards, and the blind review.

use serde_json::{Value, json};
use vice_tests::vice;

use crate::annotate::{FRAMES, Run, bad, good, place};
use crate::annotator::Annotator;

fn spawn(frame: usize, u: f64, suggested: bool) -> Value {
    json!({ "op": "spawn", "point": "1", "frame": frame, "u": u, "v": 70.0, "suggested": suggested })
}

fn lane(state: &Value, name: &str) -> Vec<Value> {
    let points = state["points"].as_array().unwrap();
    let point = points.iter().find(|p| p["name"] == name).unwrap();
    point["observations"].as_array().unwrap().clone()
}

fn keyframes(lane: &[Value]) -> Vec<u64> {
    lane.iter().filter(|o| o["keyframe"] == true).map(|o| o["frame"].as_u64().unwrap()).collect()
}

fn track(annotator: &Annotator, frame: usize, direction: &str) -> Value {
    let revision = annotator.state()["revision"].clone();
    let request = json!({ "revision": revision, "points": ["1"], "frame": frame, "direction": direction });
    let job = good(annotator.post("/api/track", &request.to_string()));
    annotator.wait_for_job(&job["id"])
}

/// The way back from a respawn is of the respawn's place, not of what the segment before is of.
#[test]
fn tracking_backwards_from_a_respawn_makes_a_segment_of_its_own() {
    let run = Run::new();
    let annotator = run.open();
    good(annotator.edit(0, &[place("1", 0, 60.0, 40.0)]));
    let revision = annotator.state()["revision"].as_u64().unwrap();
    good(annotator.edit(revision, &[spawn(8, 90.0, false)]));
    let job = track(&annotator, 8, "backward");
    assert_eq!(job["state"], "done", "{job}");
    let lane = lane(&annotator.state(), "1");
    let frames: Vec<u64> = lane.iter().map(|o| o["frame"].as_u64().unwrap()).collect();
    assert_eq!(frames, [0, 1, 2, 3, 4, 5, 6, 7, 8], "{lane:?}");
    assert_eq!(keyframes(&lane), [0, 1, 8]);
    // The wall moves by 1.5 px a frame.
    let u = lane[1]["u"].as_f64().unwrap();
    assert!((u - (90.0 + 7.0 * 1.5)).abs() < 0.1, "{u}");
}

/// What follows a respawn in a gap is of the old place: it begins a segment.
#[test]
fn a_respawn_takes_over_nothing_of_what_follows() {
    let run = Run::new();
    let annotator = run.open();
    good(
        annotator.edit(0, &[place("1", 0, 60.0, 40.0), place("1", 6, 51.0, 40.0), place("1", 7, 49.5, 40.0)]),
    );
    let change = good(annotator.edit(1, &[spawn(3, 90.0, true)]));
    assert_eq!(change["label"], "begin 1 in frame 3");
    let lane = lane(&annotator.state(), "1");
    assert_eq!(keyframes(&lane), [0, 3, 6]);
    assert_eq!(lane[1]["source"], "auto");
    // Where a key frame goes, the rest of its segment keeps one.
    good(annotator.edit(2, &[json!({ "op": "delete-range", "point": "1", "frame": 3, "to": 6 })]));
    let state = annotator.state();
    assert_eq!(keyframes(&self::lane(&state, "1")), [0, 7]);
    good(annotator.post("/api/undo", &json!({ "revision": state["revision"] }).to_string()));
    assert_eq!(keyframes(&self::lane(&annotator.state(), "1")), [0, 3, 6]);
}

#[test]
fn a_gap_that_is_said_to_be_empty_is_kept_beside_the_labels() {
    let run = Run::new();
    let mut annotator = run.open();
    good(annotator.edit(0, &[place("1", 0, 60.0, 40.0)]));
    let note = |from: usize, to: usize, nothing: bool| {
        json!({ "point": "1", "from": from, "to": to, "nothing": nothing }).to_string()
    };
    let said = good(annotator.post("/api/notes", &note(3, 7, true)));
    assert_eq!(said["empty"], json!([{ "point": "1", "from": 3, "to": 7 }]));
    bad(&annotator.post("/api/notes", &note(3, FRAMES, true)), 422, "does not exist");
    bad(&annotator.post("/api/notes", r#"{"point": "1"}"#), 400, "not understood");
    good(annotator.edit(1, &[json!({ "op": "rename", "point": "1", "to": "door" })]));
    assert_eq!(annotator.state()["empty"], json!([{ "point": "door", "from": 3, "to": 7 }]));
    // One that only looks cannot say anything.
    let other = run.open();
    assert_eq!(other.state()["empty"], annotator.state()["empty"]);
    bad(&other.post("/api/notes", &note(0, 1, true)), 403, "another vice annotate");
    drop(other);
    annotator.interrupt();
    let again = run.open();
    assert_eq!(again.state()["empty"], json!([{ "point": "door", "from": 3, "to": 7 }]));
    let taken_back = json!({ "point": "door", "from": 5, "to": 5, "nothing": false });
    assert_eq!(good(again.post("/api/notes", &taken_back.to_string()))["empty"], json!([]));
    drop(again);
    std::fs::write(run.path("my.json.notes.json"), "{").unwrap();
    let refused = vice(&run.args(&[]));
    assert!(refused.code == 1 && refused.stderr.contains("my.json.notes.json"), "{}", refused.stderr);
}

/// The place of a label is not told before it has been judged, by any way.
#[test]
fn a_review_is_blind_and_its_distances_are_kept() {
    let run = Run::new();
    let mut annotator = run.open();
    good(annotator.edit(0, &[place("1", 0, 90.0, 70.0)]));
    assert_eq!(track(&annotator, 0, "forward")["state"], "done");
    annotator.interrupt();
    let labels = std::fs::read(run.path("my.json")).unwrap();
    let mut review = Annotator::start(&run.args(&["--review", "5"]));
    let asked = review.get("/api/review").json();
    let samples = asked["samples"].as_array().unwrap().clone();
    assert_eq!(samples.len(), 5);
    for sample in &samples {
        assert!(sample["verdict"].is_null() && sample["frame"] != 0, "{sample}");
        assert_eq!(sample["keyframe"], json!({ "frame": 0, "u": 90.0, "v": 70.0 }));
        assert_eq!(sample.as_object().unwrap().len(), 4, "nothing else is told: {sample}");
    }
    for hidden in ["/api/state", "/api/projections", "/api/export?format=json", "/api/events"] {
        assert_eq!(review.get(hidden).status, 404, "{hidden}");
    }
    assert_eq!(review.post("/api/edits", r#"{"revision": 1, "edits": []}"#).status, 404);
    // 0.5 px below where the wall went, in the first; in the second it cannot be told.
    let frame = samples[0]["frame"].as_f64().unwrap();
    let say = |sample: usize, px: Value| {
        review.post("/api/review", &json!({ "sample": sample, "px": px }).to_string())
    };
    let first = good(say(0, json!([90.0 - 1.5 * frame, 70.5])));
    let far = first["verdict"]["distance_px"].as_f64().unwrap();
    assert!((far - 0.5).abs() < 0.05, "{first}");
    assert!(first["verdict"]["stored"]["u"].is_number() && first["verdict"]["source"] == "auto", "{first}");
    bad(&say(0, json!([1.0, 1.0])), 422, "no longer blind");
    bad(&say(5, Value::Null), 422, "no sample 5");
    bad(&say(2, json!([1000.0, 1.0])), 422, "outside");
    let second = good(say(1, Value::Null));
    assert_eq!((&second["summary"]["placed"], &second["summary"]["untold"]), (&json!(1), &json!(1)));
    review.interrupt();
    let kept: Value =
        serde_json::from_slice(&std::fs::read(run.path("my.json.review.json")).unwrap()).unwrap();
    assert_eq!(kept["schema"], "vice.review/1");
    assert_eq!(kept["reviews"].as_array().unwrap().len(), 2);
    assert_eq!(std::fs::read(run.path("my.json")).unwrap(), labels, "a review touches no label");
    // It goes on where it ended, with the same observations.
    let mut again = Annotator::start(&run.args(&["--review", "5"]));
    let now = again.get("/api/review").json();
    assert_eq!(now["samples"].as_array().unwrap().iter().filter(|s| !s["verdict"].is_null()).count(), 2);
    assert_eq!(now["samples"][4]["frame"], samples[4]["frame"]);
    again.interrupt();
    // A label that has changed since is looked at anew, and that is said.
    let annotator = run.open();
    let revision = annotator.state()["revision"].as_u64().unwrap();
    good(annotator.edit(revision, &[place("1", samples[0]["frame"].as_u64().unwrap() as usize, 50.0, 70.0)]));
    drop(annotator);
    let changed = Annotator::start(&run.args(&["--review", "5"]));
    let now = changed.get("/api/review").json();
    assert_eq!((&now["outdated"], &now["summary"]["placed"]), (&json!(1), &json!(0)));
    drop(changed);
    std::fs::write(
        run.path("my.json.review.json"),
        r#"{"schema": "vice.review/1", "dataset": "x", "camera": "cam0", "reviews": []}"#,
    )
    .unwrap();
    let refused = vice(&run.args(&["--review"]));
    assert!(refused.code == 1 && refused.stderr.contains("is a review of cam0 of x"), "{}", refused.stderr);
}

#[test]
fn a_review_of_nothing_is_refused() {
    let run = Run::new();
    let refused = vice(&run.args(&["--review"]));
    assert!(refused.code == 1 && refused.stderr.contains("nothing to review"), "{}", refused.stderr);
    assert_eq!(vice(&run.args(&["--review", "0"])).code, 2);
}
