//! Everything that says what is evaluated, for each command that runs the pipeline.

use std::path::PathBuf;

use vice_run::core::evaluate::Observations;
use vice_run::core::time::Span;
use vice_run::open::Opened;
use vice_run::request::{LabelsSpec, Protocol, Request, Scoring};

use super::{DatasetArgs, DepthArgs, StreamArgs, positive, span_not_negative, split_list};

/// What a request in a file takes the place of.
pub(crate) const ASKED: [&str; 40] = [
    "path",
    "format",
    "settings",
    "camera",
    "files",
    "allow_writable_plugin",
    "isolate_plugins",
    "labels",
    "points",
    "observations",
    "label_noise",
    "fps",
    "start",
    "duration",
    "estimate",
    "reference",
    "estimate_frame",
    "estimate_as",
    "times",
    "time_offset",
    "max_gap",
    "anchor",
    "initial_pose",
    "depth",
    "floor_plane",
    "zmap_occlusion",
    "zmap_interpolation",
    "cloud_voxel",
    "zcam_range",
    "tag_size",
    "tag_family",
    "stereo_camera",
    "cloud",
    "mesh",
    "world_from_cloud",
    "calibration",
    "intrinsics",
    "distortion",
    "image_size",
    "body_from_camera",
];

/// What must be named where no file holds it.
fn unless_requested(argument: clap::Arg) -> clap::Arg {
    match argument.get_id().as_str() {
        "path" => argument.required(false).required_unless_present("request"),
        // The data set, or its vice.toml, may say them.
        "labels" | "estimate" => argument.required(false),
        _ => argument,
    }
}

/// Data set, labels, pose streams and depth; or all of it from a file.
#[derive(Debug, clap::Args)]
#[command(mut_args(unless_requested))]
pub(crate) struct EvaluationArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    labels: LabelArgs,
    #[command(flatten)]
    window: WindowArgs,
    #[command(flatten)]
    streams: StreamArgs,
    /// Depth sources: floor, zmap, zcam, mesh, tag, stereo; or triangulated, alone: from half of the labels and the stream's own
    /// motion [default: floor].
    #[arg(long, value_name = "SOURCE,...", help_heading = "Depth")]
    depth: Vec<String>,
    #[command(flatten)]
    depth_options: DepthArgs,
    /// Repeat the request in this file, a request or a result document; replaces all options above.
    #[arg(
        long,
        value_name = "FILE.json",
        help_heading = "Request",
        conflicts_with_all = ASKED
    )]
    request: Option<PathBuf>,
}

/// Labels.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Labels")]
pub(crate) struct LabelArgs {
    /// Labels: CSV, JSON, Parquet, CVAT's XML, or the authors' pickle; or auto, which chooses 40 points and follows them without a
    /// hand, auto:4 four (see `vice labels track`). They are kept in the user's cache folder.
    #[arg(long, value_name = "FILE|auto", required = true)]
    labels: Option<PathBuf>,
    /// Only these points.
    #[arg(long, value_name = "NAME,...")]
    points: Vec<String>,
    /// Whose labels count: those that are not flagged as uncertain, all, or only those that a human placed.
    #[arg(long, value_name = "certain|manual|all", default_value = "certain")]
    observations: Observations,
    /// How far off labels are, as `vice labels compare --json` tells: the noise is taken off the lower ends of intervals.
    #[arg(long, value_name = "FILE")]
    label_noise: Option<PathBuf>,
}

/// The part of the run that is looked at.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Labels")]
pub(crate) struct WindowArgs {
    /// Frames a second: keep the frame nearest to each tick, and every key frame [default: every labelled frame].
    #[arg(long, value_name = "HZ", value_parser = positive)]
    fps: Option<f64>,
    /// Start this many seconds after the camera's first frame.
    #[arg(long, value_name = "S", default_value = "0", allow_hyphen_values = true, value_parser = span_not_negative)]
    start: Span,
    /// Stop after this many seconds [default: at the end].
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = span_not_negative)]
    duration: Option<Span>,
}

impl LabelArgs {
    pub(crate) fn spec(&self) -> LabelsSpec {
        LabelsSpec {
            file: self.labels.clone().unwrap_or_default(),
            points: split_list(&self.points),
            observations: self.observations,
            noise: self.label_noise.clone(),
        }
    }
}

impl WindowArgs {
    pub(crate) const fn spec(&self) -> Protocol {
        Protocol { fps: self.fps, start: self.start, duration: self.duration }
    }
}

impl EvaluationArgs {
    /// What is asked for.
    pub(crate) fn request(&self, scoring: Scoring) -> anyhow::Result<Request> {
        if let Some(file) = &self.request {
            return Ok(Request::read(file)?);
        }
        let request = Request {
            dataset: self.depth_options.dataset(&self.dataset),
            labels: self.labels.spec(),
            protocol: self.window.spec(),
            streams: self.streams.spec()?,
            depth: self.depth_options.spec("--depth", &self.depth)?,
            scoring,
        };
        request.check()?;
        Ok(request)
    }

    /// The request with labels and estimates that the open data set says, where none are named. A request in a file asks
    /// what it asked before.
    pub(crate) fn completed(&self, request: Request, opened: &Opened) -> anyhow::Result<Request> {
        Ok(if self.request.is_some() { request } else { request.completed(opened)? })
    }
}
