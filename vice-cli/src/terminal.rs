//! What a person sees on the terminal: one line an error, warnings, progress.

use std::fmt;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;

use indicatif::{ProgressBar, ProgressStyle};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;
use vice_core::error::one_line;

/// How a command ended that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All is done.
    Done,
    /// Done, but more labels than allowed could not be scored.
    TooManySkips,
}

/// Options that do not fit together or the data: exit code 2.
#[derive(Debug)]
pub(crate) struct UsageError(pub(crate) String);

impl fmt::Display for UsageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for UsageError {}

/// A usage error as any error.
pub(crate) fn usage(text: impl Into<String>) -> anyhow::Error {
    anyhow::Error::new(UsageError(text.into()))
}

/// How much is said on standard error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Verbosity {
    quiet: bool,
    verbose: u8,
}

impl Verbosity {
    pub(crate) const fn new(quiet: bool, verbose: u8) -> Self {
        Self { quiet, verbose }
    }

    /// A bar for long work, drawn only on a terminal.
    pub(crate) fn progress(self, what: &'static str) -> ProgressBar {
        if self.quiet || !std::io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len} {eta}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::new(0).with_style(style).with_message(what)
    }

    /// A remark that is neither a result nor a warning.
    pub(crate) fn note(self, text: &str) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr(), "{}", printable(text));
        }
    }
}

/// Moves a bar to where the work is; how much there is may only be known by then.
pub(crate) fn advance(bar: &ProgressBar, done: usize, total: usize) {
    bar.set_length(total as u64);
    bar.set_position(done as u64);
}

/// Sends warnings of the libraries to standard error.
pub(crate) fn show_warnings(verbosity: Verbosity) {
    let level = match (verbosity.quiet, verbosity.verbose) {
        (true, _) => tracing::Level::ERROR,
        (false, 0) => tracing::Level::WARN,
        (false, 1) => tracing::Level::INFO,
        (false, _) => tracing::Level::DEBUG,
    };
    let subscriber = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .event_format(OneLine)
        .finish();
    // Fails only where one is set already, and nothing else sets one.
    let _ = tracing::subscriber::set_global_default(subscriber);
}

/// `warning: text`, on one line.
struct OneLine;

impl<S, N> FormatEvent<S, N> for OneLine
where
    S: tracing::Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &tracing::Event<'_>,
    ) -> fmt::Result {
        let name = match *event.metadata().level() {
            tracing::Level::ERROR => "error",
            tracing::Level::WARN => "warning",
            tracing::Level::INFO => "info",
            _ => "debug",
        };
        let mut text = String::new();
        context.field_format().format_fields(Writer::new(&mut text), event)?;
        writeln!(writer, "{name}: {}", printable(&text))
    }
}

/// Help and version as they are; what is wrong with the command line on one line, as every other error.
pub(crate) fn wrong_usage(error: &clap::Error) -> ExitCode {
    use clap::error::ErrorKind;
    if matches!(
        error.kind(),
        ErrorKind::DisplayHelp
            | ErrorKind::DisplayVersion
            | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
    ) {
        // Nothing is left to tell if even this cannot be printed.
        let _ = error.print();
        return ExitCode::from(u8::from(error.use_stderr()) * 2);
    }
    let text = error.to_string();
    // The usage and the pointer to help come after what is wrong and its tips.
    let what = text.split("\n\nUsage:").next().unwrap_or(&text);
    let what = what.split("\n\nFor more information").next().unwrap_or(what);
    let words: Vec<&str> = what.split_whitespace().collect();
    let _ = writeln!(std::io::stderr(), "{} (see --help)", printable(&words.join(" ")));
    ExitCode::from(2)
}

/// Prints an error and its causes on one line.
pub(crate) fn print_error(error: &anyhow::Error) {
    let _ = writeln!(std::io::stderr(), "error: {}", printable(&one_line(error.as_ref())));
}

/// Text from data made safe for a terminal: control characters would move its cursor or change its colours, and those
/// that turn the direction of writing would show a name as another one.
pub(crate) fn printable(text: &str) -> String {
    let turns =
        |c: char| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let breaks = |c: char| matches!(c, '\u{2028}' | '\u{2029}');
    text.chars().map(|c| if c.is_control() || turns(c) || breaks(c) { ' ' } else { c }).collect()
}

/// Whether the reader of standard output went away, as `head` does: no failure of ours.
pub(crate) fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|e| e.downcast_ref::<std::io::Error>())
        .any(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
}

/// Writes results to standard output.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn an_error_is_one_line_and_says_each_cause_once() {
        let io = std::io::Error::other("disk on\nfire");
        let error = Err::<(), _>(io).context("cannot write x").unwrap_err();
        assert_eq!(printable(&one_line(error.as_ref())), "cannot write x: disk on fire");
        let twice = anyhow::anyhow!("same").context("same");
        assert_eq!(one_line(twice.as_ref()), "same");
        assert_eq!(printable("a\u{1b}[31mb"), "a [31mb");
        assert_eq!(printable("gpj.\u{202e}txt\u{2028}"), "gpj. txt ");
    }
}
