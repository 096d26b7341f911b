//! Small inputs as the field makes them, judged by the rules that lie beside them in the shared data.

use std::process::Command;

use vice_tests::{shared, vice_program};

/// Every case but the hostile recordings, whose limits of time and memory are those of an optimised program.
#[test]
fn no_case_of_the_field_is_misread() {
    let Some(verify) = shared("cases/verify.py") else { return };
    if Command::new("python3").arg("--version").output().is_err() {
        assert!(!std::env::var("VICE_REQUIRE_DATA").is_ok_and(|v| v == "1"), "python3 is missing");
        eprintln!("skipped: python3 is missing");
        return;
    }
    let mut names: Vec<String> = verify
        .parent()
        .unwrap()
        .read_dir()
        .unwrap()
        .flatten()
        .filter(|entry| entry.path().join("cmd").is_file())
        .map(|entry| entry.file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert!(names.len() >= 22, "{names:?}");
    let run = Command::new("python3")
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .arg(&verify)
        .arg("--vice")
        .arg(vice_program())
        .args(names.iter().flat_map(|name| ["--only", name]))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stdout);
    let failed: Vec<&str> = said.lines().filter(|line| line.starts_with("FAIL")).collect();
    assert!(
        run.status.success() && failed.is_empty(),
        "{}\n{}",
        failed.join("\n"),
        String::from_utf8_lossy(&run.stderr)
    );
}
