//! Where plugins are taken from, who may write there, and what happens to names that are taken.

use std::fs;
use std::path::Path;
use std::process::Command;

use vice_tests::{Run, compile_plugin, plugin, shared, vice, vice_program};

use crate::plugin_hostile::{Hostile, one_error, text};

/// Runs `vice` with a plugin path and a home of its own.
fn vice_with(plugin_path: Option<&Path>, home: &Path, args: &[&str]) -> Run {
    let mut command = Command::new(vice_program());
    command.args(args).current_dir(home).env("HOME", home).env("XDG_DATA_HOME", home.join("share"));
    match plugin_path {
        Some(path) => command.env("VICE_PLUGIN_PATH", path),
        None => command.env_remove("VICE_PLUGIN_PATH"),
    };
    command.output().unwrap().into()
}

#[test]
fn folders_are_searched_and_what_does_not_load_is_said() {
    let home = tempfile::tempdir().unwrap();
    let good = Hostile::new(&[]);
    let folder = good.folder.path();
    fs::write(folder.join("broken.so"), "no library").unwrap();
    compile_plugin("hostile.c", &[], folder, "twin");
    let listed = vice_with(Some(folder), home.path(), &["formats"]);
    assert_eq!(listed.code, 0, "{}", listed.stderr);
    assert!(listed.stdout.contains("hostile 1.2.3"), "{}", listed.stdout);
    assert!(listed.stdout.contains("broken.so: is no shared library"), "{}", listed.stdout);
    assert!(listed.stdout.contains("libtwin.so is left out"), "{}", listed.stdout);
    // Opening says it as warnings, and goes on.
    let info = vice_with(Some(folder), home.path(), &["info", text(&good.data())]);
    assert_eq!(info.code, 0, "{}", info.stderr);
    let warnings = info.stderr.lines().filter(|l| l.starts_with("warning: plugin")).count();
    assert_eq!(warnings, 2, "{}", info.stderr);
    // A file by itself: what lies beside it is not looked at.
    let alone = vice_with(Some(&good.library), home.path(), &["formats"]);
    assert!(alone.stdout.contains("hostile 1.2.3") && !alone.stdout.contains("twin"), "{}", alone.stdout);
    // The user's folder.
    let mine = home.path().join("share/vice/plugins");
    fs::create_dir_all(&mine).unwrap();
    fs::copy(&good.library, mine.join("libhostile.so")).unwrap();
    let listed = vice_with(None, home.path(), &["formats"]);
    assert!(listed.stdout.contains("share/vice/plugins/libhostile.so"), "{}", listed.stdout);
}

#[test]
fn neither_the_working_directory_nor_the_data_set_is_searched() {
    let good = Hostile::new(&[]);
    fs::copy(&good.library, good.data().join("libhostile.so")).unwrap();
    for plugin_path in [None, Some(Path::new("")), Some(Path::new("."))] {
        // `good.data()` is the working directory here, as the home.
        let info = vice_with(plugin_path, &good.data(), &["info", text(&good.data())]);
        one_error(&info, &["no format recognises this"]);
    }
}

#[test]
fn two_plugins_of_one_name_do_not_compete() {
    let good = Hostile::new(&[]);
    let twin = compile_plugin("hostile.c", &[], good.folder.path(), "twin");
    let run = vice(&["formats", "--plugin", text(&good.library), "--plugin", text(&twin)]);
    assert_eq!(run.code, 2, "{}", run.stderr);
    one_error(&run, &["libhostile.so and", "libtwin.so both read the format `hostile`"]);
    // The same one twice is one.
    let again = vice(&["formats", "--plugin", text(&good.library), "--plugin", text(&good.library)]);
    assert_eq!(again.code, 0, "{}", again.stderr);
}

#[test]
fn a_built_in_name_is_taken_by_a_named_plugin_only() {
    let home = tempfile::tempdir().unwrap();
    let robot = Hostile::new(&["NAME=\"euroc\""]);
    let named = vice(&["formats", "--plugin", text(&robot.library)]);
    assert!(named.stdout.contains("euroc 1.2.3") && named.stdout.contains("in place of the one built in"));
    let found = vice_with(Some(robot.folder.path()), home.path(), &["formats"]);
    assert!(!found.stdout.contains("euroc 1.2.3"), "{}", found.stdout);
    assert!(found.stdout.contains("is left out: the format `euroc` is built in"), "{}", found.stdout);
    // The real one, in place of the built-in.
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let real = vice(&["info", text(&data), "--plugin", text(&plugin("euroc"))]);
    assert_eq!(real.stdout, vice(&["info", text(&data)]).stdout);
}

#[cfg(unix)]
#[test]
fn what_others_may_write_to_is_refused() {
    use std::os::unix::fs::PermissionsExt;
    let good = Hostile::new(&[]);
    let mode = |path: &Path, mode| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    let load =
        |more: &[&str]| vice(&[&["formats", "--plugin", good.library.to_str().unwrap()], more].concat());
    mode(&good.library, 0o777);
    one_error(&load(&[]), &["not loaded", "may be written to by anyone", "--allow-writable-plugin"]);
    let forced = load(&["--allow-writable-plugin"]);
    assert_eq!(forced.code, 0);
    assert!(forced.stderr.contains("warning"), "{}", forced.stderr);
    mode(&good.library, 0o755);
    mode(good.folder.path(), 0o777);
    one_error(&load(&[]), &["its folder", "may be written to by anyone"]);
    mode(good.folder.path(), 0o700);
    mode(&good.library, 0o775);
    let group = load(&[]);
    assert_eq!(group.code, 0, "{}", group.stderr);
    assert!(group.stderr.contains("may be written to by its group"), "{}", group.stderr);
    // Only root can give a file to somebody else.
    if std::os::unix::fs::chown(&good.library, Some(12345), None).is_ok() {
        one_error(&load(&[]), &["belongs to another user (id 12345)"]);
    }
}
