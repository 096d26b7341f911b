//! A hundred kills at random moments during edits: no acknowledged change is lost, and the file can always be read.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde_json::{Value, json};
use vice_core::random::SplitMix;

use crate::annotate::{FRAMES, Run, is_readable, place};

const KILLS: usize = 100;

/// What was acknowledged last, and what was under way when the server died.
struct Known {
    revision: u64,
    points: Value,
    under_way: Option<(u64, Value)>,
    acknowledged: usize,
}

/// Edits, undoes and redoes as fast as the server answers, until it is gone.
fn work(
    send: &dyn Fn(&str, &str) -> std::io::Result<crate::annotator::Answer>,
    mut known: Known,
    mut dice: SplitMix,
    stop: &AtomicBool,
) -> (Known, SplitMix) {
    while !stop.load(Ordering::Relaxed) {
        let point = dice.below(4).to_string();
        let frame = dice.below(FRAMES as u64) as usize;
        let (u, v) = (dice.below(19_900) as f64 / 100.0, dice.below(14_900) as f64 / 100.0);
        let revision = known.revision;
        let (path, body, edit) = match dice.below(10) {
            0 => ("/api/undo", json!({ "revision": revision }), Value::Null),
            1 => ("/api/redo", json!({ "revision": revision }), Value::Null),
            _ => {
                let edit = place(&point, frame, u, v);
                ("/api/edits", json!({ "revision": revision, "edits": [edit.clone()] }), edit)
            }
        };
        known.under_way = Some((revision, edit));
        let Ok(answer) = send(path, &body.to_string()) else { break };
        known.under_way = None;
        if answer.status != 200 {
            assert_eq!(answer.status, 409, "{answer:?}");
            continue;
        }
        let change = answer.json();
        known.revision = change["revision"].as_u64().unwrap();
        known.acknowledged += 1;
        let lanes = known.points.as_object_mut().unwrap();
        for name in change["removed"].as_array().unwrap() {
            lanes.remove(name.as_str().unwrap());
        }
        for lane in change["points"].as_array().unwrap() {
            lanes.insert(lane["name"].as_str().unwrap().to_string(), lane.clone());
        }
    }
    (known, dice)
}

#[test]
fn annotate_survives_kill() {
    let run = Run::new();
    let mut dice = SplitMix::new(20_260_101);
    let mut known = Known { revision: 0, points: json!({}), under_way: None, acknowledged: 0 };
    let mut finished_after_all = 0;
    for kill in 0..=KILLS {
        let mut annotator = run.open();
        is_readable(&run.path("my.json"));
        let state = annotator.state();
        let revision = state["revision"].as_u64().unwrap();
        let points: Value = state["points"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| (p["name"].as_str().unwrap().to_string(), p.clone()))
            .collect::<serde_json::Map<String, Value>>()
            .into();
        match known.under_way.take() {
            // What was not acknowledged may have happened, or not; nothing in between.
            Some((at, edit)) if revision == at + 1 => {
                finished_after_all += 1;
                if edit["op"] == "place" {
                    let lane = points[edit["point"].as_str().unwrap()]["observations"].as_array().unwrap();
                    let o = lane.iter().find(|o| o["frame"] == edit["frame"]).unwrap();
                    assert_eq!((&o["u"], &o["v"]), (&edit["u"], &edit["v"]), "kill {kill}");
                }
                known.points = points;
            }
            _ => {
                assert_eq!(revision, known.revision, "kill {kill}");
                assert_eq!(points, known.points, "kill {kill}");
            }
        }
        known.revision = revision;
        if kill == KILLS {
            break;
        }
        // Long enough at times for the labels file to be written in the middle of it.
        let pause = Duration::from_micros(500 * (1 + dice.below(if kill % 4 == 0 { 900 } else { 200 })));
        let send = annotator.writer();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let worker = std::thread::spawn(move || work(&send, known, dice, &stopped));
        std::thread::sleep(pause);
        annotator.kill();
        stop.store(true, Ordering::Relaxed);
        (known, dice) = worker.join().unwrap();
    }
    eprintln!(
        "{} changes acknowledged, {finished_after_all} more found after {KILLS} kills",
        known.acknowledged
    );
    assert!(known.acknowledged > 2 * KILLS, "too few changes to mean anything: {}", known.acknowledged);
    assert!(run.path("my.json").exists(), "the labels file was never written in between");
}
