//! What an evaluation found, and all that is needed to plot it. Result documents hold it beside what was asked for.
//!
//! Units stand in the names. A number that could not be had is null, never NaN.

mod depth_doubt;
mod held;
mod triangulation;

pub use depth_doubt::{DepthDoubt, DepthDoubtReason};
pub use held::{AsideReason, Figure, HeldPart, SetAside, WindowPart};
pub(crate) use triangulation::{CANNOT_SHOW, RULE};
pub use triangulation::{TriangulatedPart, TriangulationPart};

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::camera::Pixel;
use crate::metrics::pixel::SubsetRmse;
use crate::skip::SkipReason;
use crate::suspicion::Suspicions;
use crate::time::Stamp;

/// What an evaluation found.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Evaluated {
    /// What was evaluated.
    pub dataset: DatasetPart,
    /// Pixel errors, one entry for each pose stream and depth source.
    pub pixel: Vec<PixelPart>,
    /// Estimates against the reference, where there is one.
    pub trajectory: Vec<TrajectoryPart>,
    /// Where each stream went, for plots; empty where the samples were not asked for.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub paths: Vec<PathPart>,
    /// What looks wrong in the data but did not stop the evaluation.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Suspicions::is_empty"))]
    pub suspicions: Suspicions,
}

/// What was evaluated.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DatasetPart {
    /// Name of the data set.
    pub name: String,
    /// Its format.
    pub format: String,
    /// The camera.
    pub camera: String,
    /// Columns and rows of its images.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub image_size_px: Option<[u32; 2]>,
    /// Its first frame, which plots count seconds from.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub first_frame_ns: Option<Stamp>,
}

/// Whether a stream is what is evaluated or what it is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Role {
    /// Ground truth or whatever takes its place.
    Reference,
    /// An on-board estimate.
    Estimate,
}

/// Pixel errors of one pose stream with one depth source.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PixelPart {
    /// Name of the pose stream.
    pub stream: String,
    /// Its role.
    pub role: Role,
    /// Name of the depth source.
    pub depth: String,
    /// RMSE_2D by number of points, pixels; null where fewer points were scored.
    pub rmse_px: BTreeMap<usize, Option<SubsetRmse>>,
    /// RMSE_2D of all points together, pixels; null where nothing was scored.
    pub pooled_rmse_px: Option<f64>,
    /// RMSE_2D of the labels that hold, pixels; null where none does.
    #[cfg_attr(feature = "serde", serde(default))]
    pub held_rmse_px: Option<f64>,
    /// Its 95 % interval, low and high, pixels; null where there is none.
    #[cfg_attr(feature = "serde", serde(default))]
    pub interval_95: Option<[f64; 2]>,
    /// What these two rest on; left out where nothing was scored.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub held: Option<HeldPart>,
    /// The error by age since the key frame.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub by_age: Vec<WindowPart>,
    /// The error by metres that the camera moved since the key frame.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub by_distance: Vec<WindowPart>,
    /// Number of scored samples.
    pub scored: u64,
    /// What could not be scored, and why.
    pub skipped: Vec<Skip>,
    /// Key frames that were used, with their depth.
    pub keyframes: Vec<KeyframePart>,
    /// Key frames whose depth is doubtful, and why.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub depth_doubts: Vec<DepthDoubt>,
    /// How the depths came about and what they cannot show, where labels gave them.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub triangulation: Option<TriangulationPart>,
    /// The scored samples; empty where they were not asked for.
    pub samples: Vec<Sample>,
}

/// A label that could not be scored.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Skip {
    /// Name of the point.
    pub point: PointName,
    /// The frame.
    pub timestamp_ns: Stamp,
    /// Why.
    pub reason: SkipReason,
}

/// A key frame and the depth that lifted its pixel.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct KeyframePart {
    /// Name of the point.
    pub point: PointName,
    /// The frame.
    pub timestamp_ns: Stamp,
    /// Where the label says the point is.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub label_px: Option<Pixel>,
    /// Metres along the optical axis.
    pub depth_z_m: f64,
    /// The lifted point in the stream's own world, metres.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub point_world_m: Option<[f64; 3]>,
    /// The pixel's neighbourhood straddles a depth edge.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "std::ops::Not::not"))]
    pub on_edge: bool,
    /// What the depth rests on, where later labels gave it.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub triangulated: Option<TriangulatedPart>,
}

/// One scored label.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sample {
    /// Name of the point.
    pub point: PointName,
    /// The frame.
    pub timestamp_ns: Stamp,
    /// Where the label says the point is.
    pub label_px: Pixel,
    /// Where the pose stream carried it.
    pub tracked_px: Pixel,
    /// Distance of the two.
    pub error_px: f64,
}

/// A point's name, shared by its samples.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PointName(pub Arc<str>);

#[cfg(feature = "serde")]
impl serde::Serialize for PointName {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0)
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for PointName {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        <String as serde::Deserialize>::deserialize(deserializer).map(|text| Self(text.into()))
    }
}

/// An estimate against the reference, both at the evaluated frames.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TrajectoryPart {
    /// Name of the estimate.
    pub estimate: String,
    /// Name of the reference.
    pub reference: String,
    /// Alignment that was applied.
    pub align: String,
    /// Number of frames at which both have a pose.
    pub matched: usize,
    /// RMS of the position error, metres.
    pub rmse_3d_m: Option<f64>,
    /// RMS of the rotation error, radians.
    pub aoe_rad: Option<f64>,
    /// Mean rotation error between consecutive frames, radians.
    pub roe_rad: Option<f64>,
    /// Why the numbers are null, where they are.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub problem: Option<String>,
    /// The errors over time, for plots; empty where the samples were not asked for.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub frames: Vec<FrameError>,
    /// The error of the motion since each key frame, for plots; empty where the samples were not asked for.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub since_keyframe: Vec<MotionError>,
}

/// By how much the estimate's motion from a key frame to a labelled frame is off. No alignment enters.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct MotionError {
    /// The key frame.
    pub keyframe_ns: Stamp,
    /// The labelled frame.
    pub timestamp_ns: Stamp,
    /// Distance between where the two motions lead to, metres.
    pub position_m: f64,
    /// Angle between the two motions' rotations, radians.
    pub angle_rad: f64,
}

/// The error of an estimate at a time, after alignment.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FrameError {
    /// When.
    pub timestamp_ns: Stamp,
    /// Distance of the positions, metres.
    pub position_m: f64,
    /// Angle between the orientations, radians.
    pub angle_rad: f64,
    /// Whether this is one of the frames that the numbers are made of; the others lie between them and fill the plot.
    pub evaluated: bool,
}

/// Where a stream went between the first and the last evaluated frame: at these frames, and at times between them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PathPart {
    /// Name of the pose stream.
    pub stream: String,
    /// Its role.
    pub role: Role,
    /// Whether the poses are in the world of the reference, after the alignment; else they are in the stream's own.
    pub in_reference_world: bool,
    /// The poses, in time.
    pub poses: Vec<PathPose>,
}

/// A pose of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PathPose {
    /// When.
    pub timestamp_ns: Stamp,
    /// Position in the world, metres.
    pub position_m: [f64; 3],
    /// Orientation in the world, a unit quaternion w x y z.
    pub rotation_wxyz: [f64; 4],
}

/// Largest [`PixelPart::skipped_percent`] of some parts.
pub fn worst_skipped_percent(parts: &[PixelPart]) -> f64 {
    parts.iter().map(PixelPart::skipped_percent).fold(0.0, f64::max)
}

impl TrajectoryPart {
    /// Leaves out what only plots need.
    pub fn drop_plots(&mut self) {
        self.frames.clear();
        self.since_keyframe.clear();
    }
}

impl PixelPart {
    /// Share of labels that could not be scored, in percent. Where nothing was scored it is 100, whatever the reason.
    ///
    /// Not counted is what somebody left out on purpose, and what an estimate carried out of view: that is a finding
    /// about the estimate, not a gap in the data ([`PixelPart::carried_away_percent`]).
    pub fn skipped_percent(&self) -> f64 {
        if self.scored == 0 {
            return 100.0;
        }
        let skipped = self.skipped_for(|reason| {
            !(reason.is_wanted() || self.role == Role::Estimate && reason.is_carried_away())
        });
        100.0 * skipped / (skipped + self.scored as f64)
    }

    /// Share of labels, in percent of these and the scored ones, whose point the stream carried behind the camera or out
    /// of its model's reach: no pixel can be compared there, and the RMSE is over the rest.
    pub fn carried_away_percent(&self) -> f64 {
        let away = self.skipped_for(SkipReason::is_carried_away);
        if away == 0.0 { 0.0 } else { 100.0 * away / (away + self.scored as f64) }
    }

    fn skipped_for(&self, counts: impl Fn(SkipReason) -> bool) -> f64 {
        self.skipped.iter().filter(|s| counts(s.reason)).count() as f64
    }

    /// Number of skipped labels by reason, sorted by reason.
    pub fn skips_by_reason(&self) -> BTreeMap<&'static str, usize> {
        let mut counts = BTreeMap::new();
        for skip in &self.skipped {
            *counts.entry(skip.reason.name()).or_insert(0) += 1;
        }
        counts
    }
}
