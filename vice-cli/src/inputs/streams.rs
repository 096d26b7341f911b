//! Which pose streams are evaluated.

use std::path::PathBuf;

use vice_run::core::conventions::Convention;
use vice_run::core::time::Span;
use vice_run::request::{Anchor, EstimateFrame, EstimateSpec, ReferenceSpec, StreamsSpec};

use super::{numbers, span, span_not_negative, split_list};
use crate::terminal::usage;

/// What estimates are compared with, and how their poses are read.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct PoseArgs {
    /// Reference that the estimates are compared with, or none [default: ground-truth if there is one].
    #[arg(long, value_name = "NAME|FILE|none")]
    reference: Option<String>,
    /// Frame that the estimates' poses are of: body, camera, or a file with body_from_estimate (4x4).
    #[arg(long, value_name = "body|camera|FILE", default_value = "body")]
    estimate_frame: EstimateFrame,
    /// What the estimates are, where that is not what they are read as: inverse, wxyz, conjugate, camera, mm, cm, ft,
    /// ned, ... (a wrong word lists all).
    #[arg(long, value_name = "WORD,...", value_delimiter = ',')]
    estimate_as: Vec<Convention>,
    /// Times of KITTI files [default: times.txt beside each].
    #[arg(long, value_name = "FILE")]
    times: Option<PathBuf>,
    /// Seconds added to the stamps of the estimates [default: 0, or what --calibration says].
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = span)]
    time_offset: Option<Span>,
    /// Longest gap between two poses to interpolate over, seconds.
    #[arg(long, value_name = "S", default_value = "0.1", value_parser = span_not_negative)]
    max_gap: Span,
}

impl PoseArgs {
    /// Of these estimates.
    pub(crate) fn spec(&self, estimates: &[String]) -> StreamsSpec {
        StreamsSpec {
            estimates: split_list(estimates).into_iter().map(EstimateSpec::from).collect(),
            reference: ReferenceSpec::from(self.reference.clone()),
            estimate_frame: self.estimate_frame.clone(),
            estimate_as: self.estimate_as.clone(),
            times: self.times.clone(),
            time_offset: self.time_offset,
            max_gap: self.max_gap,
            ..StreamsSpec::default()
        }
    }
}

/// Which pose streams are evaluated, and how their poses are read.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Pose streams")]
pub(crate) struct StreamArgs {
    /// Estimates to evaluate: names of streams, imu-euler, or files [default: all streams of the data set].
    #[arg(long, value_name = "NAME|FILE,...", required = true)]
    estimate: Vec<String>,
    #[command(flatten)]
    poses: PoseArgs,
    /// What places the camera in the world for floor and Z-map depth: reference, estimate (the first), or the name of a
    /// stream [default: the reference where there is one, else each estimate for itself].
    #[arg(long, value_name = "reference|estimate|NAME")]
    anchor: Option<Anchor>,
    /// Pose world_from_body of the anchoring estimates at the first key frame, where its own world has no floor.
    #[arg(long, value_name = "X,Y,Z,QX,QY,QZ,QW", allow_hyphen_values = true, value_parser = numbers::<7>)]
    initial_pose: Option<[f64; 7]>,
}

impl StreamArgs {
    pub(crate) fn spec(&self) -> anyhow::Result<StreamsSpec> {
        let spec = StreamsSpec {
            anchor: self.anchor.clone(),
            initial_pose: self.initial_pose,
            ..self.poses.spec(&self.estimate)
        };
        // A command that does not ask for estimates may do with the reference.
        if !self.estimate.is_empty() && spec.estimates.is_empty() {
            return Err(usage("--estimate: no estimate is named"));
        }
        Ok(spec)
    }
}
