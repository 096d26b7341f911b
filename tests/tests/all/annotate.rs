//! The annotator through its HTTP interface: who may ask, what an edit does, what two windows see, and bad input.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use vice_core::dataset::{Image, PixelFormat};
use vice_files::image_file::encode_png;
use vice_tests::vice;

use crate::annotator::{Annotator, Answer};

pub(crate) const FRAMES: usize = 12;
const FIRST_NS: i64 = 1_403_715_280_562_142_976;
const WIDTH: u32 = 200;
const HEIGHT: u32 = 150;

/// A short run in the EuRoC layout: a textured wall that moves 1.5 px to the left with each frame.
pub(crate) struct Run {
    folder: tempfile::TempDir,
}

fn stamp(frame: usize) -> i64 {
    FIRST_NS + 50_000_000 * frame as i64
}

impl Run {
    pub(crate) fn new() -> Self {
        let run = Self { folder: tempfile::tempdir().unwrap() };
        let camera = run.path("run/mav0/cam0");
        fs::create_dir_all(camera.join("data")).unwrap();
        let sensor = "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n\
            rate_hz: 20\nresolution: [200, 150]\ncamera_model: pinhole\nintrinsics: [150, 150, 100, 75]\n\
            distortion_model: radial-tangential\ndistortion_coefficients: [0, 0, 0, 0]\n";
        fs::write(camera.join("sensor.yaml"), sensor).unwrap();
        let mut list = "#timestamp [ns],filename\n".to_string();
        for frame in 0..FRAMES {
            list += &format!("{0},{0}.png\n", stamp(frame));
            fs::write(run.image(frame), encode_png(&wall(frame)).unwrap()).unwrap();
        }
        fs::write(camera.join("data.csv"), list).unwrap();
        run
    }

    pub(crate) fn path(&self, relative: &str) -> PathBuf {
        self.folder.path().join(relative)
    }

    fn image(&self, frame: usize) -> PathBuf {
        self.path(&format!("run/mav0/cam0/data/{}.png", stamp(frame)))
    }

    fn text(&self, relative: &str) -> String {
        self.path(relative).to_str().unwrap().to_string()
    }

    pub(crate) fn args(&self, more: &[&str]) -> Vec<String> {
        let fixed = [
            "annotate".to_string(),
            self.text("run"),
            "--labels".to_string(),
            self.text("my.json"),
            "--no-open".to_string(),
        ];
        fixed.into_iter().chain(more.iter().map(|m| (*m).to_string())).collect()
    }

    pub(crate) fn open(&self) -> Annotator {
        Annotator::start(&self.args(&[]))
    }

    fn refused(&self, more: &[&str], words: &[&str]) {
        let run = vice(&self.args(more));
        assert_eq!(run.code, 1, "{}{}", run.stdout, run.stderr);
        assert_eq!(run.stderr.lines().filter(|l| l.starts_with("error")).count(), 1, "{}", run.stderr);
        for word in words {
            assert!(run.stderr.contains(word), "`{word}` is not in: {}", run.stderr);
        }
    }
}

/// Blobs of several sizes, so that there is something to follow at every scale.
fn wall(frame: usize) -> Image {
    let value = |x: f64, y: f64| {
        let wave = |fx: f64, fy: f64, phase: f64| (fx * x + fy * y + phase).sin();
        128.0
            + 30.0 * wave(0.21, 0.13, 0.0) * wave(-0.11, 0.23, 1.0)
            + 40.0 * wave(0.05, 0.35, 2.0) * wave(0.4, -0.07, 0.5)
    };
    let shift = 1.5 * frame as f64;
    let pixels = (0..WIDTH * HEIGHT).map(|i| value(f64::from(i % WIDTH) + shift, f64::from(i / WIDTH)) as u8);
    Image::new(WIDTH, HEIGHT, PixelFormat::Gray8, pixels.collect()).unwrap()
}

pub(crate) fn place(point: &str, frame: usize, u: f64, v: f64) -> Value {
    json!({ "op": "place", "point": point, "frame": frame, "u": u, "v": v })
}

pub(crate) fn good(answer: Answer) -> Value {
    assert!((200..300).contains(&answer.status), "{answer:?}");
    answer.json()
}

pub(crate) fn bad(answer: &Answer, status: u16, word: &str) {
    assert_eq!(answer.status, status, "{answer:?}");
    assert!(answer.json()["error"].as_str().unwrap().contains(word), "{answer:?}");
}

#[test]
fn edits_are_made_undone_and_saved() {
    let run = Run::new();
    let mut annotator = run.open();
    let state = annotator.state();
    assert_eq!(
        (&state["width"], &state["camera"], &state["writable"]),
        (&json!(200), &json!("cam0"), &json!(true))
    );
    assert_eq!(state["frames"].as_array().unwrap().len(), FRAMES);
    assert_eq!(state["frames"][1]["stamp_ns"], stamp(1).to_string());
    let change = good(annotator.edit(0, &[place("1", 0, 50.25, 60.5), place("1", 1, 51.0, 60.0)]));
    assert_eq!((&change["revision"], &change["by"]), (&json!(1), &json!("edit")));
    let lane = &change["points"][0]["observations"];
    assert_eq!(
        (&lane[0]["keyframe"], &lane[1]["keyframe"], &lane[0]["u"]),
        (&json!(true), &json!(false), &json!(50.25))
    );
    let stale = annotator.edit(0, &[place("1", 2, 1.0, 1.0)]);
    bad(&stale, 409, "changed meanwhile");
    assert_eq!(stale.json()["revision"], 1);
    bad(
        &annotator.edit(1, &[place("1", 2, 1.0, 1.0), place("1", 3, 500.0, 1.0)]),
        422,
        "outside the 200x150 image",
    );
    bad(&annotator.post("/api/edits", "{\"revision\": 1}"), 400, "not understood");
    bad(&annotator.post("/api/edits", "[1"), 400, "not understood");
    good(annotator.edit(1, &[json!({ "op": "mark", "point": "1", "frame": 1, "occluded": true })]));
    let undone = good(annotator.post("/api/undo", "{\"revision\": 2}"));
    assert_eq!(
        (&undone["points"][0]["observations"][1]["occluded"], &undone["can_redo"]),
        (&json!(false), &json!(true))
    );
    assert_eq!(good(annotator.post("/api/undo", "{\"revision\": 3}"))["removed"], json!(["1"]));
    good(annotator.post("/api/redo", "{\"revision\": 4}"));
    good(annotator.post("/api/redo", "{\"revision\": 5}"));
    bad(&annotator.post("/api/redo", "{\"revision\": 6}"), 409, "nothing to redo");
    annotator.interrupt();
    let file: Value = serde_json::from_str(&fs::read_to_string(run.path("my.json")).unwrap()).unwrap();
    assert_eq!(file["points"][0]["observations"][1]["occluded"], json!(true));
    let again = run.open().state();
    assert_eq!((&again["revision"], &again["can_undo"]), (&json!(6), &json!(true)));
}

#[test]
fn only_a_browser_that_was_let_in_may_ask_and_only_from_here() {
    let run = Run::new();
    let annotator = run.open();
    let host = annotator.host();
    let ask = |path: &str, headers: &str| annotator.raw(&format!("GET {path} HTTP/1.1\r\n{headers}"), "");
    let cookie = annotator.cookie();
    let token = annotator.entrance().rsplit_once("token=").unwrap().1;
    for path in ["/", "/main.js", "/api/state", "/api/frames/0", "/api/events", "/api/none"] {
        bad(&ask(path, &format!("Host: {host}\r\n")), 401, "let in");
        bad(&ask(path, &format!("Host: {host}\r\nCookie: {cookie}0\r\n")), 401, "let in");
        bad(&ask(&format!("{path}?token={token}"), &format!("Host: {host}\r\n")), 401, "let in");
    }
    for used in [annotator.entrance(), "/open?token=", "/open"] {
        bad(&ask(used, &format!("Host: {host}\r\n")), 401, "used already");
    }
    bad(&ask(annotator.entrance(), "Host: evil.example\r\n"), 421, "name");
    let known = format!("Cookie: other=1; {cookie}\r\n");
    let port = host.rsplit_once(':').unwrap().1;
    for other in ["evil.example", &format!("evil.example:{port}"), "127.0.0.1:1", "127.0.0.1"] {
        bad(&ask("/api/state", &format!("Host: {other}\r\n{known}")), 421, "name");
    }
    assert_eq!(ask("/api/state", &format!("Host: localhost:{port}\r\n{known}")).status, 200);
    let write = |headers: &str| {
        let body = json!({ "revision": 0, "edits": [] }).to_string();
        annotator.raw(&format!("POST /api/edits HTTP/1.1\r\nHost: {host}\r\n{known}{headers}"), &body)
    };
    let json_type = "Content-Type: application/json\r\n";
    for origin in ["https://evil.example", "null", "http://127.0.0.1:1", &format!("https://{host}")] {
        bad(&write(&format!("{json_type}Origin: {origin}\r\n")), 403, "own page");
    }
    bad(&write(&format!("{json_type}Sec-Fetch-Site: cross-site\r\n")), 403, "own page");
    bad(&write("Content-Type: text/plain\r\n"), 415, "application/json");
    bad(&write(""), 415, "application/json");
    assert_eq!(
        write(&format!("{json_type}Origin: http://{host}\r\nSec-Fetch-Site: same-origin\r\n")).status,
        200
    );
    let page = ask("/", &format!("Host: {host}\r\n{known}"));
    assert!(page.text().contains("main.js\""), "{}", page.text());
    for header in [
        "content-security-policy: default-src 'none'",
        "referrer-policy: no-referrer",
        "x-content-type-options: nosniff",
        "cache-control: no-store",
    ] {
        assert!(page.head.to_ascii_lowercase().contains(header), "{}", page.head);
    }
    assert!(!page.head.to_ascii_lowercase().contains("access-control"));
    let script = ask("/main.js", &format!("Host: {host}\r\n{known}"));
    assert!(script.head.contains("text/javascript"), "{}", script.head);
    for path in ["/../Cargo.toml", "/package.json", "/api/frames/..%2f..%2fdata.csv", "/api/frames/-1"] {
        assert!(matches!(ask(path, &format!("Host: {host}\r\n{known}")).status, 400 | 404), "{path}");
    }
    bad(&annotator.get(&format!("/api/frames/{FRAMES}")), 404, "does not exist");
    let much = format!("{{\"revision\": 0, \"edits\": [], \"x\": \"{}\"}}", "x".repeat((1 << 20) + 4096));
    assert_eq!(annotator.post("/api/edits", &much).status, 413);
}

#[test]
fn frames_come_as_they_are_stored_and_a_broken_one_says_so() {
    let run = Run::new();
    let stored = fs::read(run.image(3)).unwrap();
    let whole = fs::read(run.image(5)).unwrap();
    fs::write(run.image(5), &whole[..whole.len() / 2]).unwrap();
    fs::write(run.image(6), b"").unwrap();
    fs::remove_file(run.image(7)).unwrap();
    let small = Image::new(4, 2, PixelFormat::Gray8, vec![7; 8]).unwrap();
    fs::write(run.image(8), encode_png(&small).unwrap()).unwrap();
    let annotator = run.open();
    let frame = annotator.get("/api/frames/3");
    assert_eq!(frame.body, stored);
    assert!(frame.head.contains("image/png") && frame.head.contains("immutable"), "{}", frame.head);
    for (frame, word) in [(5, "png"), (6, "png"), (7, "no such file"), (8, "4x2 pixels")] {
        bad(&annotator.get(&format!("/api/frames/{frame}")), 422, word);
    }
    // The rest works.
    good(annotator.edit(0, &[place("1", 5, 9.0, 9.0)]));
    assert_eq!(annotator.get("/api/frames/4").status, 200);
}

#[test]
fn a_point_is_tracked_up_to_what_a_person_placed_and_undone_at_once() {
    let run = Run::new();
    let annotator = run.open();
    let (u, v) = (100.0, 70.0);
    good(annotator.edit(0, &[place("1", 2, u, v), place("1", 9, 10.0, 10.0), place("2", 2, 60.0, 40.0)]));
    let request =
        json!({ "revision": 1, "points": ["1", "2"], "frame": 2, "direction": "both", "until": null });
    bad(
        &annotator.post(
            "/api/track",
            &json!({ "revision": 0, "points": ["1"], "frame": 2, "direction": "both" }).to_string(),
        ),
        409,
        "changed",
    );
    bad(
        &annotator.post(
            "/api/track",
            &json!({ "revision": 1, "points": ["1"], "frame": 3, "direction": "both" }).to_string(),
        ),
        422,
        "not labelled in frame 3",
    );
    let job = annotator.post("/api/track", &request.to_string());
    assert_eq!(job.status, 202, "{job:?}");
    let done = annotator.wait_for_job(&job.json()["id"]);
    assert_eq!(done["state"], "done", "{done}");
    let state = annotator.state();
    let frames = |point: usize| -> Vec<u64> {
        let list = state["points"][point]["observations"].as_array().unwrap();
        list.iter().map(|o| o["frame"].as_u64().unwrap()).collect()
    };
    assert_eq!(frames(0), (0..=9).collect::<Vec<_>>(), "up to the hand's own");
    assert_eq!(frames(1), (0..FRAMES as u64).collect::<Vec<_>>());
    for o in state["points"][0]["observations"].as_array().unwrap().iter().filter(|o| o["source"] == "auto") {
        let frame = o["frame"].as_f64().unwrap();
        let off = (o["u"].as_f64().unwrap() - (u - 1.5 * (frame - 2.0))).hypot(o["v"].as_f64().unwrap() - v);
        assert!(off < 0.1, "{o}");
        assert!(
            o["confidence"].as_f64().unwrap() > 0.5 && o["tracker_version"] == 1 && o["seeded"] == false,
            "{o}"
        );
    }
    // A correction, then the rest anew, up to the next of the hand's own.
    let revision = state["revision"].as_u64().unwrap();
    good(annotator.edit(revision, &[place("1", 5, 80.0, 90.0)]));
    let again = json!({ "revision": revision + 1, "points": ["1"], "frame": 5, "direction": "forward", "until": null });
    let job = annotator.post("/api/track", &again.to_string()).json();
    annotator.wait_for_job(&job["id"]);
    let state = annotator.state();
    let at = |frame: usize| state["points"][0]["observations"][frame].clone();
    assert!((at(7)["v"].as_f64().unwrap() - 90.0).abs() < 0.5, "{}", at(7));
    assert_eq!((&at(5)["source"], &at(9)["u"]), (&json!("manual"), &json!(10.0)));
    assert!((at(4)["v"].as_f64().unwrap() - v).abs() < 0.1);
    // Undo: the second job, the correction, the first job, each at once.
    let mut revision = state["revision"].as_u64().unwrap();
    for _ in 0..3 {
        revision =
            good(annotator.post("/api/undo", &json!({ "revision": revision }).to_string()))["revision"]
                .as_u64()
                .unwrap();
    }
    let lane = annotator.state()["points"][0]["observations"].as_array().unwrap().len();
    assert_eq!(lane, 2);
    assert_eq!(annotator.delete("/api/track/999").status, 404);
}

#[test]
fn a_subset_is_tracked_through_the_frames_between() {
    let run = Run::new();
    let annotator = Annotator::start(&run.args(&["--fps", "5", "--start", "0.05", "--duration", "0.45"]));
    let chosen: Vec<u64> = annotator.state()["frames"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f["frame"].as_u64().unwrap())
        .collect();
    assert_eq!(chosen, [1, 5, 9]);
    good(annotator.edit(0, &[place("1", 1, 100.0, 70.0)]));
    let job = annotator.post(
        "/api/track",
        &json!({ "revision": 1, "points": ["1"], "frame": 1, "direction": "forward" }).to_string(),
    );
    annotator.wait_for_job(&job.json()["id"]);
    let state = annotator.state();
    let lane = state["points"][0]["observations"].as_array().unwrap();
    assert_eq!(lane.iter().map(|o| o["frame"].as_u64().unwrap()).collect::<Vec<_>>(), chosen);
    assert!((lane[2]["u"].as_f64().unwrap() - 88.0).abs() < 0.1, "{}", lane[2]);
}

#[test]
fn suggestions_lie_in_the_image_and_away_from_what_is_there() {
    let run = Run::new();
    let annotator = run.open();
    let list = annotator.get("/api/suggestions?frame=0&count=3").json()["suggestions"].clone();
    let list = list.as_array().unwrap();
    assert!(!list.is_empty() && list.len() <= 3);
    let at = |s: &Value| (s["u"].as_f64().unwrap(), s["v"].as_f64().unwrap());
    let (u, v) = at(&list[0]);
    assert!((0.0..200.0).contains(&u) && (0.0..150.0).contains(&v) && list[0]["depth_m"].is_null());
    good(annotator.edit(0, &[place("1", 0, u, v)]));
    for s in annotator.get("/api/suggestions?frame=0&count=3").json()["suggestions"].as_array().unwrap() {
        assert!((at(s).0 - u).hypot(at(s).1 - v) > 10.0);
    }
    assert_eq!(annotator.get("/api/projections").text(), "null");
    bad(&annotator.get("/api/suggestions?frame=99"), 422, "does not exist");
}

#[test]
fn other_windows_hear_of_changes_and_of_the_end() {
    let run = Run::new();
    let mut annotator = run.open();
    let heard = annotator.listen();
    good(annotator.edit(0, &[place("1", 0, 5.0, 5.0)]));
    annotator.interrupt();
    let heard = heard.join().unwrap();
    assert!(heard.contains("event: change") && heard.contains("\"place 1 in frame 0\""), "{heard}");
    assert!(heard.contains("event: closed"), "{heard}");
}

#[test]
fn a_second_program_only_reads() {
    let run = Run::new();
    let first = run.open();
    good(first.edit(0, &[place("1", 0, 5.0, 5.0)]));
    let second = run.open();
    let state = second.state();
    assert_eq!((&state["writable"], &state["points"][0]["name"]), (&json!(false), &json!("1")));
    assert!(state["read_only_reason"].as_str().unwrap().contains("another"));
    bad(&second.edit(1, &[place("1", 1, 5.0, 5.0)]), 403, "read-only");
    bad(&second.post("/api/undo", "{\"revision\": 1}"), 403, "read-only");
    good(first.edit(1, &[place("1", 1, 5.0, 5.0)]));
}

#[test]
fn labels_come_in_and_go_out_again() {
    let run = Run::new();
    let annotator = run.open();
    good(
        annotator
            .edit(0, &[place("a & b", 0, 5.25, 6.5), place("a & b", 4, 7.0, 8.0), place("2", 1, 9.0, 10.0)]),
    );
    good(annotator.edit(
        1,
        &[json!({ "op": "mark", "point": "a & b", "frame": 4, "occluded": true, "uncertain": true })],
    ));
    let points = annotator.state()["points"].clone();
    let mut revision = 2;
    for format in ["json", "csv", "cvat"] {
        let out = annotator.get(&format!("/api/export?format={format}"));
        assert!(out.head.contains("attachment; filename=\"my."), "{}", out.head);
        let body = |replace: bool| {
            json!({ "content": out.text(), "encoding": "text", "replace": replace }).to_string()
        };
        let path = format!("/api/import?format={format}");
        bad(&annotator.post(&path, &body(false)), 409, "same names");
        good(
            annotator.edit(
                revision,
                &[json!({ "op": "remove-point", "point": "a & b" }), place("2", 1, 1.0, 1.0)],
            ),
        );
        good(annotator.post(&path, &body(true)));
        revision += 2;
        assert_eq!(annotator.state()["points"], points, "{format}");
    }
    bad(&annotator.get("/api/export?format=pickle"), 422, "only read");
    bad(&annotator.get("/api/export?format=tiff"), 422, "unknown format");
    let import =
        |content: &str| annotator.post("/api/import?format=csv", &json!({ "content": content }).to_string());
    bad(&import("point,timestamp_ns,u_px,v_px,keyframe\n9,5,1,1,1\n"), 422, "line 2");
    bad(&import(&format!("point,timestamp_ns,u_px,v_px,keyframe\n9,{},1,900,1\n", stamp(0))), 422, "outside");
    bad(&import("nonsense"), 422, "column point is missing");
    // {'p': {1L: (array('<f4', [1.0, 2.0]), 1)}} as Python 2 wrote it in protocol 0.
    let authors = "(dp0\nS'p'\np1\n(dp2\nL1L\n(cnumpy.core.multiarray\n_reconstruct\np3\n(cnumpy\nndarray\np4\n(I0\ntS'b'\n\
        tRp5\n(I1\n(I2\ntcnumpy\ndtype\np6\n(S'f4'\nI0\nI1\ntRp7\n(I3\nS'<'\nNNNI-1\nI-1\nI0\ntbI00\n\
        S'\\x00\\x00\\x80?\\x00\\x00\\x00@'\ntbI1\ntss.";
    let pickle = json!({ "content": authors, "encoding": "text" }).to_string();
    let change = good(annotator.post("/api/import?format=pickle", &pickle));
    let o = &change["points"][0]["observations"][0];
    assert_eq!((&o["frame"], &o["u"], &o["v"]), (&json!(1), &json!(1.0), &json!(2.0)), "{change}");
    assert_eq!((&o["keyframe"], &o["source"]), (&json!(true), &json!("manual")), "{change}");
    // {0: {1: (array([3., 4.]), True)}} would be longer; what is no pickle at all is refused as such.
    let pickle = json!({ "content": "gARdlC4=", "encoding": "base64" }).to_string();
    bad(&annotator.post("/api/import?format=pickle", &pickle), 422, "no dictionary");
}

#[test]
fn what_cannot_be_opened_says_why_in_one_line() {
    let run = Run::new();
    let write = |text: &str| fs::write(run.path("my.json"), text).unwrap();
    write(r#"{"schema": "vice.labels/1", "camera": "cam1", "points": []}"#);
    run.refused(&[], &["my.json", "camera cam1"]);
    write(
        r#"{"schema": "vice.labels/1", "dataset": "other", "points": [{"name": "1", "observations": [{"timestamp_ns": 5, "px": [1, 2]}]}]}"#,
    );
    run.refused(&[], &["my.json", "data set other"]);
    write(r#"{"schema": "vice.labels/2", "points": []}"#);
    run.refused(&[], &["my.json", "newer"]);
    write("{\"schema\"");
    run.refused(&[], &["my.json"]);
    write(r#"{"schema": "vice.labels/1", "points": []}"#);
    let mut permissions = fs::metadata(run.path("my.json")).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(run.path("my.json"), permissions).unwrap();
    run.refused(&[], &["my.json", "read-only"]);
    fs::remove_file(run.path("my.json")).unwrap();
    fs::write(run.path("my.json.journal"), "hello\n").unwrap();
    run.refused(&[], &["my.json.journal", "no journal"]);
    fs::remove_file(run.path("my.json.journal")).unwrap();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    run.refused(&["--port", &port], &["cannot listen", "another program"]);
    run.refused(&["--depth", "zmap", "--estimate", "no/such.txt"], &["no point cloud"]);
}

#[test]
fn a_full_disk_refuses_the_edit_and_loses_nothing() {
    let run = Run::new();
    // Files may have 16 blocks of 512 bytes (or 1024, by the shell); without the trap the signal would end the program.
    let annotator = Annotator::start_limited(&run.args(&[]), "trap '' XFSZ; ulimit -f 16");
    let mut revision = 0;
    let (refused, edit) = loop {
        let frame = revision as usize % FRAMES;
        let edit = place("1", frame, 5.0 + revision as f64 * 0.01, 6.0);
        let answer = annotator.edit(revision, std::slice::from_ref(&edit));
        if answer.status != 200 {
            break (answer, edit);
        }
        revision += 1;
        assert!(revision < 1000, "the limit does not hold");
    };
    bad(&refused, 507, "journal");
    let state = annotator.state();
    assert_eq!(state["revision"], revision);
    bad(&annotator.edit(revision, &[edit]), 507, "not made");
    assert_eq!(annotator.get("/api/frames/0").status, 200);
    drop(annotator);
    let after = run.open().state();
    assert_eq!((&after["revision"], &after["points"]), (&state["revision"], &state["points"]));
}

pub(crate) fn is_readable(path: &Path) {
    if let Ok(bytes) = fs::read(path) {
        vice_files::labels::read_json_or_none(&bytes).unwrap();
    }
}
