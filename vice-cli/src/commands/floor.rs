//! `vice floor`.

use std::path::PathBuf;

use vice_run::depth::FloorFitOptions;
use vice_run::files::vice_toml::Up;
use vice_run::floor::{FloorDocument, fit_floor, render};
use vice_run::request::DepthName;
use vice_run::request::DepthSpec;
use vice_run::scene::Scene;

use crate::inputs::{AnchorArgs, DatasetArgs, DepthArgs, positive};
use crate::outputs::JsonArgs;
use crate::terminal::{Outcome, Verbosity};

/// What to do with the floor.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    /// Fit the floor plane to the data set's point cloud, or to a depth image.
    Fit(Box<FitArgs>),
}

/// Arguments of `vice floor fit`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vice floor fit V1_01_easy\n  vice floor fit my_run --at 0   (from the depth image of the first frame)\n\n\
    The plane is printed as --floor-plane takes it."
)]
pub(crate) struct FitArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Fit to the depth image of this frame instead of the cloud: its index, or its stamp in nanoseconds.
    #[arg(long, value_name = "STAMP|INDEX")]
    at: Option<String>,
    /// Points this near to the plane are of the floor, metres.
    #[arg(long, value_name = "M", default_value = "0.02", value_parser = positive)]
    tolerance: f64,
    /// How far from level the floor may be, degrees.
    #[arg(long, value_name = "DEGREES", default_value = "15", value_parser = tilt)]
    max_tilt: f64,
    /// Axis of the poses' world that points up: x, y, z, -x, -y, -z [default: z].
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, value_parser = axis)]
    up: Option<Up>,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    depth: DepthArgs,
    #[command(flatten)]
    anchor: AnchorArgs,
}

pub(crate) fn run(command: &Command, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    match command {
        Command::Fit(args) => fit(args, verbosity),
    }
}

fn fit(args: &FitArgs, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let depth: DepthSpec = args.depth.spec("--depth", &[])?;
    // Without a frame the cloud is what is read.
    depth.check(if args.at.is_none() { &[DepthName::ZMap] } else { &[] })?;
    let reference = args.anchor.reference();
    let inputs: Vec<PathBuf> = args.dataset.path.iter().cloned().collect();
    let scene = Scene::open(&args.depth.dataset(&args.dataset), &reference, args.anchor.max_gap)?;
    let options = FloorFitOptions {
        tolerance_m: args.tolerance,
        max_tilt_rad: args.max_tilt.to_radians(),
        ..FloorFitOptions::default()
    };
    let found = fit_floor(&scene, &depth, args.at.as_deref(), args.up, &options)?;
    if args.json.put(&inputs, &FloorDocument::from(&found), verbosity, || render(&found))? {
        verbosity.note("use it with --floor-plane");
    }
    Ok(Outcome::Done)
}

fn axis(text: &str) -> Result<Up, String> {
    Up::parse(text).ok_or_else(|| "is none of x, y, z, -x, -y, -z".to_string())
}

fn tilt(text: &str) -> Result<f64, String> {
    positive(text).and_then(|v| if v <= 90.0 { Ok(v) } else { Err("must be at most 90".to_string()) })
}
