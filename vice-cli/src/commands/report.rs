//! `vice report`: result documents as a page.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use vice_run::core::dataset::Dataset;
use vice_run::formats;
use vice_run::open::Opened;
use vice_run::report::assessment::Assessment;
use vice_run::report::frames::Shots;
use vice_run::report::html::{IMAGE_BUDGET_BYTES, Run, render};
use vice_run::request::Request;
use vice_run::result::{self, ResultDocument};

use crate::inputs::PluginArgs;
use crate::outputs::Outputs;
use crate::terminal::{Outcome, Verbosity, printable, told, usage, with_progress};

/// Arguments of `vice report`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  vice report out.json --out report.html\n  \
    vice report monday.json tuesday.json --out week.html --dataset /archive/V1_01_easy\n\n\
    The page is one file with all its images. It begins with the answer: can each estimate be trusted, how far is it off, what is \
    wrong, what to do. Images, diagnosis and checks read the data set that the result names; if it has moved, use --dataset.")]
pub(crate) struct Args {
    /// Result documents, as `vice evaluate --json` writes them.
    #[arg(value_name = "RESULT.json", required = true)]
    results: Vec<PathBuf>,
    /// The page to write; - prints it.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Where the data set is now.
    #[arg(long, value_name = "DIR")]
    dataset: Option<PathBuf>,
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    plugins: PluginArgs,
}

/// What a page holds beside the result.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Page")]
pub(crate) struct PageArgs {
    /// Leave out the diagnosis and the checks, which take longer than the page.
    #[arg(long)]
    no_diagnosis: bool,
    /// Say on the page when and on which computer it was made.
    #[arg(long)]
    stamp: bool,
}

impl PageArgs {
    /// These options ask for something on a page.
    pub(crate) fn refuse_without_a_page(&self) -> anyhow::Result<()> {
        for (asked, name) in [(self.no_diagnosis, "--no-diagnosis"), (self.stamp, "--stamp")] {
            if asked {
                return Err(usage(format!("{name} is about the page: name one with --report")));
            }
        }
        Ok(())
    }
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let mut inputs = args.results.clone();
    inputs.extend(args.dataset.clone());
    let out = Some(args.out.clone());
    let outputs = Outputs::new(&[&out], &inputs)?;
    let documents: Vec<ResultDocument> = args.results.iter().map(result::read).collect::<Result<_, _>>()?;
    result::check_unmixed(&documents)?;
    // The data sets are inputs too, which only the documents name.
    let named: Vec<PathBuf> = documents.iter().map(|d| d.request.dataset.path.clone()).collect();
    Outputs::new(&[&out], &named)?;
    let budget = IMAGE_BUDGET_BYTES / documents.len().max(1);
    let several = documents.len() > 1;
    let runs: Vec<Run> = documents
        .into_iter()
        .zip(&args.results)
        .map(|(document, path)| {
            let mut run = read_again(document, args, budget, verbosity);
            warn_of_pictures(&run, path);
            if several {
                let file = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
                run.name = format!("{}: {}", printable(&file), run.name);
            }
            run
        })
        .collect();
    outputs.write(&[(&args.out, render(&runs)?)])?;
    Ok(Outcome::Done)
}

/// A run of which as much is read again as is still there.
fn read_again(document: ResultDocument, args: &Args, budget_bytes: usize, verbosity: Verbosity) -> Run {
    let not_diagnosed = |why: &str| Assessment::not_run(format!("no diagnosis could be made: {why}"));
    let mut run = match open(&document, args) {
        Ok((request, dataset)) => match request.dataset.apply_to(Arc::clone(&dataset)) {
            Ok(opened) => run_of(document, &request, &opened, budget_bytes, &args.page, verbosity),
            // A calibration that is gone leaves the pictures.
            Err(error) => {
                let shots = Shots::of(&document, dataset.as_ref(), budget_bytes, &|_, _| {});
                let assessment = not_diagnosed(&told(&error.into()));
                Run::new(document, shots, assessment)
            }
        },
        Err(error) => {
            let why = format!("{}; --dataset DIR says where the data set is", told(&error));
            let assessment = not_diagnosed(&why);
            Run::new(document, Shots::missing(why), assessment)
        }
    };
    run.stamp = args.page.stamp.then(stamp);
    run
}

/// A run with its pictures and what is to be said of it, under a bar.
pub(crate) fn run_of(
    document: ResultDocument,
    request: &Request,
    opened: &Opened,
    budget_bytes: usize,
    page: &PageArgs,
    verbosity: Verbosity,
) -> Run {
    with_progress(verbosity, |progress| {
        let shots = Shots::of(&document, opened.dataset.as_ref(), budget_bytes, &|done, total| {
            progress("reading images", done, total);
        });
        let assessment = match page.no_diagnosis {
            true => Assessment::not_run("no diagnosis was asked for (`--no-diagnosis`)"),
            false => request.assess(opened, progress),
        };
        let mut run = Run::new(document, shots, assessment);
        run.stamp = page.stamp.then(stamp);
        run
    })
}

/// Says which pictures a page lacks.
pub(crate) fn warn_of_pictures(run: &Run, page: &Path) {
    if let Some(problem) = &run.shots.problem {
        tracing::warn!("{}: {problem}", page.display());
    }
}

/// When it is, and on which computer.
fn stamp() -> String {
    let seconds = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    let variable = ["HOSTNAME", "COMPUTERNAME"].into_iter().find_map(|name| std::env::var(name).ok());
    let host = std::fs::read_to_string("/proc/sys/kernel/hostname").ok().or(variable);
    let host = host.map(|h| printable(h.trim())).filter(|h| !h.is_empty());
    format!("made {} on {}", utc(seconds), host.as_deref().unwrap_or("an unnamed computer"))
}

/// Seconds since 1970 as a date and time of the Gregorian calendar.
fn utc(seconds: u64) -> String {
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    let is_leap =
        |year: u64| year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let (mut year, mut day) = (1970, days);
    while day >= 365 + u64::from(is_leap(year)) {
        day -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let lengths = [31, 28 + u64::from(is_leap(year)), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    let mut month = 0;
    while day >= lengths[month] {
        day -= lengths[month];
        month += 1;
    }
    format!("{year}-{:02}-{:02} {:02}:{:02} UTC", month + 1, day + 1, rest / 3600, rest / 60 % 60)
}

/// Opens the data set that a document names, or the folder it moved to, with the settings it was opened with; and asks the
/// document's question of that.
fn open(document: &ResultDocument, args: &Args) -> anyhow::Result<(Request, Arc<dyn Dataset>)> {
    let mut request = document.request.clone();
    let asked = &mut request.dataset;
    if let Some(moved) = &args.dataset {
        asked.path.clone_from(moved);
    }
    anyhow::ensure!(!asked.path.as_os_str().is_empty(), "the result does not say where its data set is");
    let mut plugins = args.plugins.spec();
    // Those that read it then; who moved it may have moved them, too.
    plugins.files.extend(asked.plugins.files.iter().filter(|f| f.is_file()).cloned());
    let registry = formats::registry(&plugins)?;
    let known = registry.by_name(&document.dataset.format).is_ok();
    asked.plugins = plugins;
    asked.format = known.then(|| document.dataset.format.clone());
    let dataset = asked.open_raw(&registry)?;
    Ok((request, dataset))
}

#[cfg(test)]
mod tests {
    use super::utc;

    #[test]
    fn days_are_those_of_the_calendar() {
        // By `date -u -d @SECONDS`.
        assert_eq!(utc(0), "1970-01-01 00:00 UTC");
        assert_eq!(utc(951_782_399), "2000-02-28 23:59 UTC");
        assert_eq!(utc(951_782_400), "2000-02-29 00:00 UTC");
        assert_eq!(utc(4_107_542_400), "2100-03-01 00:00 UTC");
        assert_eq!(utc(1_798_761_599), "2026-12-31 23:59 UTC");
    }
}
