//! What a person sees on the terminal: one line an error, warnings, progress.

mod narrow;

use std::borrow::Cow;
use std::fmt;
use std::io::{IsTerminal, Write};

use indicatif::{ProgressBar, ProgressStyle};
use tracing_subscriber::fmt::format::Writer;
use tracing_subscriber::fmt::{FmtContext, FormatEvent, FormatFields};
use tracing_subscriber::registry::LookupSpan;
use vice_run::core::error::{DataError, ErrorKind};
use vice_run::core::suspicion::Suspicion;
use vice_run::error::RunError;
pub(crate) use vice_run::text::printable;
use vice_run::text::with_options;

/// How a command ended that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// All is done.
    Done,
    /// Done, but more labels than allowed could not be scored.
    TooManySkips,
    /// Done, and a check found something wrong, or nothing certain.
    SomethingWrong,
    /// Done, but a limit that was required is broken.
    RequirementBroken,
    /// The rest is done, but some runs of a batch failed.
    RunsFailed,
    /// A signal ended it before all was done.
    Interrupted,
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
    fn progress(self, what: &'static str) -> ProgressBar {
        if self.quiet || !std::io::stderr().is_terminal() {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len} {eta}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::new(0).with_style(style).with_message(what)
    }

    /// A bar over the runs of a batch, with what `{msg}` says of failures.
    pub(crate) fn runs_bar(self) -> ProgressBar {
        let bar = self.progress("");
        let template = "{pos}/{len} [{bar:30}] {per_sec} {eta} left, {msg} failed";
        bar.with_style(
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()),
        )
        .with_message("0")
    }

    /// Whether only errors and results are said.
    pub(crate) const fn is_quiet(self) -> bool {
        self.quiet
    }

    /// A remark that is neither a result nor a warning.
    pub(crate) fn note(self, text: &str) {
        if !self.quiet {
            let _ = writeln!(std::io::stderr(), "{}", printable(text));
        }
    }
}

/// Runs work under a bar that shows what it is at.
pub(crate) fn with_progress<T>(
    verbosity: Verbosity,
    work: impl FnOnce(&(dyn Fn(&'static str, usize, usize) + Sync)) -> T,
) -> T {
    let bar = verbosity.progress("");
    let result = work(&|what, done, total| {
        // How much there is may only be known by then.
        bar.set_message(what);
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    result
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
pub(crate) fn wrong_usage(error: &clap::Error) -> u8 {
    use clap::error::ErrorKind;
    if matches!(
        error.kind(),
        ErrorKind::DisplayHelp
            | ErrorKind::DisplayVersion
            | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand
    ) {
        // Nothing is left to tell if even this cannot be printed.
        let _ = error.print();
        return u8::from(error.use_stderr()) * 2;
    }
    let text = error.to_string();
    // The usage and the pointer to help come after what is wrong and its tips.
    let what = text.split("\n\nUsage:").next().unwrap_or(&text);
    let what = what.split("\n\nFor more information").next().unwrap_or(what);
    let words: Vec<&str> = what.split_whitespace().collect();
    let _ = writeln!(std::io::stderr(), "{} (see --help)", printable(&words.join(" ")));
    2
}

/// Prints an error and its causes on one line.
pub(crate) fn print_error(error: &anyhow::Error) {
    let _ = writeln!(std::io::stderr(), "error: {}", printable(&told(error)));
}

/// Says what looks wrong in the data, a line each.
pub(crate) fn warn<'a>(suspicions: impl IntoIterator<Item = &'a Suspicion>) {
    for suspicion in suspicions {
        tracing::warn!("{}", with_options(&suspicion.line()));
    }
}

/// An error and its causes on one line, each said once, with fields of a request as options.
pub(crate) fn told(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain() {
        let text = one(cause);
        // Wrappers repeat what they wrap, with a place before or a hint behind it.
        if !line.contains(&text) {
            line = if line.is_empty() { text } else { format!("{line}: {text}") };
        }
    }
    line
}

/// One error by itself. Only what this program's libraries say has names of fields in it, never what comes from data.
fn one(error: &(dyn std::error::Error + 'static)) -> String {
    if let Some(error) = error.downcast_ref::<RunError>() {
        let field = error.field().map_or_else(String::new, |field| format!("--{field}: "));
        let own = error.problem();
        let problem = match std::error::Error::source(error) {
            Some(cause) if own.is_empty() => one(cause),
            _ => own.to_string(),
        };
        let hint = error.hint().map_or_else(String::new, |hint| format!(" ({})", with_options(hint)));
        return format!("{field}{problem}{hint}");
    }
    match error.downcast_ref::<DataError>() {
        // The hint ends the text of an error of data.
        Some(data) => match data.hint_text() {
            Some(hint) => {
                let text = data.to_string();
                let before = text.strip_suffix(&format!("({hint})")).unwrap_or(&text);
                format!("{before}({})", with_options(hint))
            }
            None => data.to_string(),
        },
        None => error.to_string(),
    }
}

/// The exit code of an error: 2 where the request makes no sense, else 1.
pub(crate) fn exit_code(error: &anyhow::Error) -> u8 {
    let usage = error.chain().any(|cause| {
        cause.is::<UsageError>()
            || cause.downcast_ref::<RunError>().is_some_and(|e| e.kind() == ErrorKind::Usage)
            || cause.downcast_ref::<DataError>().is_some_and(|e| e.kind() == ErrorKind::Usage)
    });
    if usage { 2 } else { 1 }
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
    let out = std::io::stdout();
    // What goes into a file or a pipe stays as it is.
    let text = match terminal_size::terminal_size_of(&out) {
        Some((terminal_size::Width(width), _)) if out.is_terminal() => {
            Cow::Owned(narrow::fitted(text, usize::from(width)))
        }
        _ => Cow::Borrowed(text),
    };
    let mut out = out.lock();
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
        assert_eq!(printable(&told(&error)), "cannot write x: disk on fire");
        let twice = anyhow::anyhow!("same").context("same");
        assert_eq!(told(&twice), "same");
    }

    #[test]
    fn fields_of_a_request_are_options_and_exit_codes_follow_from_the_kind() {
        let wrong = RunError::usage("anchor", "there is no `reference`").advise("give `reference`, not `x`");
        let error = anyhow::Error::new(wrong);
        assert_eq!(told(&error), "--anchor: there is no `reference` (give --reference, not `x`)");
        assert_eq!(exit_code(&error), 2);
        let data = DataError::of_kind(ErrorKind::Missing, "no such `labels`").at("a").hint("see `labels`");
        let error = anyhow::Error::new(RunError::from(data)).context("first");
        assert_eq!(told(&error), "first: a: no such `labels` (see --labels)");
        assert_eq!(exit_code(&error), 1);
    }
}
