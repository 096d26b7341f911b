//! Every `vice` command in the README and docs/ is run, on a small flight under the names that the docs use; those that need
//! more than that say so in their fence (`sh no-run REASON`), and their options are read by the program all the same.
//! Links between the pages lead somewhere.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use vice_synthetic::{Synthetic, SyntheticOptions, write_euroc};
use vice_tests::{root, vice_in};

/// Exit code of a check that found something, of a flight that is too short for a clock.
const FOUND_SOMETHING: i32 = 3;

/// The pages.
fn pages() -> Vec<PathBuf> {
    let docs = fs::read_dir(root().join("docs")).unwrap().map(|e| e.unwrap().path());
    let mut pages: Vec<PathBuf> = docs.filter(|p| p.extension().is_some_and(|e| e == "md")).collect();
    pages.extend(["README.md", "CONTRIBUTING.md"].map(|name| root().join(name)));
    pages.sort();
    pages
}

/// A command on a page.
struct Command {
    /// `docs/report.md:12`.
    place: String,
    line: String,
    run: bool,
}

/// Lines of fences with `sh`, or without a language, that call `vice`. A backslash goes on, `#` begins a comment.
fn commands(page: &Path) -> Vec<Command> {
    let text = fs::read_to_string(page).unwrap();
    let shown = page.strip_prefix(root()).unwrap().display().to_string();
    let mut found: Vec<Command> = Vec::new();
    let (mut fence, mut goes_on): (Option<String>, bool) = (None, false);
    for (number, line) in (1..).zip(text.lines()) {
        if let Some(info) = line.trim_start().strip_prefix("```") {
            fence = if fence.is_some() { None } else { Some(info.trim().to_string()) };
            goes_on = false;
            continue;
        }
        let Some(info) = &fence else { continue };
        let mut words = info.split_whitespace();
        let language = words.next().unwrap_or_default();
        if !["", "sh"].contains(&language) {
            continue;
        }
        let line = line.split(" #").next().unwrap_or_default().trim();
        let (code, more) = line.strip_suffix('\\').map_or((line, false), |code| (code.trim(), true));
        if goes_on && let Some(last) = found.last_mut() {
            write!(last.line, " {code}").unwrap();
        } else if code.starts_with("vice ") {
            let no_run = words.next() == Some("no-run");
            assert!(
                !no_run || words.next().is_some(),
                "{shown}:{number}: say in the fence why it is not run"
            );
            let place = format!("{shown}:{number}");
            found.push(Command { place, line: code.to_string(), run: !no_run });
        } else {
            continue;
        }
        goes_on = more;
    }
    found
}

fn words(command: &Command) -> Vec<String> {
    assert!(
        !command.line.contains(['\'', '"', '$']),
        "{}: no quotes are read here: {}",
        command.place,
        command.line
    );
    command.line.split_whitespace().skip(1).map(str::to_string).collect()
}

/// A flight in small pictures, and files under the names of the docs.
fn scene(folder: &Path) {
    let options =
        SyntheticOptions { duration_s: 8.0, rate_hz: 10.0, width: 160, height: 120, ..Default::default() };
    let flight = Synthetic::new(options).unwrap();
    let recording = folder.join("V1_01_easy");
    write_euroc(&flight, &recording, false, &|_, _| {}).unwrap();
    let copy = |from: &str, to: &str| {
        fs::copy(recording.join(from), folder.join(to)).unwrap_or_else(|e| panic!("{from}: {e}"));
    };
    copy("labels/floor.csv", "floor.csv");
    copy("labels/floor.csv", "mine.csv");
    copy("labels/floor.csv", "yours.csv");
    copy("labels/floor.csv", "my.csv");
    copy("estimates/clock-offset.txt", "openvins.txt");
    copy("estimates/drift.txt", "estimate.txt");
    copy("mav0/state_groundtruth_estimate0/data.csv", "ground_truth.csv");
    let row = "run_id,dataset,labels,estimate\none,V1_01_easy,floor.csv,openvins.txt\n";
    fs::write(folder.join("flights.csv"), row).unwrap();
    for (name, estimate) in [("monday.json", "openvins.txt"), ("tuesday.json", "openvins.txt")] {
        let args = [
            "evaluate",
            "V1_01_easy",
            "--labels",
            "floor.csv",
            "--estimate",
            estimate,
            "--json",
            name,
            "--quiet",
        ];
        let run = vice_in(folder, &args);
        assert_eq!(run.code, 0, "{}", run.stderr);
    }
}

#[test]
fn every_command_of_the_docs_does_what_it_says() {
    let folder = tempfile::tempdir().unwrap();
    scene(folder.path());
    let (mut run, mut read, mut wrong) = (0, 0, String::new());
    for command in pages().iter().flat_map(|page| commands(page)) {
        let mut args = words(&command);
        if !command.run {
            // Options that are not there and values that cannot be read are refused before the help is shown.
            args.push("--help".to_string());
        }
        let done = vice_in(folder.path(), &args);
        let may_find = ["check", "clock"].contains(&args[0].as_str()) && done.code == FOUND_SOMETHING;
        if done.code != 0 && !may_find {
            writeln!(wrong, "{}: {}\n    {} {}", command.place, command.line, done.code, done.stderr.trim())
                .unwrap();
        }
        if command.run { run += 1 } else { read += 1 }
    }
    assert!(wrong.is_empty(), "{wrong}");
    // Whoever turns the rest of the docs into no-run has to say so here.
    assert!(run >= 20 && read >= 15, "{run} were run, {read} read");
}

/// What GitHub makes of a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// Targets of Markdown links outside of code.
fn links(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut in_fence = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            in_fence = !in_fence;
        }
        if in_fence {
            continue;
        }
        for part in line.split("](").skip(1) {
            found.extend(part.split(')').next().map(str::to_string));
        }
    }
    found
}

#[test]
fn links_between_the_pages_lead_somewhere() {
    let (mut count, mut wrong) = (0, String::new());
    for page in pages().into_iter().chain([root().join("CHANGELOG.md")]) {
        let text = fs::read_to_string(&page).unwrap();
        for link in links(&text).into_iter().filter(|l| !l.contains("://")) {
            count += 1;
            let (file, place) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            if !target.exists() {
                writeln!(wrong, "{}: {link} is not there", page.display()).unwrap();
            } else if !place.is_empty() {
                let text = fs::read_to_string(&target).unwrap();
                let headings =
                    text.lines().filter_map(|l| l.strip_prefix('#')).map(|l| l.trim_start_matches('#'));
                if !headings.map(anchor).any(|a| a == place) {
                    writeln!(wrong, "{}: {link}: no such heading", page.display()).unwrap();
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    assert!(count > 30, "{count}");
}
