//! A program that is asked to end leaves nothing half written.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use vice_tests::{vice, vice_program};

use super::Flight;

#[test]
fn leftovers_of_signals_there_are_none() {
    for (signal, code) in [("INT", 130), ("TERM", 143), ("HUP", 129)] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("flight");
        let mut child = Command::new(vice_program())
            .args(["synth", out.to_str().unwrap(), "--duration", "60", "-q"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // The folder that is being filled stands beside its place.
        let until = Instant::now() + Duration::from_secs(60);
        while std::fs::read_dir(folder.path()).unwrap().count() == 0 {
            assert!(Instant::now() < until && child.try_wait().unwrap().is_none(), "nothing is written");
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(200));
        let asked = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status();
        assert!(asked.unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(code), "{signal}");
        let left: Vec<_> =
            std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert!(left.is_empty(), "{signal} leaves {left:?}");
    }
}

/// What a program that could not clean up left is gone after the next start of the same command in the same folder.
#[test]
fn leftovers_of_a_kill_are_cleaned_when_they_are_old() {
    let folder = tempfile::tempdir().unwrap();
    let old = folder.path().join(".vice-synth-abandoned");
    std::fs::create_dir(&old).unwrap();
    std::fs::write(old.join("half"), "x").unwrap();
    let long_ago = std::time::SystemTime::now() - Duration::from_secs(10 * 24 * 3600);
    std::fs::File::open(&old).unwrap().set_modified(long_ago).unwrap();
    let out = folder.path().join("flight");
    let run = vice(&["synth", out.to_str().unwrap(), "--duration", "0.2", "-q"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["flight"]);
}

#[test]
fn leftovers_of_a_report_whose_pictures_cannot_be_decoded() {
    let flight = Flight::new();
    let (run, labels, page) = (flight.text("run"), flight.text("labels.csv"), flight.text("page.html"));
    let fixed = ["evaluate", &run, "--labels", &labels, "--estimate", "ground-truth", "--report", &page];
    let ran = vice(&[&fixed[..], &["--json", &flight.text("out.json")]].concat());
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let says = |text: &str| {
        let line = text
            .lines()
            .find(|l| l.starts_with("warning") && l.contains("page.html") || l.contains("out.json:"));
        line.is_some_and(|l| l.contains("5 of 5 pictures cannot be shown") && l.contains(".png"))
    };
    assert!(says(&ran.stderr), "{}", ran.stderr);
    // The same of a page that is made later.
    let later = vice(&["report", &flight.text("out.json"), "--out", &flight.text("later.html")]);
    assert!(later.code == 0 && says(&later.stderr), "{}{}", later.stdout, later.stderr);
}
