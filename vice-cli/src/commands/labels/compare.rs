//! `vice labels compare`: how far two sets of labels lie apart.

use std::path::PathBuf;

use vice_run::files::labels;
use vice_run::label_compare::compare;
use vice_run::place::Place;

use crate::inputs::{Counted, PluginArgs, counted_spec, to_json};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome};

/// Arguments of `vice labels compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  vice labels compare mine.json yours.json\n  \
    vice labels compare mine.json auto.json --json noise.json --plot noise.svg\n  \
    vice evaluate my_run --labels mine.json --estimate odom --label-noise noise.json\n\n\
    Points are the same by their names; where no name is in both, by where they are (within 5 px, the median over three \
    frames or more). What is left between two is the floor under RMSE_2D.")]
pub(crate) struct Args {
    /// Labels: CSV, JSON (vice.labels/1), CVAT for video 1.1 or the authors' pickle.
    #[arg(value_name = "A")]
    a: PathBuf,
    /// Other labels of the same points.
    #[arg(value_name = "B")]
    b: PathBuf,
    /// Data set whose frames a pickle or CVAT counts.
    #[arg(long, value_name = "DATASET")]
    dataset: Option<PathBuf>,
    /// Camera of that data set [default: the first].
    #[arg(long, value_name = "NAME", requires = "dataset")]
    camera: Option<String>,
    #[command(flatten)]
    plugins: PluginArgs,
    /// The comparison, vice.label-compare/1; - prints it in place of the table.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    json: Option<PathBuf>,
    /// Distance over time, as SVG.
    #[arg(long, value_name = "FILE.svg", help_heading = "Output")]
    plot: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let outputs = Outputs::new(&[&args.json, &args.plot], &[args.a.clone(), args.b.clone()])?;
    let spec = args.dataset.as_ref().map(|path| counted_spec(path, args.camera.as_deref(), &args.plugins));
    let frames = spec.as_ref().map(Counted::of).transpose()?;
    let read = |file: &PathBuf| -> anyhow::Result<_> {
        let place = Place::of_file(file)?;
        Ok(place.told(labels::read(place.path(), frames.as_ref().map(|f| f.stamps.as_ref())))?)
    };
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let found = compare((&args.a, &a), (&args.b, &b))?;
    let mut texts = Vec::new();
    if let Some(path) = &args.json {
        texts.push((path, to_json(&found)?));
    }
    if let Some(path) = &args.plot {
        texts.push((path, found.svg()));
    }
    if !outputs.write(&texts)? {
        terminal::print(&found.text())?;
    }
    Ok(Outcome::Done)
}
