//! `vice floor`.

use anyhow::Context;
use nalgebra::Vector3;
use vice_depth::{FloorFit, FloorFitOptions, fit_floor_to_cloud, fit_floor_to_depth_image};

use crate::inputs::{AnchorArgs, DatasetArgs, DepthArgs, Scene, positive};
use crate::terminal::{self, Outcome, Verbosity};

/// A plane with less of the points than this is worth a warning.
const SMALL_SHARE: f64 = 0.05;

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
    let scene = Scene::open(&args.dataset, &args.depth, &args.anchor)?;
    let options = FloorFitOptions {
        tolerance_m: args.tolerance,
        max_tilt_rad: args.max_tilt.to_radians(),
        ..FloorFitOptions::default()
    };
    let up = Vector3::z_axis();
    let found = match &args.at {
        None => {
            let (cloud, reference) = args
                .depth
                .cloud("of the floor", scene.dataset.as_ref())
                .context("no cloud to fit to (name a frame with --at to use its depth image)")?;
            fit_floor_to_cloud(&cloud, &reference.world_from_cloud, up, &options)?
        }
        Some(at) => {
            let frame = scene.frame_at(at)?;
            let keyframe = scene.keyframe(frame)?;
            let image = scene
                .dataset
                .depth_image(&scene.used.name, frame)?
                .with_context(|| format!("frame {frame} has no depth image"))?;
            anyhow::ensure!(
                image.z_m().iter().any(|z| z.is_finite()),
                "the depth image of frame {frame} has no valid depth"
            );
            let world_from_camera = keyframe.world_from_camera.with_context(|| {
                format!("the camera's place at {} ns is unknown (name a --reference)", keyframe.stamp)
            })?;
            fit_floor_to_depth_image(&image, &scene.used.camera, &world_from_camera, up, &options)?
        }
    };
    let share = found.inliers as f64 / found.points as f64;
    if share < SMALL_SHARE {
        tracing::warn!(
            "only {:.1} % of the points are of this plane: it may not be the floor",
            100.0 * share
        );
    }
    terminal::print(&render(&found))?;
    verbosity.note("use it with --floor-plane");
    Ok(Outcome::Done)
}

fn tilt(text: &str) -> Result<f64, String> {
    positive(text).and_then(|v| if v <= 90.0 { Ok(v) } else { Err("must be at most 90".to_string()) })
}

fn render(fit: &FloorFit) -> String {
    let (n, d) = (fit.plane.normal(), fit.plane.d_m());
    format!(
        "{:.6},{:.6},{:.6},{:.6}\n{} of {} points within the tolerance ({:.1} %), RMS {:.2} mm, tilt {:.3} degrees from level\n",
        n.x,
        n.y,
        n.z,
        d,
        fit.inliers,
        fit.points,
        100.0 * fit.inliers as f64 / fit.points as f64,
        fit.rms_m * 1000.0,
        fit.tilt_rad.to_degrees()
    )
}
