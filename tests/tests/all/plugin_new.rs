//! `vice plugin new`: the projects build, and their own tests run the check.

use std::path::Path;
use std::process::Command;

use vice_tests::{Run, root, vice, vice_program};

use crate::plugin_hostile::{one_error, text};

fn good(command: &mut Command) -> Run {
    let run: Run = command.output().unwrap().into();
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    run
}

#[test]
fn a_project_in_cpp_builds_and_passes() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("my_robot");
    let run = vice(&["plugin", "new", "my_robot", "--language", "cpp", "--out", text(&project)]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let vice = format!("VICE={}", vice_program().display());
    let check = good(Command::new("make").current_dir(&project).args([
        "check",
        &vice,
        "CXXFLAGS=-O0 -Wall -Wextra -Werror",
    ]));
    assert!(check.stdout.contains("opened and closed 1000 times"), "{}", check.stdout);
    assert!(check.stdout.contains("0 suspicious, 0 faults"), "{}", check.stdout);
    assert!(project.join("README.md").is_file());
}

#[test]
fn a_project_in_rust_builds_and_passes() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("my_robot");
    let checkout = text(root());
    let run = vice(&[
        "plugin",
        "new",
        "my_robot",
        "--language",
        "rust",
        "--vice-path",
        checkout,
        "--out",
        text(&project),
    ]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    // With the versions of this checkout, so that nothing is looked for elsewhere.
    std::fs::copy(root().join("Cargo.lock"), project.join("Cargo.lock")).unwrap();
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(&project).args(["test", "--quiet", "--", "--nocapture"]);
    // Kept between runs, since it builds the crates that the project depends on.
    cargo
        .env("VICE", vice_program())
        .env("CARGO_TARGET_DIR", concat!(env!("CARGO_TARGET_TMPDIR"), "/plugin_new"));
    let test = good(&mut cargo);
    assert!(test.stdout.contains("0 suspicious, 0 faults"), "{}{}", test.stdout, test.stderr);
}

#[test]
fn what_cannot_be_a_project_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x");
    let new = |args: &[&str]| vice(&[&["plugin", "new"], args, &["--out", out.to_str().unwrap()]].concat());
    one_error(&new(&["My-Robot", "--language", "cpp"]), &["a name starts with a letter"]);
    one_error(&new(&["class", "--language", "cpp"]), &["a word of Rust or C++"]);
    one_error(&new(&["euroc", "--language", "cpp"]), &["is built in"]);
    one_error(&new(&["robot", "--language", "rust"]), &["--vice-path"]);
    one_error(&new(&["robot", "--language", "rust", "--vice-path", "/no/such"]), &["no checkout of VICE"]);
    one_error(&new(&["robot", "--language", "cpp", "--vice-path", "."]), &["for Rust"]);
    assert!(!out.exists());
    std::fs::create_dir(&out).unwrap();
    std::fs::write(Path::new(&out).join("mine.txt"), "mine").unwrap();
    one_error(&new(&["robot", "--language", "cpp"]), &["not empty"]);
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 1);
}
