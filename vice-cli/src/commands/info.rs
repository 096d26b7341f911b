//! `vice info`.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use vice_run::check::{CheckRequest, check_open, head};
use vice_run::core::dataset::Probe;
use vice_run::formats;
use vice_run::info::describe;
use vice_run::info_document::document;
use vice_run::place::Place;
use vice_run::progress::silent;

use crate::inputs::{CalibrationArgs, DatasetArgs};
use crate::outputs::JsonArgs;
use crate::terminal::{self, Outcome, Verbosity, printable};

/// Arguments of `vice info`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vice info V1_01_easy\n  vice info V1_01_easy --camera cam1 --calibration camchain.yaml"
)]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    calibration: CalibrationArgs,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let spec = args.calibration.dataset(&args.dataset);
    let registry = formats::registry(&spec.plugins)?;
    if spec.format.is_none()
        && let place = Place::of_data_set(&spec.path)?
        // What no format knows is told where it is opened.
        && let Ok((factory, Probe::Collection(runs))) = registry.detect(place.path())
    {
        return list(&factory.info().name, &place, &runs);
    }
    let raw = spec.open_raw(&registry)?;
    if spec.camera.is_some() {
        spec.camera_name(raw.as_ref())?;
    }
    let request = CheckRequest { dataset: spec.clone(), ..CheckRequest::default() };
    // What cannot be checked is said where it is asked for; what the data set holds is shown all the same.
    let checked = check_open(&request, raw.clone(), &silent).ok();
    let (dataset, said) = match args.calibration.says_something() {
        true => {
            let opened = spec.apply_to(raw)?;
            let said: Vec<String> = opened.suspicions().map(|s| s.line()).collect();
            (opened.dataset, said)
        }
        false => (raw, Vec::new()),
    };
    let inputs: Vec<PathBuf> = args.dataset.path.iter().cloned().collect();
    if args.json.json.as_deref() == Some(Path::new("-")) {
        let shown = document(dataset.as_ref(), spec.camera.as_deref());
        args.json.put(&inputs, &shown, verbosity, String::new)?;
        return Ok(Outcome::Done);
    }
    let mut text = describe(dataset.as_ref(), spec.camera.as_deref())?;
    if !said.is_empty() {
        writeln!(text, "calibration")?;
    }
    for line in said {
        writeln!(text, "  {}", printable(&line))?;
    }
    let head = checked.map_or_else(String::new, |document| head(&document));
    let text = match text.split_once('\n') {
        Some((first, rest)) => format!("{first}\n{head}{rest}"),
        None => text,
    };
    let shown = args.json.json.as_ref().map(|_| document(dataset.as_ref(), spec.camera.as_deref()));
    args.json.put(&inputs, &shown, verbosity, || text)?;
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
