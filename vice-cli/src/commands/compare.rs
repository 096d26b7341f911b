//! `vice compare`: results side by side.

use std::path::{Path, PathBuf};

use vice_run::report::comparison::{By, Document, NamedRun, csv, latex, text};
use vice_run::result;

use crate::inputs::to_json;
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, printable, usage};

/// Arguments of `vice compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  vice compare before.json after.json\n  \
    vice compare out.json --by depths --csv depths.csv\n  \
    vice compare old/*.json new/*.json   (flight by flight, and over all flights)\n  \
    vice compare baseline.json today.json --fail-above 0.5   (for CI: exit code 1 if an estimate got worse by more)\n\n\
    Differences are paired: at each label that both results scored, B minus A. The interval comes from resampling \
    points and segments; if it contains zero, these labels show no difference.")]
pub(crate) struct Args {
    /// Result documents with their samples, as `vice evaluate --json` writes them; the first of a recording
    /// is what its others are held against.
    #[arg(value_name = "RESULT.json", required = true)]
    results: Vec<PathBuf>,
    /// What is compared [default: runs; with one result of each recording
    /// streams, or depths where there is one stream].
    #[arg(long, value_name = "runs|streams|depths")]
    by: Option<By>,
    /// Seed of the resampling.
    #[arg(long, value_name = "N", default_value = "1")]
    seed: u64,
    /// Exit with 1 if RMSE_2D of B is above that of A by more than this many pixels, anywhere.
    #[arg(long, value_name = "PX", value_parser = not_negative)]
    fail_above: Option<f64>,
    /// The comparison as JSON, vice.comparison/1; - prints it in place of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// The comparison as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// The comparison as LaTeX.
    #[arg(long, value_name = "FILE")]
    latex: Option<PathBuf>,
}

fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a number that is not negative".to_string()),
    }
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let outputs = Outputs::new(&[&args.json, &args.csv, &args.latex], &args.results)?;
    let mut runs: Vec<NamedRun> = Vec::new();
    for path in &args.results {
        runs.push((run_name(path, &runs), result::read(path)?));
    }
    result::check_unmixed(runs.iter().map(|(_, document)| document))?;
    let by = args.by.unwrap_or_else(|| By::usual(&runs));
    let document = Document::of(&runs, by, args.seed, &|problem| tracing::warn!("{problem}"));
    if document.comparisons.is_empty() {
        let hint = match by {
            By::Runs if runs.len() < 2 => "name two results, or choose --by streams or --by depths",
            _ => {
                "they share no scored label of a stream and depth source (were they written with --samples none?)"
            }
        };
        return Err(usage(format!("there is nothing to compare: {hint}")));
    }
    let mut texts = Vec::new();
    if let Some(path) = &args.json {
        texts.push((path, to_json(&document)?));
    }
    if let Some(path) = &args.csv {
        texts.push((path, csv(&document)?));
    }
    if let Some(path) = &args.latex {
        texts.push((path, latex(&document)?));
    }
    if !outputs.write(&texts)? {
        terminal::print(&text(&document))?;
    }
    fail_above(&document, args.fail_above)?;
    Ok(Outcome::Done)
}

/// The largest rise of all, where it is above the limit.
fn fail_above(document: &Document, limit_px: Option<f64>) -> anyhow::Result<()> {
    let Some(limit_px) = limit_px else { return Ok(()) };
    let rise = |c: &&vice_run::report::comparison::Comparison| c.paired.rmse_difference_px.value;
    let worst = document.comparisons.iter().max_by(|a, b| rise(a).total_cmp(&rise(b)));
    match worst.filter(|c| rise(c) > limit_px) {
        Some(c) => anyhow::bail!(
            "{} is {:.3} px above {}, more than --fail-above {limit_px} allows",
            c.b.name(),
            c.paired.rmse_difference_px.value,
            c.a.name()
        ),
        None => Ok(()),
    }
}

/// The file's name without its ending, told apart by a number where two are alike.
fn run_name(path: &Path, taken: &[NamedRun]) -> String {
    let stem = printable(&path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default());
    let count =
        taken.iter().filter(|(name, _)| *name == stem || name.starts_with(&format!("{stem}-"))).count();
    if count == 0 { stem } else { format!("{stem}-{}", count + 1) }
}
