//! Plugins that are wrong in one way each: a clear line, never a crash of the program.

use std::fs;
use std::path::{Path, PathBuf};

use vice_tests::{Run, compile_plugin, plugin, vice};

/// A folder with a small plugin and a data set of it.
pub(crate) struct Hostile {
    pub(crate) folder: tempfile::TempDir,
    pub(crate) library: PathBuf,
}

impl Hostile {
    pub(crate) fn new(defines: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let library = compile_plugin("hostile.c", defines, folder.path(), "hostile");
        fs::create_dir(folder.path().join("data")).unwrap();
        fs::write(folder.path().join("data/hostile.txt"), "").unwrap();
        Self { folder, library }
    }

    pub(crate) fn data(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    pub(crate) fn formats(&self) -> Run {
        vice(&["formats", "--plugin", text(&self.library)])
    }

    pub(crate) fn info(&self) -> Run {
        vice(&["info", text(&self.data()), "--plugin", text(&self.library)])
    }

    pub(crate) fn check(&self, more: &[&str]) -> Run {
        let (library, data) = (self.library.to_str().unwrap(), self.data());
        let few: &[&str] = if more.contains(&"--cycles") { &[] } else { &["--cycles", "3"] };
        vice(&[&["plugin", "check", library, text(&data)], few, more].concat())
    }
}

pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

pub(crate) fn one_error(run: &Run, words: &[&str]) {
    assert!(run.code == 1 || run.code == 2, "exit {}: {}{}", run.code, run.stdout, run.stderr);
    let errors: Vec<&str> = run.stderr.lines().filter(|l| l.starts_with("error")).collect();
    assert_eq!(errors.len(), 1, "{}", run.stderr);
    for word in words {
        assert!(errors[0].contains(word), "`{word}` is not in: {}", errors[0]);
    }
}

#[test]
fn the_plugin_as_it_stands_is_good() {
    let good = Hostile::new(&[]);
    let listed = good.formats();
    assert_eq!(listed.code, 0, "{}", listed.stderr);
    assert!(listed.stdout.contains("hostile 1.2.3  A plugin of the tests"), "{}", listed.stdout);
    assert!(listed.stdout.contains(&format!("from: {}", good.library.canonicalize().unwrap().display())));
    let info = good.info();
    assert_eq!(info.code, 0, "{}", info.stderr);
    for words in ["a run (hostile)", "8x4, radtan", "frames: 3", "steps: 3", "3 points", "a fact"] {
        assert!(info.stdout.contains(words), "{words}: {}", info.stdout);
    }
    assert!(info.stderr.contains("warning: a remark of the plugin"), "{}", info.stderr);
    let doubt = "cam: the pictures are dark: mean 1 of 255, 3 times (switch on the light)";
    assert!(format!("{}{}", info.stdout, info.stderr).contains(doubt), "{}{}", info.stdout, info.stderr);
    let check = good.check(&[]);
    assert_eq!(check.code, 0, "{}{}", check.stdout, check.stderr);
    for words in [
        "one after another",
        "3 of 3 images are given as they are stored",
        "pose stream steps: 3 poses, one each 0.1 s, chained from relative motions",
        "pose stream chained: 3 poses, one each 0.1 s, chained from relative motions",
        "it doubts the data: cam: the pictures are dark",
    ] {
        assert!(check.stdout.contains(words), "`{words}` is not in {}", check.stdout);
    }
    // A plugin need not decode: its stored images are decoded for it.
    let stored = Hostile::new(&["PICTURE_IS_FILE"]).check(&[]);
    assert_eq!(stored.code, 0, "{}{}", stored.stdout, stored.stderr);
    assert!(
        stored.stdout.contains("3 images were read (all), of the size of the calibration"),
        "{}",
        stored.stdout
    );
}

#[test]
fn what_is_no_library_is_not_loaded() {
    let good = Hostile::new(&[]);
    let other = good.folder.path().join("other.so");
    let refused = |words: &[&str]| one_error(&vice(&["formats", "--plugin", text(&other)]), words);
    refused(&["other.so", "no such file"]);
    fs::write(&other, "#!/bin/sh\n").unwrap();
    refused(&["other.so", "is no shared library"]);
    fs::write(&other, "").unwrap();
    refused(&["is no shared library"]);
    let library = fs::read(&good.library).unwrap();
    fs::write(&other, &library[..library.len() / 3]).unwrap();
    refused(&["cut off"]);
    let mut foreign = library.clone();
    // e_machine: AArch64, or x86-64 where this is one.
    let machine: u16 = if cfg!(target_arch = "aarch64") { 62 } else { 183 };
    foreign[18..20].copy_from_slice(&machine.to_le_bytes());
    fs::write(&other, &foreign).unwrap();
    refused(&["is built for", std::env::consts::ARCH]);
    refused(&["build it for this machine"]);
    fs::remove_file(&other).unwrap();
    fs::create_dir(&other).unwrap();
    refused(&["is no file"]);
}

#[test]
fn tables_that_cannot_be_used_are_refused() {
    for (define, words) in [
        ("NO_SYMBOL", "has no symbol vice_plugin"),
        ("NEWER_ABI", "update VICE"),
        ("SHORT_TABLE", "its table has 64 bytes, but the required calls end at"),
        ("ODD_TABLE", "ends within a field"),
        ("NULL_TABLE", "hands over no table and does not say why"),
        ("REFUSES", "hands over no table: the licence has run out"),
        ("NULL_CALL", "the call `image` is null"),
        ("NULL_NAME", "the format's name is null"),
        ("NO_VERSION", "its version is empty"),
        ("NULL_OFFERS", "the pointer to offers is null"),
        (r#"NAME="caf\xe9""#, "the format's name is not UTF-8"),
        (r#"NAME="My Robot""#, "other characters than a-z"),
    ] {
        let bad = Hostile::new(&[define]);
        one_error(&bad.formats(), &["libhostile", words]);
        // The check says the same, from its child.
        let check = bad.check(&[]);
        assert!(check.code == 1 || check.code == 2, "exit {}: {}", check.code, check.stderr);
        for line in [words, "cannot be checked"] {
            assert!(check.stderr.contains(line), "`{line}` is not in: {}", check.stderr);
        }
    }
}

#[test]
fn shorter_and_longer_tables_are_used_as_far_as_they_go() {
    let older = Hostile::new(&["SHORT_TABLE_OF_CALLS"]);
    assert!(older.formats().stdout.contains("made for an older VICE"));
    let info = older.info();
    assert_eq!(info.code, 0, "{}", info.stderr);
    assert!(!info.stdout.contains("a fact") && info.stdout.contains("frames: 3"), "{}", info.stdout);
    assert_eq!(older.check(&[]).code, 0);
    let newer = Hostile::new(&["LONG_TABLE"]);
    assert_eq!(newer.info().code, 0);
}

/// Each is a line of the check, and no crash of a command.
#[test]
fn what_crosses_the_border_is_validated() {
    for (define, words) in [
        ("NULL_DATASET", "the data set is null"),
        ("BAD_PROBE", "does not recognise"),
        ("EMPTY_COLLECTION", "does not recognise"),
        ("CLAIMS_ALL", "it claims an empty folder"),
        ("SAME_NAMES", "two cameras have the name `cam`"),
        ("BAD_KIND", "kind -4 of the pose stream steps"),
        ("NULL_CAMERAS", "the pointer to cameras is null, though 1 are announced"),
        ("BAD_NAME", "the name of a camera is not UTF-8 at byte 3"),
        ("LONG_NAME", "more than can be"),
        ("DESCRIBE_NONE", "returned VICE_NONE"),
        ("BAD_MODEL", "camera model 9"),
        ("MANY_COEFFICIENTS", "4000000000 distortion coefficients"),
        ("NAN_FOCAL", "not finite"),
        ("UNSORTED_FRAMES", "frame 2 at 1700000000100000000 ns is not later"),
        ("NULL_LIST", "the pointer to stamps is null, though 3 are announced"),
        ("HUGE_COUNT", "more than can be"),
        ("UNALIGNED", "not aligned to 8 bytes"),
        ("SHORT_STRIDE", "a row has 8 bytes, but the stride is 7"),
        ("SHORT_BUFFER", "do not fit the 55 bytes"),
        ("BIG_IMAGE", "do not fit"),
        ("BAD_PIXELS", "pixel format 5"),
        ("OTHER_SIZE", "is 8x3, but its calibration is for 8x4"),
        ("GIVES_ALL", "image 3 of camera cam is given"),
        ("NOT_UNIT", "the quaternion has length 2.0"),
        ("NAN_POSE", "pose 1: the translation is not finite"),
        ("UNSORTED_POSES", "is earlier than the one before"),
        ("NO_POSES", "no poses"),
        ("BROKEN_MOTIONS", "but the one before ended"),
        ("NO_RELATIVE", "the call `relative_motions` is null"),
        ("NAN_IMU", "inertial sample 1 is not finite"),
        ("NAN_STATE", "its velocity or a bias is not finite"),
        ("ODD_DEPTH_STRIDE", "no multiple of 4"),
        ("SHORT_DEPTH", "do not fit the 124 bytes"),
        ("BAD_CLOUD", "kind 3"),
        ("NO_PLY", "the path is empty"),
        ("NO_NORMAL", "the normal of the plane is zero"),
        ("BAD_FLOOR", "frame 2 of the floor"),
        ("NO_PICTURE", "which it must not where there is no `image_file`"),
        ("NULL_FILE", "the pointer to bytes of the file is null, though 68 are announced"),
        ("HUGE_FILE", "more than can be"),
        ("OTHER_FILE", "its 6 bytes are neither a PNG nor a JPEG"),
        ("BROKEN_FILE", "it cannot be decoded"),
        ("OTHER_PICTURE", "labels would be set on another picture"),
        ("GIVES_ALL_FILES", "stored image 3 of camera cam is given"),
        ("NO_CODE", "the code of a suspicion is empty"),
        ("BAD_CODE", "the code `So Dark` of a suspicion should be a word"),
        ("BAD_SUSPICION", "the message of a suspicion is not UTF-8"),
        ("NEVER_SEEN", "was seen 0 times"),
        ("SAID_TWICE", "is said twice of the same"),
        ("MANY_SUSPICIONS", "suspicions are announced, more than can be"),
        ("NULL_SUSPICIONS", "the pointer to suspicions is null"),
        ("BAD_HINT", "the hint of its message lies outside the text"),
        ("NO_MESSAGE", "it fails to open without a message"),
        ("OVERRUN_MESSAGE", "writes beyond the `capacity`"),
        ("UNKNOWN_CODE", "returned 77"),
    ] {
        let bad = Hostile::new(&[define]);
        let check = bad.check(&[]);
        assert_eq!(check.code, 1, "{define}: {}{}", check.stdout, check.stderr);
        let said = check.stdout.lines().any(|l| l.starts_with("FAULT") && l.contains(words));
        let warned = check.stdout.contains("FAULT") && check.stdout.contains(words);
        assert!(said || warned, "{define}: `{words}` is not in {}{}", check.stdout, check.stderr);
        let info = bad.info();
        assert!(info.code == 0 || info.code == 1, "{define}: {}{}", info.stdout, info.stderr);
        assert!(!info.stderr.contains("panicked"), "{define}: {}", info.stderr);
    }
}

#[test]
fn errors_are_shown_whatever_their_message() {
    let opening = |define: &str| {
        let bad = Hostile::new(&[define, "CLAIMS_ALL"]);
        let empty = tempfile::tempdir().unwrap();
        vice(&["info", text(empty.path()), "--format", "hostile", "--plugin", text(&bad.library)])
    };
    one_error(&opening("NO_MESSAGE"), &["libhostile", "it failed and does not say why"]);
    one_error(&opening("BAD_MESSAGE"), &["is closed", "its message is not UTF-8"]);
    one_error(&opening("LONG_MESSAGE"), &["xxxxxxxx", "…"]);
    one_error(&opening("UNKNOWN_CODE"), &["the call returned 77"]);
    one_error(&opening("BAD_HINT"), &["has no hostile.txt (see `labels`)"]);
    one_error(&opening("PLAIN"), &["has no hostile.txt (see `labels`)"]);
    // A hint is said as any other: fields of a request as options. The kind decides the exit code.
    let hint = opening("HINT");
    one_error(&hint, &["has no hostile.txt (see --labels)"]);
    assert_eq!(hint.code, 2, "{}", hint.stderr);
}

#[test]
fn a_fact_that_is_no_text_is_a_warning() {
    let run = Hostile::new(&["BAD_FACT"]).info();
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stderr.contains("the text of a fact is not UTF-8"), "{}", run.stderr);
}

#[test]
fn exceptions_become_errors() {
    let folder = tempfile::tempdir().unwrap();
    let library = compile_plugin("throwing.cpp", &[], folder.path(), "throwing");
    let info = vice(&["info", text(folder.path()), "--format", "throwing", "--plugin", text(&library)]);
    assert_eq!(info.code, 0, "{}", info.stderr);
    assert!(info.stdout.contains("a vector is too short (a mistake of the plugin)"), "{}", info.stdout);
    assert!(info.stdout.contains("no std::exception was thrown"), "{}", info.stdout);
    let check = vice(&["plugin", "check", text(&library), text(folder.path()), "--cycles", "3"]);
    assert!(check.stdout.contains("frames.csv:3: the film is torn"), "{}", check.stdout);
}

#[test]
fn panics_become_errors() {
    let library = plugin("panicking");
    for (place, words) in [
        ("probe", "panics in probe"),
        ("open", "panics in open"),
        ("cameras", "panics in cameras"),
        ("frames", "panics in frames"),
        ("drop", "panics in drop"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("panic.txt"), place).unwrap();
        let info = vice(&["info", text(folder.path()), "--plugin", text(&library)]);
        assert!(info.code == 0 || info.code == 1, "{place}: exit {}: {}", info.code, info.stderr);
        let said = format!("{}{}", info.stdout, info.stderr);
        assert!(said.contains("the plugin panicked at") && said.contains(words), "{place}: {said}");
        assert!(!info.stderr.contains("thread '"), "the panic is one line: {}", info.stderr);
        let check = vice(&["plugin", "check", text(&library), text(folder.path()), "--cycles", "3"]);
        assert_eq!(check.code, 1, "{place}: {}", check.stdout);
    }
}
