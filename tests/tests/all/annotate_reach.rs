//! How the annotator's page is reached: what is printed, and what is warned of.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::time::Duration;

use vice_tests::vice_program;

use crate::annotate::Run;

/// First line of the standard output, and the standard error of a moment after that.
fn says(run: &Run, more: &[&str], path: Option<&str>) -> (String, String) {
    let args: Vec<String> =
        run.args(more).into_iter().filter(|a| path.is_none() || a != "--no-open").collect();
    let mut command = Command::new(vice_program());
    command.args(args).stdout(Stdio::piped()).stderr(Stdio::piped()).env_remove("BROWSER");
    if let Some(path) = path {
        command.env("PATH", path);
    }
    let mut child = command.spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    // What is warned of stands beside the address or is not seen at all.
    std::thread::sleep(Duration::from_millis(1500));
    child.kill().unwrap();
    child.wait().unwrap();
    let mut warned = String::new();
    child.stderr.take().unwrap().read_to_string(&mut warned).unwrap();
    (line, warned)
}

#[test]
fn others_are_let_in_with_a_warning_only() {
    let run = Run::new();
    let (line, warned) = says(&run, &[], None);
    assert!(line.starts_with("http://127.0.0.1:") && line.contains("/open?token="), "{line}");
    assert!(!warned.contains("warning"), "{warned}");
    let (line, warned) = says(&run, &["--bind", "0.0.0.0"], None);
    assert!(line.is_empty() && warned.contains("--insecure"), "{line} {warned}");
    let (line, warned) = says(&run, &["--bind", "0.0.0.0", "--insecure"], None);
    assert!(line.starts_with("http://127.0.0.1:"), "{line}");
    assert!(warned.contains("--bind 0.0.0.0") && warned.contains("nothing is encrypted"), "{warned}");
}

#[test]
fn without_a_browser_the_address_is_enough() {
    let run = Run::new();
    let empty = run.path("empty");
    std::fs::create_dir(&empty).unwrap();
    let (line, warned) = says(&run, &[], empty.to_str());
    assert!(line.starts_with("http://127.0.0.1:"), "{line}");
    assert!(warned.contains("no browser could be opened"), "{warned}");
}
