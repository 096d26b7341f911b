//! `vice init`.

use std::path::PathBuf;

use vice_run::init::{InitRequest, init};

use crate::inputs::{PluginArgs, positive};
use crate::outputs::JsonArgs;
use crate::terminal::{Outcome, Verbosity};

/// Arguments of `vice init`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vice init my_robot               (a folder of images, poses and a calibration)\n  \
    vice init my_robot --fps 30      (the names of the images say no stamps)\n  \
    vice init run.bag                (writes run.bag.vice.toml)\n\n\
    It asks nothing: what it guessed and what it could not know stands in the file, which every command reads."
)]
pub(crate) struct Args {
    /// Folder or file of the data set.
    #[arg(value_name = "DATASET")]
    path: PathBuf,
    /// Images a second, where neither their names nor a list say when they were taken.
    #[arg(long, value_name = "HZ", value_parser = positive)]
    fps: Option<f64>,
    /// Replace a vice.toml that exists.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    plugins: PluginArgs,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let request = InitRequest {
        path: args.path.clone(),
        fps: args.fps,
        force: args.force,
        plugins: args.plugins.spec(),
    };
    let document = init(&request)?;
    if args.json.put(&[], &document, verbosity, || document.summary())? {
        verbosity.note(&format!("look at it with `vice info {0}` and `vice check {0}`", args.path.display()));
    }
    Ok(Outcome::Done)
}
