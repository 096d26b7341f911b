//! `vice info`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use vice_run::core::dataset::Probe;
use vice_run::formats;
use vice_run::info::describe;

use crate::inputs::DatasetArgs;
use crate::terminal::{self, Outcome, printable};

/// Arguments of `vice info`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice info V1_01_easy")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let spec = args.dataset.spec();
    let registry = formats::registry(&spec.plugins)?;
    if spec.format.is_none()
        && let (factory, Probe::Collection(runs)) = registry.detect(&spec.path)?
    {
        return list(&factory.info().name, &spec.path, &runs);
    }
    let dataset = spec.open_raw(&registry)?;
    if spec.camera.is_some() {
        spec.camera_name(dataset.as_ref())?;
    }
    terminal::print(&describe(dataset.as_ref(), spec.camera.as_deref())?)?;
    Ok(Outcome::Done)
}

fn list(format: &str, path: &Path, runs: &[PathBuf]) -> anyhow::Result<Outcome> {
    let mut text = format!("{}: {} {format} data sets\n", path.display(), runs.len());
    for run in runs {
        writeln!(text, "  {}", printable(&run.display().to_string()))?;
    }
    terminal::print(&text)?;
    Ok(Outcome::Done)
}
