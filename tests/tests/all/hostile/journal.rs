//! The journal of the annotator: what is damaged, and who may write.

use std::fs;
use std::io::Read;
use std::process::{Command, Stdio};
use std::time::Duration;

use serde_json::json;
use vice_tests::vice_program;

use crate::annotate::{Run, bad, good, place};

/// What a start of the annotator says on standard error.
fn said_at_start(run: &Run) -> String {
    let mut child = Command::new(vice_program())
        .args(run.args(&[]))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut first = [0; 1];
    // Its address is printed when the journal has been read.
    let read = child.stdout.take().unwrap().read(&mut first);
    assert_eq!(read.unwrap(), 1, "the annotator does not start");
    std::thread::sleep(Duration::from_millis(200));
    child.kill().unwrap();
    child.wait().unwrap();
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    said
}

/// A run whose labels are in the journal alone: twelve places, and a program that was killed.
fn twelve_edits() -> (Run, Vec<Vec<u8>>) {
    let run = Run::new();
    let mut annotator = run.open();
    for frame in 0..12 {
        good(annotator.edit(frame, &[place("1", frame as usize, 10.0 + frame as f64, 20.0)]));
    }
    annotator.kill();
    let _ = fs::remove_file(run.path("my.json"));
    let bytes = fs::read(run.path("my.json.journal")).unwrap();
    let lines = bytes.split_inclusive(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
    (run, lines)
}

fn frames_of_point(run: &Run) -> Vec<u64> {
    let annotator = run.open();
    let state = annotator.state();
    let lane = state["points"][0]["observations"].as_array().cloned().unwrap_or_default();
    lane.iter().map(|o| o["frame"].as_u64().unwrap()).collect()
}

#[test]
fn the_journal_says_what_of_it_is_damaged_and_keeps_it() {
    let (run, lines) = twelve_edits();
    assert!(lines.len() >= 13, "{}", lines.len());
    // The last six edits were acknowledged, and are nothing that can be read.
    let last = lines.len() - 6;
    let damaged: Vec<u8> = lines[..last].concat().into_iter().chain(vec![b'\n'; 600]).collect();
    fs::write(run.path("my.json.journal"), &damaged).unwrap();
    let said = said_at_start(&run);
    assert!(
        said.contains("cannot be read")
            && said.contains("made after")
            && !said.contains("never acknowledged"),
        "{said}"
    );
    assert_eq!(fs::read(run.path("my.json.journal.damaged")).unwrap(), damaged);
    // A line may say that the labels were saved, and hold no place.
    let frames = frames_of_point(&run);
    assert!((5..12).contains(&frames.len()), "{frames:?}");
    assert_eq!(frames, (0..frames.len() as u64).collect::<Vec<u64>>());
}

#[test]
fn the_journal_misses_a_line_that_was_taken_or_moved() {
    let (run, lines) = twelve_edits();
    let mut taken = lines.clone();
    taken.remove(lines.len() - 3);
    fs::write(run.path("my.json.journal"), taken.concat()).unwrap();
    let said = said_at_start(&run);
    assert!(said.contains("cannot be read") && said.contains("made between"), "{said}");
    assert_eq!(frames_of_point(&run), [0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 11]);

    let (run, lines) = twelve_edits();
    let mut swapped = lines.clone();
    swapped.swap(lines.len() - 2, lines.len() - 4);
    fs::write(run.path("my.json.journal"), swapped.concat()).unwrap();
    let said = said_at_start(&run);
    assert!(said.contains("in the wrong place"), "{said}");
    assert_eq!(frames_of_point(&run), (0..12).collect::<Vec<u64>>());
}

#[cfg(unix)]
#[test]
fn two_writers_through_links_are_one() {
    let run = Run::new();
    let mut first = run.open();
    good(first.edit(0, &[place("1", 0, 5.0, 5.0)]));
    first.interrupt();
    std::os::unix::fs::symlink(run.path("my.json"), run.path("link.json")).unwrap();
    fs::hard_link(run.path("my.json"), run.path("hard.json")).unwrap();
    let first = run.open();
    let revision = first.state()["revision"].as_u64().unwrap();
    for name in ["link.json", "hard.json"] {
        let mut args = run.args(&[]);
        let labels = args.iter().position(|a| a == "--labels").unwrap() + 1;
        args[labels] = run.path(name).to_str().unwrap().to_string();
        let other = crate::annotator::Annotator::start(&args);
        assert_eq!(other.state()["writable"], json!(false), "{name}");
        bad(&other.edit(revision, &[place("1", 1, 5.0, 5.0)]), 403, "read-only");
    }
    good(first.edit(revision, &[place("1", 1, 5.0, 5.0)]));
}
