//! What is fuzzed, without a fuzzer: the stored inputs are replayed, and changed a little with a fixed seed.
//!
//! `VICE_FUZZ_RUNS=N` changes them N times for each target instead of a few; `fuzz/run` fuzzes with coverage.

use std::fs;
use std::panic::catch_unwind;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use vice_core::random::SplitMix;
use vice_tests::fuzzing::{TARGETS, Target, mutate};
use vice_tests::root;

/// Changed inputs of each target.
const RUNS: u64 = 16;
/// Longest that one input may take. An optimised program is held to less by `fuzz/run`.
const MOST: Duration = Duration::from_secs(5);
/// All that is stored, bytes.
const MOST_STORED: u64 = 300_000;

fn stored(target: &Target) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = root().join("fuzz/corpus").join(target.name);
    let mut paths: Vec<PathBuf> = fs::read_dir(&folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

/// The words of the dictionaries, as libFuzzer writes them.
fn words() -> Vec<Vec<u8>> {
    let mut words = Vec::new();
    for name in ["text.dict", "binary.dict"] {
        let text = fs::read_to_string(root().join("fuzz/dictionaries").join(name)).unwrap();
        for line in text.lines().filter(|line| line.starts_with('"')) {
            let line = line
                .strip_prefix('"')
                .and_then(|l| l.strip_suffix('"'))
                .unwrap_or_else(|| panic!("{name}: {line}"));
            let mut word = Vec::new();
            let mut rest = line.chars();
            while let Some(c) = rest.next() {
                match c {
                    '\\' => match rest.next() {
                        Some('x') => {
                            let digits: String = rest.by_ref().take(2).collect();
                            word.push(u8::from_str_radix(&digits, 16).unwrap());
                        }
                        Some(c @ ('"' | '\\')) => word.push(c as u8),
                        other => panic!("{name}: {line}: {other:?}"),
                    },
                    c => word.push(u8::try_from(c).unwrap()),
                }
            }
            words.push(word);
        }
    }
    words
}

/// Runs an input; what goes wrong is said with the input.
fn run(target: &Target, bytes: &[u8], whence: &str) -> Option<String> {
    let begun = Instant::now();
    let result = catch_unwind(|| target.run(bytes));
    let took = begun.elapsed();
    if result.is_ok() && took < MOST {
        return None;
    }
    // Found inputs are kept, so that they can be stored beside the others with the mend.
    let path = std::env::temp_dir().join(format!("vice-fuzzed-{}-{}", target.name, bytes.len()));
    let kept = fs::write(&path, bytes).map_or_else(|e| e.to_string(), |()| path.display().to_string());
    let what = if result.is_err() { "panics".to_string() } else { format!("takes {took:?}") };
    Some(format!("{} {what}: {whence}, kept as {kept}", target.name))
}

#[test]
fn fuzzed_inputs_that_are_stored_are_read_or_refused() {
    let mut bytes_stored = 0;
    let mut wrong = Vec::new();
    for target in &TARGETS {
        let inputs = stored(target);
        assert!(!inputs.is_empty(), "{} has no stored input", target.name);
        for (path, bytes) in inputs {
            bytes_stored += bytes.len() as u64;
            wrong.extend(run(target, &bytes, &path.display().to_string()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(bytes_stored < MOST_STORED, "{bytes_stored} bytes are stored");
}

#[test]
fn fuzzed_inputs_that_are_changed_are_read_or_refused() {
    let runs = std::env::var("VICE_FUZZ_RUNS").map_or(RUNS, |n| n.parse().unwrap());
    let words = words();
    assert!(words.len() > 40, "{}", words.len());
    let mut wrong = Vec::new();
    for target in &TARGETS {
        let inputs = stored(target);
        let mut dice = SplitMix::new(2026);
        for number in 0..runs {
            let pick = |dice: &mut SplitMix| dice.below(inputs.len() as u64) as usize;
            let (seed, other) = (pick(&mut dice), pick(&mut dice));
            let bytes = mutate(&inputs[seed].1, &inputs[other].1, &words, &mut dice);
            wrong.extend(run(target, &bytes, &format!("change {number} of {}", inputs[seed].0.display())));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The list of targets, the programs of `fuzz/` and the folders of stored inputs are the same.
#[test]
fn fuzzed_targets_are_those_of_the_fuzzer() {
    let mut names: Vec<String> = TARGETS.iter().map(|t| t.name.to_string()).collect();
    names.sort();
    let listed = |folder: &str| {
        let entries = fs::read_dir(root().join("fuzz").join(folder)).unwrap();
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().path().file_stem().unwrap().to_str().unwrap().to_string()).collect();
        names.sort();
        names
    };
    assert_eq!(listed("corpus"), names);
    assert_eq!(listed("fuzz_targets"), names);
    let manifest = fs::read_to_string(root().join("fuzz/Cargo.toml")).unwrap();
    for name in &names {
        assert!(manifest.contains(&format!("path = \"fuzz_targets/{name}.rs\"")), "{name}");
        let program = fs::read_to_string(root().join(format!("fuzz/fuzz_targets/{name}.rs"))).unwrap();
        assert!(program.contains(&format!("target(\"{name}\")")), "{program}");
    }
}

/// A change of an input is the same on every run, and is one.
#[test]
fn fuzzed_inputs_are_changed_the_same_way_again() {
    let changed = |seed| {
        let mut dice = SplitMix::new(seed);
        (0..50).map(|_| mutate(b"0123456789", b"abcdefghij", &words(), &mut dice)).collect::<Vec<_>>()
    };
    assert_eq!(changed(1), changed(1));
    assert_ne!(changed(1), changed(2));
    assert!(changed(1).iter().filter(|bytes| bytes.as_slice() != b"0123456789").count() > 40);
}
