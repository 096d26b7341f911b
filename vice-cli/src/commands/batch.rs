//! `vice batch`: many flights by one manifest.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use vice_run::batch::scan::scan;
use vice_run::batch::{Event, Keep, Manifest, Options, Shard, State, Store, Summary, plan, run as run_batch};
use vice_run::files::atomic::{self, Overwrite};
use vice_run::files::tables::HAS_PARQUET;

use super::batch_collect;
use crate::signals;
use crate::terminal::{self, Outcome, Verbosity, printable, usage};

/// Arguments of `vice batch`.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = "Examples:\n  \
    vice batch flights.toml --out out && vice table out\n  \
    vice batch flights.csv --out out --shard 2/4   (one of four machines)\n  \
    vice batch --scan /data/flights flights.csv   (writes a manifest of what is there)\n  \
    vice batch collect out\n\n\
    A row of the manifest is a run: run_id, group, dataset, and any option of `vice evaluate` by its name. Paths are \
    relative to the manifest. Runs that are in --out already are skipped, so run the same command again to resume.\n\n\
    Exit code: 0 done, 1 failed or a run failed, 2 wrong usage, 130 stopped by a signal.")]
pub(crate) struct Args {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    runs: RunArgs,
}

/// What else can be done with a batch.
#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Make one table of the results.
    Collect(batch_collect::Args),
}

#[derive(Debug, clap::Args)]
struct RunArgs {
    /// Manifest, .csv, .toml or .parquet; with --scan the one that is written.
    #[arg(value_name = "MANIFEST", required_unless_present = "scan")]
    manifest: Option<PathBuf>,
    /// Folder of the results; made if it is not there.
    #[arg(long, value_name = "DIR", required_unless_present = "scan")]
    out: Option<PathBuf>,
    /// Runs at a time [default: one for each core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Only part I of N of the runs.
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: Shard,
    /// Try a run that failed so many times more; what makes no sense is not tried again.
    #[arg(long, value_name = "K", default_value = "0")]
    retry: u16,
    /// Exit with 0 though runs failed, so that a script goes on: their rows say why.
    #[arg(long)]
    keep_going: bool,
    /// Keep the scored samples of each run, which the table compares estimators with [default: parquet, where this build
    /// has it].
    #[arg(long, value_enum, value_name = "FORMAT")]
    samples: Option<SamplesAs>,
    /// Make a report of each run, without pictures, which the table as a page links to.
    #[arg(long)]
    reports: bool,
    /// Say what would be run; nothing is run or written.
    #[arg(long, conflicts_with_all = ["jobs", "retry", "keep_going", "progress"])]
    dry_run: bool,
    /// Show a bar, or print one line of JSON for each run that ended.
    #[arg(long, value_enum, value_name = "HOW", default_value = "bar")]
    progress: Progress,
    /// Write a manifest of all data sets below this folder, as CSV; without MANIFEST it is printed.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["out", "jobs", "shard", "retry", "keep_going", "dry_run", "progress", "samples", "reports"])]
    scan: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum SamplesAs {
    None,
    Parquet,
}

impl RunArgs {
    fn keep(&self) -> anyhow::Result<Keep> {
        let samples = self.samples.map_or(HAS_PARQUET, |s| s == SamplesAs::Parquet);
        if samples && !HAS_PARQUET {
            return Err(usage("--samples parquet: this vice was built without its feature `parquet`"));
        }
        Ok(Keep { samples, reports: self.reports })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Progress {
    Bar,
    Json,
}

/// Set by a signal. A program runs one batch.
static STOP: AtomicBool = AtomicBool::new(false);

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let runs = &args.runs;
    match (&args.command, &runs.scan, &runs.manifest, &runs.out) {
        (Some(Command::Collect(collect)), ..) => batch_collect::run(collect, verbosity),
        (None, Some(folder), manifest, _) => write_manifest(folder, manifest.as_deref(), verbosity),
        (None, None, Some(manifest), Some(out)) => {
            let manifest = Manifest::read(manifest)?;
            let store = Store::new(out);
            if runs.dry_run {
                dry_run(&manifest, &store, runs.shard, runs.keep()?)
            } else {
                run_all(&manifest, &store, runs, verbosity)
            }
        }
        _ => Err(usage("name a manifest and --out, or `vice batch collect`")),
    }
}

fn write_manifest(folder: &Path, manifest: Option<&Path>, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let Some(path) = manifest else {
        terminal::print(&scan(folder, Path::new(""))?)?;
        return Ok(Outcome::Done);
    };
    if path.extension().is_none_or(|e| e != "csv") {
        return Err(usage(format!("{}: a scan writes CSV; name a file that ends in .csv", path.display())));
    }
    // The data may be named from here and the manifest lie elsewhere: only what is below it can be said relative to it.
    let base = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let text = scan(&folder.canonicalize()?, &base.canonicalize()?)?;
    atomic::write(path, Overwrite::Refuse, |out| out.write_all(text.as_bytes()))?;
    let found = text.lines().count() - 1;
    verbosity.note(&format!("{found} data sets are in {}: look at labels and estimate", path.display()));
    Ok(Outcome::Done)
}

fn dry_run(manifest: &Manifest, store: &Store, shard: Shard, keep: Keep) -> anyhow::Result<Outcome> {
    let mut text = String::new();
    let mut wrong = false;
    for planned in plan(manifest, store, shard, keep) {
        let (state, key) = match &planned.key {
            Ok(key) if planned.is_there => ("there", key.to_string()),
            Ok(key) => ("to run", key.to_string()),
            Err(error) => ("failed", error.clone()),
        };
        wrong |= planned.key.is_err();
        text.push_str(&format!("{state}\t{}\t{}\n", printable(&planned.row.run_id), printable(&key)));
    }
    terminal::print(&text)?;
    Ok(if wrong { Outcome::RunsFailed } else { Outcome::Done })
}

fn run_all(
    manifest: &Manifest,
    store: &Store,
    args: &RunArgs,
    verbosity: Verbosity,
) -> anyhow::Result<Outcome> {
    signals::stop_at_first(&STOP, verbosity);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = args.jobs.map_or(cores, usize::from);
    let options = Options { jobs, shard: args.shard, retry: usize::from(args.retry), keep: args.keep()? };
    let begun = Instant::now();
    let bar = verbosity.runs_bar();
    let tell = |event: &Event<'_>| {
        let summary = event.summary;
        if args.progress == Progress::Json {
            // Who reads the lines may be gone; the runs go on.
            let _ = terminal::print(&json_line(event, begun.elapsed().as_secs_f64()));
        } else {
            bar.set_length(summary.total as u64);
            bar.set_position(summary.ended() as u64);
            bar.set_message(summary.failed.to_string());
        }
        if let Some(error) = &event.record.error {
            bar.suspend(|| tracing::warn!("{}: {error}", event.record.run_id));
        }
    };
    let summary = run_batch(manifest, store, &options, &STOP, &tell)?;
    bar.finish_and_clear();
    verbosity.note(&told(&summary, begun.elapsed().as_secs_f64()));
    Ok(match summary {
        _ if STOP.load(Ordering::SeqCst) && summary.left() > 0 => Outcome::Interrupted,
        _ if summary.failed > 0 && !args.keep_going => Outcome::RunsFailed,
        _ => Outcome::Done,
    })
}

fn told(summary: &Summary, seconds: f64) -> String {
    let mut text = format!(
        "{} of {} runs evaluated in {seconds:.1} s ({:.1} a second), {} were there, {} failed",
        summary.done,
        summary.total,
        summary.rate(seconds),
        summary.skipped,
        summary.failed
    );
    if summary.left() > 0 {
        text.push_str(&format!(", {} are left: run the same again", summary.left()));
    }
    text
}

/// A run that ended, for machines.
fn json_line(event: &Event<'_>, elapsed_s: f64) -> String {
    let (record, summary) = (event.record, event.summary);
    let state = match event.state {
        State::Skipped => "skipped",
        State::Done => "done",
        State::Failed => "failed",
    };
    let rate = summary.rate(elapsed_s);
    let line = serde_json::json!({
        "run_id": record.run_id,
        "state": state,
        "key": record.key,
        "exit_code": record.exit_code,
        "error": record.error,
        "seconds": record.seconds,
        "ended": summary.ended(),
        "total": summary.total,
        "failed": summary.failed,
        "runs_per_second": rate,
        "remaining_s": (rate > 0.0).then(|| summary.left() as f64 / rate),
    });
    format!("{line}\n")
}
