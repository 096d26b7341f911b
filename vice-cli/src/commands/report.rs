//! `vice report`: result documents as a page.

use std::path::PathBuf;
use std::sync::Arc;

use vice_core::dataset::Dataset;
use vice_core::result::ResultDocument;

use crate::formats::{self, PluginArgs};
use crate::inputs::{DatasetArgs, Outputs};
use crate::report::frames::Shots;
use crate::report::html::{IMAGE_BUDGET_BYTES, Run, render};
use crate::report::result_file;
use crate::terminal::{Outcome, Verbosity, advance, printable};

/// Arguments of `vice report`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  vice report out.json --out report.html\n  \
    vice report monday.json tuesday.json --out week.html --dataset /archive/V1_01_easy\n\n\
    The page is one file, asks no other for anything, and holds its images. They are read from the data set that the\n\
    result names; where it has moved, --dataset says where to.")]
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
    plugins: PluginArgs,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let mut inputs = args.results.clone();
    inputs.extend(args.dataset.clone());
    let out = Some(args.out.clone());
    let outputs = Outputs::new(&[&out], &inputs)?;
    let documents: Vec<ResultDocument> =
        args.results.iter().map(|path| result_file::read(path)).collect::<Result<_, _>>()?;
    // The data sets are inputs too, which only the documents name.
    let named = documents.iter().filter_map(|d| d.settings.dataset.as_ref()).map(PathBuf::from);
    Outputs::new(&[&out], &named.collect::<Vec<_>>())?;
    let budget = IMAGE_BUDGET_BYTES / documents.len().max(1);
    let several = documents.len() > 1;
    let runs: Vec<Run> = documents
        .into_iter()
        .zip(&args.results)
        .map(|(document, path)| {
            let shots = match open(&document, args.dataset.as_ref(), &args.plugins) {
                Ok(dataset) => with_progress(&document, dataset.as_ref(), budget, verbosity),
                Err(error) => Shots::missing(format!("{error:#}; --dataset DIR says where the data set is")),
            };
            if let Some(problem) = &shots.problem {
                tracing::warn!("{}: {problem}", path.display());
            }
            let mut run = Run::new(document, shots);
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

/// The pictures of a run, with a bar while they are decoded.
pub(crate) fn with_progress(
    document: &ResultDocument,
    dataset: &dyn Dataset,
    budget_bytes: usize,
    verbosity: Verbosity,
) -> Shots {
    let bar = verbosity.progress("reading images");
    let shots = Shots::of(document, dataset, budget_bytes, &|done, total| {
        advance(&bar, done, total);
    });
    bar.finish_and_clear();
    shots
}

/// Opens the data set that a document names, or the folder it moved to, with the settings it was opened with.
fn open(
    document: &ResultDocument,
    moved: Option<&PathBuf>,
    plugins: &PluginArgs,
) -> anyhow::Result<Arc<dyn Dataset>> {
    let settings = &document.settings;
    let path = moved.cloned().or_else(|| settings.dataset.as_ref().map(PathBuf::from));
    let path = path.ok_or_else(|| anyhow::anyhow!("the result does not say where its data set is"))?;
    let registry = formats::registry(plugins)?;
    let known = registry.by_name(&document.dataset.format).is_ok();
    let set = |(key, value): (&String, &String)| Some((key.strip_prefix("set ")?.to_string(), value.clone()));
    let args = DatasetArgs {
        path,
        format: known.then(|| document.dataset.format.clone()),
        settings: settings.other.iter().filter_map(set).collect(),
        camera: None,
        plugins: plugins.clone(),
    };
    args.open_in(&registry)
}
