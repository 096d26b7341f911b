//! `vice calibration`: calibrations by themselves.

use std::path::PathBuf;

use vice_run::check::{CalibrationDiffRequest, compare_calibrations};

use crate::inputs::to_json;
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome};

/// What to do with calibrations.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Show by how many pixels two calibrations of one camera differ, after the best common rotation.
    Diff(DiffArgs),
}

/// Arguments of `vice calibration diff`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vice calibration diff V1_01_easy recalibrated.toml --camera cam0 --plot diff.svg\n  vice calibration diff factory.yaml kalibr-camchain.yaml --camera cam0\n\n\
    The rotation is what extrinsics take up; what remains is what no extrinsics mend."
)]
pub(crate) struct DiffArgs {
    /// Calibration file (TOML, YAML, XML), or data set with a calibration.
    #[arg(value_name = "A")]
    first: PathBuf,
    /// Another one.
    #[arg(value_name = "B")]
    second: PathBuf,
    /// Camera [default: the first of a data set, the only one of a file].
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Document vice.calibration-diff/1; - prints it in place of the text.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// The differences drawn on the image.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
}

pub(crate) fn run(command: &Command) -> anyhow::Result<Outcome> {
    match command {
        Command::Diff(args) => diff(args),
    }
}

fn diff(args: &DiffArgs) -> anyhow::Result<Outcome> {
    let request = CalibrationDiffRequest {
        first: args.first.clone(),
        second: args.second.clone(),
        camera: args.camera.clone(),
    };
    let outputs = Outputs::new(&[&args.json, &args.plot], &[args.first.clone(), args.second.clone()])?;
    let compared = compare_calibrations(&request)?;
    terminal::warn(compared.document.suspicions.iter());
    let mut texts = Vec::new();
    if let Some(path) = &args.json {
        texts.push((path, to_json(&compared.document)?));
    }
    if let Some(path) = &args.plot {
        texts.push((path, compared.picture()));
    }
    if !outputs.write(&texts)? {
        terminal::print(&compared.render())?;
    }
    Ok(Outcome::Done)
}
