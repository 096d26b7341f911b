//! Plugins that should not be loaded, and plugins that end, crash, hang, talk or take without end.

use std::fs;

use std::process::Command;

use vice_tests::measured::{Measured, measured};
use vice_tests::{vice, vice_program};

use super::text;
use crate::plugin_hostile::{Hostile, one_error};

#[cfg(unix)]
#[test]
fn plugins_through_a_link_in_a_folder_that_anyone_may_write_to() {
    use std::os::unix::fs::PermissionsExt;
    let good = Hostile::new(&[]);
    let open = tempfile::tempdir().unwrap();
    let link = open.path().join("libhostile.so");
    std::os::unix::fs::symlink(&good.library, &link).unwrap();
    fs::set_permissions(open.path(), fs::Permissions::from_mode(0o777)).unwrap();
    one_error(&vice(&["formats", "--plugin", text(&link)]), &["not loaded", "folder of the link"]);
    fs::set_permissions(open.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let listed = vice(&["formats", "--plugin", text(&link)]);
    assert!(
        listed.code == 0 && listed.stdout.contains("hostile 1.2.3"),
        "{}{}",
        listed.stdout,
        listed.stderr
    );
}

/// A plugin that does something in one of its calls, asked by a command that makes this call.
fn asked(plugin: &Hostile, what: &str, place: &str, isolate: &str) -> Measured {
    let (data, library) = (plugin.data(), plugin.library.clone());
    let mut command = Command::new(vice_program());
    match place {
        "image" => {
            let out = plugin.folder.path().join("labels.json");
            let _ = fs::remove_file(&out);
            command.args(["labels", "detect", text(&data), "--chessboard", "3x3", "--out", text(&out)]);
        }
        _ => drop(command.args(["info", text(&data)])),
    }
    command.args(["--plugin", text(&library), isolate]);
    // A tenth of the time, memory and log that a plugin usually has.
    command.env("HOSTILE_DO", format!("{what}@{place}")).env("VICE_BUDGET", "0.1");
    measured(&mut command)
}

/// The program ends as it does for any data set that cannot be read, and says what the plugin did.
fn survived(plugin: &Hostile, what: &str, place: &str, words: &str) {
    let ran = asked(plugin, what, place, "--isolate-plugins");
    let said = format!("{what}@{place}: exit {}: {}{}", ran.run.code, ran.run.stdout, ran.run.stderr);
    assert!([0, 1, 2].contains(&ran.run.code) && !said.contains("panicked"), "{said}");
    assert!(said.contains(words), "`{words}` is not in {said}");
    let bounded = ran.peak_mb.is_nan() || ran.peak_mb < 200.0;
    assert!(bounded && ran.run.stderr.len() < 20_000, "{} MB: {said}", ran.peak_mb);
}

const PLACES: [&str; 9] =
    ["load", "probe", "open", "describe", "camera", "frames", "image", "body_from_camera", "trajectory"];

#[test]
fn plugins_that_exit_or_crash_end_their_own_process() {
    let plugin = Hostile::new(&["VIOLENT"]);
    for place in PLACES {
        survived(&plugin, "exit", place, "ends the program with exit code 0");
        survived(&plugin, "abort", place, "crashes (abort");
    }
    survived(&plugin, "leave", "open", "ends the program with exit code 0");
    survived(&plugin, "segv", "image", "crashes (segmentation fault");
    // In the same process it takes the program with it: that is what isolation is for.
    let here = asked(&plugin, "abort", "open", "--isolate-plugins=off");
    assert_eq!(here.run.code, -1, "{}{}", here.run.stdout, here.run.stderr);
}

#[test]
fn plugins_that_talk_without_end_are_cut_short() {
    let plugin = Hostile::new(&["VIOLENT"]);
    for place in ["open", "image"] {
        survived(&plugin, "log", place, "lines: the rest is left out");
        survived(&plugin, "print", place, "lines: the rest is left out");
    }
}

#[test]
fn plugins_that_answer_garbage_or_take_all_memory_are_an_error() {
    let plugin = Hostile::new(&["VIOLENT"]);
    for place in PLACES {
        // Where the pipe is broken first the plugin's process ends by itself, else it is ended.
        survived(&plugin, "garbage", place, "libhostile.so: ");
        assert_ne!(asked(&plugin, "garbage", place, "--isolate-plugins").run.code, 0, "{place}");
    }
    // The system refuses it the memory, or its time ends first.
    for place in ["open", "image"] {
        survived(&plugin, "take", place, "libhostile.so: ");
        assert_ne!(asked(&plugin, "take", place, "--isolate-plugins").run.code, 0, "{place}");
    }
}

/// Three seconds, since the plugin is given as many.
#[test]
fn plugins_that_hang_are_ended() {
    let plugin = Hostile::new(&["VIOLENT"]);
    survived(&plugin, "hang", "open", "does not answer: it was ended after 3 s");
}

/// What a plugin of others hands over is the same from a process of its own; the plugin of the tests lies in a temporary
/// folder, which is nobody's own.
#[test]
fn plugins_say_the_same_from_a_process_of_their_own() {
    let plugin = Hostile::new(&[]);
    let (data, library) = (plugin.data(), plugin.library.clone());
    let info = |more: &[&str]| vice(&[&["info", text(&data), "--plugin", text(&library)], more].concat());
    let here = info(&["--isolate-plugins=off"]);
    assert_eq!(here.code, 0, "{}", here.stderr);
    for more in [&["--isolate-plugins"][..], &["--isolate-plugins=on"], &[]] {
        let apart = info(more);
        assert_eq!((&apart.stdout, &apart.stderr), (&here.stdout, &here.stderr), "{more:?}");
    }
    let formats = |more: &[&str]| vice(&[&["formats", "--plugin", text(&library)], more].concat()).stdout;
    assert!(formats(&[]).contains("in a process of its own"));
    assert!(!formats(&["--isolate-plugins=off"]).contains("in a process of its own"));
}

/// One that lies in the user's home folder runs in the process of the program, unless the user says otherwise.
#[test]
fn plugins_of_the_user_stay_in_the_process() {
    let plugin = Hostile::new(&[]);
    let formats = |more: &[&str]| {
        let mut command = Command::new(vice_program());
        command
            .args(["formats", "--plugin", text(&plugin.library)])
            .args(more)
            .env("HOME", plugin.folder.path());
        measured(&mut command).run
    };
    let own = formats(&[]);
    assert!(own.code == 0 && !own.stdout.contains("in a process of its own"), "{}{}", own.stdout, own.stderr);
    assert!(formats(&["--isolate-plugins"]).stdout.contains("in a process of its own"));
}
