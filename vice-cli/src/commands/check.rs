//! `vice check`: what is wrong with a recording, before any label.

use std::path::PathBuf;

use vice_run::check::{CheckRequest, check, list_text, page, render};
use vice_run::core::check::State;
use vice_run::request::DatasetSpec;

use crate::inputs::{DatasetArgs, PoseArgs, to_json};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, Verbosity, with_progress};

/// Arguments of `vice check`.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("path", |a| a.required(false).required_unless_present("list")),
    after_help = "Examples:\n  vice check V1_01_easy\n  vice check my_run --estimate odom.tum,slam.tum --json found.json\n  vice check my_run --images\n  vice check today --images --before last_week\n  vice check --list\n\n\
    Exit codes: 0 nothing is wrong, 3 something is wrong, others as for every command. `unknown` does not mean that it is right: its line says why."
)]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Explain each check: what it looks at, its thresholds and where they come from.
    #[arg(long, exclusive = true)]
    list: bool,
    /// Calibration in place of the data set's: TOML, or a Kalibr camchain.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Estimates beside the data set's own streams: files, or names of streams.
    #[arg(long, value_name = "NAME|FILE,...")]
    estimate: Vec<String>,
    #[command(flatten)]
    poses: PoseArgs,
    /// Also decode a sample of images and depth images, and read the cloud.
    #[arg(long)]
    images: bool,
    /// An earlier recording of the same rig: whether the cameras lie in the body as they did then.
    #[arg(long, value_name = "DATASET", requires = "images")]
    before: Option<PathBuf>,
    /// The findings as a page.
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Document vice.check/1; - prints it in place of the text.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Args {
    fn request(&self) -> CheckRequest {
        let mut dataset = self.dataset.spec();
        dataset.calibration.clone_from(&self.calibration);
        // The same rig, so that all that is said of it holds for both.
        let before = self.before.as_ref().map(|path| DatasetSpec { path: path.clone(), ..dataset.clone() });
        CheckRequest { dataset, before, images: self.images, streams: self.poses.spec(&self.estimate) }
    }
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    if args.list {
        terminal::print(&list_text())?;
        return Ok(Outcome::Done);
    }
    let request = args.request();
    let outputs = Outputs::new(&[&args.json, &args.report], &request.inputs())?;
    let document = with_progress(verbosity, |progress| check(&request, progress))?;
    let mut texts = Vec::new();
    if let Some(path) = &args.json {
        texts.push((path, to_json(&document)?));
    }
    if let Some(path) = &args.report {
        texts.push((path, page(&document)));
    }
    if !outputs.write(&texts)? {
        terminal::print(&render(&document))?;
    }
    Ok(if document.worst == State::Wrong { Outcome::SomethingWrong } else { Outcome::Done })
}
