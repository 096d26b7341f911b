//! The same bytes whatever a processor has.

use std::path::Path;
use std::process::Command;

use vice_tests::vice_program;

fn with(instructions: &str, args: &[&str], folder: &Path) -> String {
    let run = Command::new(vice_program())
        .args(args)
        .env("VICE_INSTRUCTIONS", instructions)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(run.status.success(), "{args:?}: {}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).unwrap()
}

#[test]
fn results_have_the_same_bytes_with_any_instructions() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    with("widest", &["synth", "flight", "--duration", "2", "-q"], at);
    let read = |name: &str| std::fs::read(at.join(name)).unwrap();
    let mut first: Option<Vec<Vec<u8>>> = None;
    for instructions in ["widest", "v3", "scalar"] {
        with(
            instructions,
            &["labels", "track", "flight", "--points", "6", "--out", "tracks.json", "--force", "-q"],
            at,
        );
        let evaluate = [
            "evaluate",
            "flight",
            "--labels",
            "tracks.json",
            "--estimate",
            "flight/estimates/drift.txt",
            "--depth",
            "floor,zcam",
        ];
        with(instructions, &[&evaluate[..], &["--json", "result.json", "-q"]].concat(), at);
        let diagnose = [
            "diagnose",
            "flight",
            "--labels",
            "tracks.json",
            "--estimate",
            "flight/estimates/drift.txt",
            "--depth",
            "zcam",
        ];
        let told = with(instructions, &[&diagnose[..], &["--json", "found.json"]].concat(), at);
        let all = vec![read("tracks.json"), read("result.json"), read("found.json"), told.into_bytes()];
        match &first {
            None => first = Some(all),
            Some(first) => assert!(*first == all, "{instructions} gives other bytes"),
        }
    }
}

#[test]
fn a_value_that_is_none_is_refused() {
    let run = Command::new(vice_program()).arg("formats").env("VICE_INSTRUCTIONS", "avx").output().unwrap();
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{said}");
    assert!(said.contains("VICE_INSTRUCTIONS: `avx` is not one of scalar, v3, widest"), "{said}");
}
