//! A program that is asked to end leaves nothing half written.
#![cfg(unix)]

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use vice_tests::vice_program;

#[test]
fn no_signal_leaves_temporary_files() {
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
