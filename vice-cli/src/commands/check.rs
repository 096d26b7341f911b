//! `vice check`: what is wrong with a recording, before any label.

use std::path::PathBuf;

use vice_run::check::{CheckRequest, check, list_text, page, render};
use vice_run::core::check::State;
use vice_run::core::conventions::Convention;
use vice_run::core::time::Span;
use vice_run::request::{EstimateFrame, EstimateSpec, ReferenceSpec, StreamsSpec};

use crate::inputs::{DatasetArgs, span, span_not_negative, split_list, to_json};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome};

/// Arguments of `vice check`.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("path", |a| a.required(false).required_unless_present("list")),
    after_help = "Examples:\n  vice check V1_01_easy\n  vice check my_run --estimate odom.tum,slam.tum --json found.json\n  vice check --list\n\n\
    Exit codes: 0 nothing is wrong, 3 something is wrong, else as ever. `unknown` is no praise: its line says why."
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
    /// What they are compared with, or none [default: ground-truth where there is one].
    #[arg(long, value_name = "NAME|FILE|none")]
    reference: Option<String>,
    /// Whose poses the estimates give: body, camera, or a file with body_from_estimate (4x4).
    #[arg(long, value_name = "body|camera|FILE", default_value = "body")]
    estimate_frame: EstimateFrame,
    /// What the estimates are, where that is not what they are read as: inverse, wxyz, conjugate, camera, mm, ...
    #[arg(long, value_name = "WORD,...", value_delimiter = ',')]
    estimate_as: Vec<Convention>,
    /// Times of KITTI files [default: times.txt beside each].
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    /// Seconds added to the stamps of the estimates [default: 0, or what --calibration says].
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = span)]
    time_offset: Option<Span>,
    /// Widest gap between two poses that is interpolated, seconds.
    #[arg(long, value_name = "S", default_value = "0.1", value_parser = span_not_negative)]
    max_gap: Span,
    /// Also decode a sample of images and depth images, and read the cloud.
    #[arg(long)]
    images: bool,
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
        CheckRequest {
            dataset,
            images: self.images,
            streams: StreamsSpec {
                estimates: split_list(&self.estimate).into_iter().map(EstimateSpec::from).collect(),
                reference: ReferenceSpec::from(self.reference.clone()),
                estimate_frame: self.estimate_frame.clone(),
                estimate_as: self.estimate_as.clone(),
                times: self.times.clone(),
                time_offset: self.time_offset,
                max_gap: self.max_gap,
                ..StreamsSpec::default()
            },
        }
    }
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    if args.list {
        terminal::print(&list_text())?;
        return Ok(Outcome::Done);
    }
    let request = args.request();
    let outputs = Outputs::new(&[&args.json, &args.report], &request.inputs())?;
    let document = check(&request)?;
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
