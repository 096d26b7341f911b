//! `vice clock`: by how much the clocks of two motion sources differ.

use std::path::PathBuf;

use vice_run::check::{ClockRequest, compare_clocks};
use vice_run::request::{DatasetSpec, EstimateSpec};

use crate::inputs::{positive, to_json};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome};

/// Arguments of `vice clock`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vice clock ground_truth.csv estimate.txt\n  vice clock mav0/imu0/data.csv estimate.txt\n  vice clock imu ground-truth --dataset V1_01_easy\n\n\
    The offset is added to the stamps of the second, as --time-offset does. Both must rotate; their body and world frames \
    do not matter. Exit codes: 0 found, 3 too uncertain, others as for every command."
)]
pub(crate) struct Args {
    /// File of poses or inertial samples whose clock is kept; with --dataset also imu or the name of a stream.
    #[arg(value_name = "A")]
    reference: EstimateSpec,
    /// The one whose stamps are to be moved.
    #[arg(value_name = "B")]
    estimate: EstimateSpec,
    /// Data set that names are of.
    #[arg(long, value_name = "DATASET")]
    dataset: Option<PathBuf>,
    /// Offsets that are looked at, seconds to either side [default: 2, and 20 where nothing is found there].
    #[arg(long, value_name = "S", value_parser = positive)]
    range: Option<f64>,
    /// Document vice.clock/1; - prints it in place of the text.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let request = ClockRequest {
        reference: args.reference.clone(),
        estimate: args.estimate.clone(),
        dataset: args
            .dataset
            .as_ref()
            .map(|path| DatasetSpec { path: path.clone(), ..DatasetSpec::default() }),
        range_s: args.range,
    };
    let outputs = Outputs::new(&[&args.json], &request.inputs())?;
    let document = compare_clocks(&request)?;
    terminal::warn(document.suspicions.iter());
    let mut texts = Vec::new();
    if let Some(path) = &args.json {
        texts.push((path, to_json(&document)?));
    }
    if !outputs.write(&texts)? {
        terminal::print(&document.render())?;
    }
    Ok(if document.known { Outcome::Done } else { Outcome::SomethingWrong })
}
