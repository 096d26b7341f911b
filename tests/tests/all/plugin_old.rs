//! A plugin of version 0 of the contract, built with the header of that time, is used as far as it goes.

use std::fs;

use vice_tests::{compile_plugin, vice};

use crate::plugin_hostile::text;

#[test]
fn a_plugin_of_version_0_still_works() {
    let folder = tempfile::tempdir().unwrap();
    let library = compile_plugin("abi0/plugin.c", &[], folder.path(), "abi0");
    let data = folder.path().join("data");
    fs::create_dir(&data).unwrap();
    fs::write(data.join("abi0.txt"), "").unwrap();
    let with = ["--plugin", text(&library)];
    let listed = vice(&[&["formats"], &with[..]].concat());
    assert_eq!(listed.code, 0, "{}", listed.stderr);
    assert!(listed.stdout.contains("abi0 1.2.3  A plugin of version 0 of the contract"), "{}", listed.stdout);
    assert!(listed.stdout.contains("made for an older VICE"), "{}", listed.stdout);
    let info = vice(&[&["info", text(&data)], &with[..]].concat());
    assert_eq!(info.code, 0, "{}", info.stderr);
    for words in ["a run (abi0)", "8x4, radtan", "frames: 3", "steps: 3", "3 points", "a fact"] {
        assert!(info.stdout.contains(words), "{words}: {}", info.stdout);
    }
    let check = vice(&["plugin", "check", text(&library), text(&data), "--cycles", "200"]);
    assert_eq!(check.code, 0, "{}{}", check.stdout, check.stderr);
    assert!(
        check.stdout.contains("it is built for version 0 of the contract, this program's is 2"),
        "{}",
        check.stdout
    );
    assert!(check.stdout.contains("0 suspicious, 0 faults"), "{}", check.stdout);
    // Its errors are shown as they were.
    let empty = tempfile::tempdir().unwrap();
    let failed = vice(&[&["info", text(empty.path()), "--format", "abi0"], &with[..]].concat());
    assert_eq!(failed.code, 1, "{}", failed.stderr);
    assert!(failed.stderr.contains("has no abi0.txt"), "{}", failed.stderr);
}
