//! `vice info`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use vice_run::check::{CheckRequest, check_open, head};
use vice_run::core::dataset::Probe;
use vice_run::formats;
use vice_run::info::describe;
use vice_run::info_document::document;
use vice_run::place::Place;

use crate::inputs::DatasetArgs;
use crate::outputs::JsonArgs;
use crate::terminal::{self, Outcome, Verbosity, printable};

/// Arguments of `vice info`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice info V1_01_easy")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    json: JsonArgs,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let spec = args.dataset.spec();
    let registry = formats::registry(&spec.plugins)?;
    if spec.format.is_none()
        && let place = Place::of_data_set(&spec.path)?
        // What no format knows is told where it is opened.
        && let Ok((factory, Probe::Collection(runs))) = registry.detect(place.path())
    {
        return list(&factory.info().name, &place, &runs);
    }
    let dataset = spec.open_raw(&registry)?;
    if spec.camera.is_some() {
        spec.camera_name(dataset.as_ref())?;
    }
    let inputs: Vec<PathBuf> = args.dataset.path.iter().cloned().collect();
    if args.json.json.as_deref() == Some(Path::new("-")) {
        let document = document(dataset.as_ref(), spec.camera.as_deref());
        args.json.put(&inputs, &document, verbosity, String::new)?;
        return Ok(Outcome::Done);
    }
    let request = CheckRequest { dataset: spec.clone(), ..CheckRequest::default() };
    // What cannot be checked is said where it is asked for; what the data set holds is shown all the same.
    let checked = check_open(&request, dataset.clone()).ok();
    let text = describe(dataset.as_ref(), spec.camera.as_deref())?;
    let head = checked.map_or_else(String::new, |document| head(&document));
    let text = match text.split_once('\n') {
        Some((first, rest)) => format!("{first}\n{head}{rest}"),
        None => text,
    };
    let document = args.json.json.as_ref().map(|_| document(dataset.as_ref(), spec.camera.as_deref()));
    args.json.put(&inputs, &document, verbosity, || text)?;
    Ok(Outcome::Done)
}

fn list(format: &str, place: &Place<'_>, runs: &[PathBuf]) -> anyhow::Result<Outcome> {
    let told = |path: &Path| place.in_words(&path.display().to_string());
    let mut text = format!("{}: {} {format} data sets\n", told(place.path()), runs.len());
    for run in runs {
        writeln!(text, "  {}", printable(&told(run)))?;
    }
    terminal::print(&text)?;
    Ok(Outcome::Done)
}
