//! `vice plugin check`: the conformance suite on a plugin, in a process of its own that may crash or hang.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use anyhow::Context;
use vice_run::core::dataset::OpenOptions;
use vice_run::host::conformance::{Event, Verdict};
use vice_run::host::isolated::death;

use super::child;
use crate::itself::Itself;
use crate::outputs::{JsonArgs, Outputs};
use crate::terminal::{self, Outcome, printable, usage};

/// Arguments of `vice plugin check`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: vice plugin check libvice_adapter_myrobot.so my_recording --json report.json\n\n\
    `good` is as it should be, `missing` is allowed and says what will not work without it, `suspicious` is allowed but \
    looks like a mistake, FAULT breaks the contract. The exit code is 1 where there is a fault."
)]
pub(crate) struct Args {
    /// The plugin, a shared library.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// A data set of its format.
    #[arg(value_name = "DATASET")]
    dataset: PathBuf,
    /// Setting of the format.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = crate::inputs::setting)]
    settings: Vec<(String, String)>,
    /// Times the data set is opened and closed.
    #[arg(long, value_name = "N", default_value = "1000")]
    cycles: u32,
    /// Images that are read of each camera.
    #[arg(long, value_name = "N", default_value = "200")]
    images: usize,
    /// Seconds after which a call counts as hanging.
    #[arg(long, value_name = "S", default_value = "120", value_parser = clap::value_parser!(u64).range(1..))]
    timeout: u64,
    /// Load the plugin even from a file or folder that others may write to.
    #[arg(long)]
    allow_writable_plugin: bool,
    #[command(flatten)]
    json: JsonArgs,
    /// Run the suite itself: what the program starts as its child.
    #[arg(long, hide = true)]
    as_child: bool,
}

pub(crate) fn run(args: &Args, itself: &Itself) -> anyhow::Result<Outcome> {
    if args.as_child {
        return child::run(&child::Task {
            file: &args.file,
            dataset: &args.dataset,
            options: OpenOptions { settings: args.settings.iter().cloned().collect() },
            cycles: args.cycles,
            images: args.images,
            allow_writable: args.allow_writable_plugin,
        });
    }
    let outputs = Outputs::new(&[&args.json.json], &[args.file.clone(), args.dataset.clone()])?;
    if !args.dataset.exists() {
        return Err(usage(format!("{}: no such file or folder", args.dataset.display())));
    }
    let mut child = itself
        .again()
        .arg("--as-child")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .context("the check cannot be started in a process of its own")?;
    let lines = lines_of(&mut child);
    let mut report = Report { quiet: args.json.is_printed(), ..Report::default() };
    let ended = report.follow(&lines, Duration::from_secs(args.timeout))?;
    if ended == Ended::Hangs {
        // It may have ended just now.
        let _ = child.kill();
    }
    let status = child.wait().context("the end of the check cannot be awaited")?;
    match ended {
        Ended::Hangs => {
            let step = report.step.clone();
            report.find(
                Verdict::Fault,
                &format!("it hangs: no answer for {} s during: {step}", args.timeout),
            )?;
        }
        Ended::Early if status.code() == Some(child::LOAD_FAILED) => {
            return Err(anyhow::anyhow!("{}: cannot be checked, see above", args.file.display()));
        }
        Ended::Early => {
            let step = report.step.clone();
            report.find(Verdict::Fault, &format!("it {} during: {step}", death(status)))?;
        }
        Ended::Complete => {}
    }
    report.sum_up()?;
    if let Some(path) = &args.json.json {
        let document = Document {
            schema: "vice.plugin-check/1",
            file: printable(&args.file.display().to_string()),
            dataset: printable(&args.dataset.display().to_string()),
            findings: report.findings.clone(),
            faults: report.count(Verdict::Fault),
        };
        outputs.write_json(path, &document)?;
    }
    match report.count(Verdict::Fault) {
        0 => Ok(Outcome::Done),
        1 => Err(anyhow::anyhow!("{}: 1 fault", args.file.display())),
        n => Err(anyhow::anyhow!("{}: {n} faults", args.file.display())),
    }
}

/// The child's standard output, line by line, read by a thread so that silence can be noticed.
fn lines_of(child: &mut Child) -> Receiver<String> {
    let (send, receive) = channel();
    if let Some(out) = child.stdout.take() {
        std::thread::spawn(move || {
            let mut out = BufReader::new(out);
            let mut line = Vec::new();
            while out.read_until(b'\n', &mut line).is_ok_and(|n| n > 0) {
                let text = String::from_utf8_lossy(&line).trim_end().to_string();
                line.clear();
                if send.send(text).is_err() {
                    break;
                }
            }
        });
    }
    receive
}

/// How the child's report ended.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ended {
    Complete,
    Early,
    Hangs,
}

/// The document `vice.plugin-check/1`.
#[derive(serde::Serialize)]
struct Document {
    schema: &'static str,
    file: String,
    dataset: String,
    findings: Vec<Finding>,
    faults: usize,
}

#[derive(Clone, serde::Serialize)]
struct Finding {
    /// `good`, `missing`, `suspicious` or `fault`.
    verdict: &'static str,
    says: String,
}

#[derive(Default)]
struct Report {
    step: String,
    found: Vec<Verdict>,
    findings: Vec<Finding>,
    prints: bool,
    /// The document takes the place of the text.
    quiet: bool,
}

impl Report {
    fn follow(&mut self, lines: &Receiver<String>, timeout: Duration) -> anyhow::Result<Ended> {
        self.step = "loading the library".to_string();
        loop {
            match lines.recv_timeout(timeout) {
                Ok(line) => match child::parse(&line) {
                    Some(child::Line::Event(Event::Step(step))) => self.step = step,
                    Some(child::Line::Event(Event::Finding(verdict, text))) => self.find(verdict, &text)?,
                    Some(child::Line::End) => return Ok(Ended::Complete),
                    None => self.printed(&line)?,
                },
                Err(RecvTimeoutError::Timeout) => return Ok(Ended::Hangs),
                Err(RecvTimeoutError::Disconnected) => return Ok(Ended::Early),
            }
        }
    }

    fn find(&mut self, verdict: Verdict, text: &str) -> anyhow::Result<()> {
        self.found.push(verdict);
        let word = match verdict {
            Verdict::Good => "good",
            Verdict::Missing => "missing",
            Verdict::Suspicious => "suspicious",
            Verdict::Fault => "FAULT",
        };
        let lower = if verdict == Verdict::Fault { "fault" } else { word };
        self.findings.push(Finding { verdict: lower, says: printable(text) });
        if self.quiet {
            return Ok(());
        }
        terminal::print(&format!("{word:<11} {}\n", printable(text)))
    }

    /// A line that is not of the suite: the plugin's.
    fn printed(&mut self, line: &str) -> anyhow::Result<()> {
        if self.prints || line.trim().is_empty() {
            return Ok(());
        }
        self.prints = true;
        let text = format!("it prints to standard output, into the results of commands: `{line}`");
        self.find(Verdict::Suspicious, &text)
    }

    fn count(&self, verdict: Verdict) -> usize {
        self.found.iter().filter(|v| **v == verdict).count()
    }

    fn sum_up(&self) -> anyhow::Result<()> {
        let count = |verdict| self.count(verdict);
        if self.quiet {
            return Ok(());
        }
        terminal::print(&format!(
            "{} good, {} missing, {} suspicious, {} faults\n",
            count(Verdict::Good),
            count(Verdict::Missing),
            count(Verdict::Suspicious),
            count(Verdict::Fault)
        ))
    }
}
