//! `vice report`: result documents as a page.

use std::path::PathBuf;
use std::sync::Arc;

use vice_run::core::dataset::Dataset;
use vice_run::formats;
use vice_run::report::frames::Shots;
use vice_run::report::html::{IMAGE_BUDGET_BYTES, Run, render};
use vice_run::request::DatasetSpec;
use vice_run::result::{self, ResultDocument};

use crate::inputs::PluginArgs;
use crate::outputs::Outputs;
use crate::terminal::{Outcome, Verbosity, printable, told, with_progress};

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
            let shots = match open(&document, args) {
                Ok(dataset) => shots(&document, dataset.as_ref(), budget, verbosity),
                Err(error) => {
                    Shots::missing(format!("{}; --dataset DIR says where the data set is", told(&error)))
                }
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
pub(crate) fn shots(
    document: &ResultDocument,
    dataset: &dyn Dataset,
    budget_bytes: usize,
    verbosity: Verbosity,
) -> Shots {
    with_progress(verbosity, |progress| {
        Shots::of(document, dataset, budget_bytes, &|done, total| progress("reading images", done, total))
    })
}

/// Opens the data set that a document names, or the folder it moved to, with the settings it was opened with.
fn open(document: &ResultDocument, args: &Args) -> anyhow::Result<Arc<dyn Dataset>> {
    let asked = &document.request.dataset;
    let path = args.dataset.clone().unwrap_or_else(|| asked.path.clone());
    anyhow::ensure!(!path.as_os_str().is_empty(), "the result does not say where its data set is");
    let mut plugins = args.plugins.spec();
    // Those that read it then; who moved it may have moved them, too.
    plugins.files.extend(asked.plugins.files.iter().filter(|f| f.is_file()).cloned());
    let registry = formats::registry(&plugins)?;
    let known = registry.by_name(&document.dataset.format).is_ok();
    let spec = DatasetSpec { path, format: known.then(|| document.dataset.format.clone()), ..asked.clone() };
    Ok(spec.open_raw(&registry)?)
}
