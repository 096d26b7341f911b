//! `vice depth compare`: two sources at labelled key points, and what their difference costs in pixels.

use std::path::PathBuf;

use vice_run::depth_compare::{compare_depths, render};
use vice_run::request::{Request, StreamsSpec};

use crate::inputs::{AnchorArgs, DatasetArgs, DepthArgs, LabelArgs, SourceArgs, WindowArgs, to_json};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome};

/// Arguments of `vice depth compare`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice depth compare V1_01_easy --labels floor.csv --depth floor,zmap")]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    labels: LabelArgs,
    #[command(flatten)]
    window: WindowArgs,
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    depth: DepthArgs,
    #[command(flatten)]
    anchor: AnchorArgs,
    /// The comparison as JSON, vice.depth-compare/1; - prints it in place of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let request = Request {
        dataset: args.depth.dataset(&args.dataset),
        labels: args.labels.spec(),
        protocol: args.window.spec(),
        streams: StreamsSpec {
            reference: args.anchor.reference(),
            max_gap: args.anchor.max_gap,
            ..StreamsSpec::default()
        },
        depth: args.source.spec(&args.depth)?,
        ..Request::default()
    };
    let outputs = Outputs::new(&[&args.json], &request.inputs())?;
    let comparison = compare_depths(&request)?;
    terminal::warn(comparison.suspicions.iter());
    let json = args.json.as_ref().map(|path| anyhow::Ok((path, to_json(&comparison)?)));
    if !outputs.write(&json.into_iter().collect::<anyhow::Result<Vec<_>>>()?)? {
        terminal::print(&render(&comparison))?;
    }
    Ok(Outcome::Done)
}
