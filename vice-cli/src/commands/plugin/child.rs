//! The process in which the conformance suite runs, and the lines by which it tells its parent.

use std::io::Write;
use std::path::Path;
use std::process;

use vice_run::core::dataset::OpenOptions;
use vice_run::host::conformance::{self, Event, Subject, Thoroughness, Verdict};
use vice_run::host::{LoadOptions, Plugin};

use crate::terminal::{self, Outcome, printable};

/// Exit code where the library does not load: the error was printed.
pub(super) const LOAD_FAILED: i32 = 90;
/// Starts each line of the suite, so that it differs from what a plugin prints.
const MARK: &str = "\u{1e}vice-check ";

/// A line of the suite.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Line {
    Event(Event),
    End,
}

/// What is checked, and how thoroughly.
pub(super) struct Task<'a> {
    pub(super) file: &'a Path,
    pub(super) dataset: &'a Path,
    pub(super) options: OpenOptions,
    pub(super) cycles: u32,
    pub(super) images: usize,
    pub(super) allow_writable: bool,
}

pub(super) fn run(task: &Task<'_>) -> anyhow::Result<Outcome> {
    let options = LoadOptions { allow_writable: task.allow_writable };
    let plugin = match Plugin::load(task.file, &options) {
        Ok(plugin) => plugin,
        Err(error) => {
            terminal::print_error(&anyhow::Error::new(error));
            process::exit(LOAD_FAILED);
        }
    };
    let subject =
        Subject { factory: &plugin, plugin: Some(&plugin), path: task.dataset, options: &task.options };
    let thorough = Thoroughness { cycles: task.cycles, images: task.images, ..Thoroughness::default() };
    conformance::check(&subject, &thorough, &mut |event| tell(&event));
    write("end", "");
    Ok(Outcome::Done)
}

fn tell(event: &Event) {
    match event {
        Event::Step(text) => write("step", text),
        Event::Finding(verdict, text) => write(word(*verdict), text),
    }
}

fn write(word: &str, text: &str) {
    let mut out = std::io::stdout().lock();
    let line = format!("{MARK}{word} {}\n", printable(text));
    if out.write_all(line.as_bytes()).and_then(|()| out.flush()).is_err() {
        // The parent is gone, and with it whoever wanted to know.
        process::exit(1);
    }
}

const fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Good => "good",
        Verdict::Missing => "missing",
        Verdict::Suspicious => "suspicious",
        Verdict::Fault => "fault",
    }
}

/// A line of the suite; `None` for one that is not.
pub(super) fn parse(line: &str) -> Option<Line> {
    // What a plugin prints without ending the line stands before the mark.
    let (_, line) = line.split_once(MARK)?;
    let (first, text) = line.split_once(' ').unwrap_or((line, ""));
    if first == "end" {
        return Some(Line::End);
    }
    if first == "step" {
        return Some(Line::Event(Event::Step(text.to_string())));
    }
    let verdicts = [Verdict::Good, Verdict::Missing, Verdict::Suspicious, Verdict::Fault];
    let verdict = verdicts.into_iter().find(|v| word(*v) == first)?;
    Some(Line::Event(Event::Finding(verdict, text.to_string())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_the_suite_differ_from_what_a_plugin_prints() {
        assert_eq!(parse("hello"), None);
        assert_eq!(parse("fault x"), None);
        assert_eq!(parse(&format!("{MARK}end")), Some(Line::End));
        let fault = Line::Event(Event::Finding(Verdict::Fault, "two words".to_string()));
        assert_eq!(parse(&format!("no newline{MARK}fault two words")), Some(fault));
        assert_eq!(parse(&format!("{MARK}nonsense two")), None);
    }
}
