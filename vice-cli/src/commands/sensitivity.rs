//! `vice sensitivity`: how RMSE_2D answers to each flaw, and which size of it the labels at hand can show.

use std::path::PathBuf;

use vice_run::diagnosis::sensitivity_of;
use vice_run::report::{sensitivity_plot, sensitivity_text};
use vice_run::request::Scoring;

use super::diagnose::LookingArgs;
use crate::inputs::{EvaluationArgs, to_json};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, Verbosity, with_progress};

/// Arguments of `vice sensitivity`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice sensitivity V1_01_easy --labels floor.csv --estimate ground-truth --plot sensitivity.svg\n\n\
    Each flaw is added to what you use now, with both signs, at growing size. `seen from` is the size at which \
    RMSE_2D is a tenth larger than it is now; `found from` the smallest size that `vice diagnose` finds nineteen times \
    of twenty. Where the labels cannot show a flaw it says `never`.")]
pub(crate) struct Args {
    #[command(flatten)]
    evaluation: EvaluationArgs,
    #[command(flatten)]
    looking: LookingArgs,
    /// Sensitivity document, vice.sensitivity/1; - prints it in place of the table.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    json: Option<PathBuf>,
    /// The curves as CSV.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    csv: Option<PathBuf>,
    /// The curves as a picture.
    #[arg(long = "plot", alias = "svg", value_name = "FILE.svg", help_heading = "Output")]
    svg: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let request = args.evaluation.request(Scoring::default())?;
    let outputs = Outputs::new(&[&args.json, &args.csv, &args.svg], &request.inputs())?;
    let opened = request.open()?;
    let request = args.evaluation.completed(request, &opened)?;
    let looking = args.looking.spec();
    let (document, suspicions) =
        with_progress(verbosity, |progress| sensitivity_of(&request, &opened, &looking, progress))?;
    terminal::warn(suspicions.iter());
    let mut texts = Vec::new();
    if let Some(path) = &args.json {
        texts.push((path, to_json(&document)?));
    }
    if let Some(path) = &args.csv {
        texts.push((path, sensitivity_text::csv(&document)?));
    }
    if let Some(path) = &args.svg {
        texts.push((path, sensitivity_plot::draw(&document)));
    }
    if !outputs.write(&texts)? {
        terminal::print(&sensitivity_text::render(&document))?;
    }
    Ok(Outcome::Done)
}
