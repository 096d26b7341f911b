//! The document `vice.diagnosis/1`: each flaw with what the labels say about it, and the verdict.
//!
//! Units stand in the names. All values are errors of what is in use; the correction is the same with the sign turned.

use serde::{Deserialize, Serialize};

use super::flaw::Flaw;
use super::noise::OdometryNoise;

/// The schema's name and version.
pub const SCHEMA: &str = "vice.diagnosis/1";

/// The document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DiagnosisDocument {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of VICE that wrote it.
    pub vice_version: String,
    /// Name of the data set.
    pub dataset: String,
    /// Its format.
    pub format: String,
    /// The camera.
    pub camera: String,
    /// The pose stream that was diagnosed.
    pub stream: String,
    /// The depth source.
    pub depth: String,
    /// What it was diagnosed from.
    pub labels: LabelsPart,
    /// RMSE_2D of all points together as it is, pixels: `pooled_rmse_px` of an evaluation.
    pub rmse_px: f64,
    /// Standard deviation of one coordinate of a label under the best fit, pixels.
    pub label_noise_px: f64,
    /// Standard deviation of one coordinate by the wander of the position, one second after a key frame, pixels.
    pub wander_px_root_s: f64,
    /// RMSE_2D that the labels' own errors alone would make, pixels.
    pub labels_rmse_px: f64,
    /// How the odometry wanders.
    pub odometry: OdometryPart,
    /// Each flaw fitted alone.
    pub flaws: Vec<FlawPart>,
    /// Pairs of flaws of which one could account for more than half of what the other does.
    pub overlaps: Vec<Overlap>,
    /// The likeliest hypotheses, the first one first.
    #[serde(default)]
    pub hypotheses: Vec<HypothesisPart>,
    /// What it comes to.
    pub verdict: Verdict,
}

/// What was fitted to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelsPart {
    /// Scored labels.
    pub scored: usize,
    /// Points with a scored label.
    pub points: usize,
    /// Blocks of time that are taken as independent.
    pub blocks: usize,
    /// What the blocks are: `keyframes`.
    pub blocks_of: String,
    /// From the first to the last frame with a label, seconds.
    #[serde(default)]
    pub seconds: f64,
    /// Labels that are far from their neighbours and count for little.
    #[serde(default)]
    pub outliers: usize,
    /// Key labels that are off, whose segments count for less.
    #[serde(default)]
    pub key_outliers: usize,
}

/// How an odometry wanders, as the labels show it under the likeliest hypothesis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometryPart {
    /// How much wander is taken as healthy: `--odometry-noise`.
    pub expected: OdometryNoise,
    /// Walk of the position, one axis, metres a root second.
    pub position_m_root_s: f64,
    /// Walk of the yaw, radians a root second.
    pub yaw_rad_root_s: f64,
    /// Deviation of roll and pitch, radians.
    pub lean_rad: f64,
    /// From frame to frame, metres.
    pub jitter_m: f64,
    /// Times, in seconds since the camera's first frame, at which the pose jumped or slid.
    pub jumps_s: Vec<f64>,
}

/// A hypothesis beside the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HypothesisPart {
    /// Its flaws; none for noise alone.
    pub flaws: Vec<Flaw>,
    /// Share of all hypotheses.
    pub share: f64,
    /// How much likelier it makes the labels than no flaw does, its values integrated over, as a natural logarithm.
    pub likelier: f64,
    /// The same at its best values.
    pub likelier_at_best: f64,
    /// RMSE_2D that it leaves, pixels.
    pub rmse_px: f64,
    /// How often the usual label noise, label walk, position walk, yaw walk, lean and jitter.
    pub noise_times: [f64; 6],
    /// Jumps of the pose.
    pub jumps: usize,
}

/// A number with its interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimated {
    /// Its name, with the unit.
    pub name: String,
    /// The value.
    pub value: f64,
    /// Lower end of its 95 % interval.
    pub low: f64,
    /// Upper end of its 95 % interval.
    pub high: f64,
}

/// A flaw, and what the labels say about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlawPart {
    /// The flaw.
    pub flaw: Flaw,
    /// Its parameters.
    pub parameters: Vec<Estimated>,
    /// The length of its vector, where it is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<Estimated>,
    /// RMSE_2D with it taken out, pixels. Of a rough depth (a Z-map) the better of that with the depth as it was and that
    /// with depth asked again: what the evaluation then gives holds the noise of other triangles.
    pub rmse_px: f64,
    /// Share of the mean squared error that goes with it, percent.
    pub explained_percent: f64,
    /// How much likelier it makes the labels than no flaw does, its values integrated over, as a natural logarithm.
    pub likelier: f64,
    /// Share of all hypotheses that are only it, 0 to 1.
    pub sureness: f64,
    /// Number of directions of its parameters that the labels can show.
    pub rank: usize,
    /// Number of its parameters.
    pub of: usize,
    /// RMS effect of a flaw of typical size in the direction that shows least, pixels.
    pub weakest_px: f64,
    /// RMS effect of a flaw of typical size in the direction that shows most, pixels.
    pub strongest_px: f64,
    /// The line that is printed.
    pub text: String,
}

/// Two flaws that look alike in these labels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Overlap {
    /// Of what this one accounts for ...
    pub of: Flaw,
    /// ... this one could account for as well ...
    pub with: Flaw,
    /// ... so much, 0 to 1.
    pub share: f64,
}

/// What a diagnosis comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum VerdictKind {
    /// What is left fits the noise of the labels and an odometry that wanders as much as is healthy.
    NoFlaw,
    /// These, and no others.
    Named,
    /// A flaw, but one of several.
    CannotTell,
    /// Something is wrong that none of the causes looked for explains.
    Unexplained,
    /// Too few labels for any answer.
    TooFewLabels,
}

/// The name of a cause: a flaw, a `convention:...`, `pose-noise` or `pose-jump`.
pub type CauseName = String;

/// The verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Which kind.
    pub kind: VerdictKind,
    /// The causes that are named; or those that cannot be told apart, the likeliest first.
    pub flaws: Vec<CauseName>,
    /// How sure it is, 0 to 1: the share of all hypotheses that say the same.
    pub sureness: f64,
    /// The named flaws fitted together; empty unless [`VerdictKind::Named`].
    pub fitted: Vec<FlawPart>,
    /// RMSE_2D with the named causes taken out, pixels.
    pub rmse_px: f64,
    /// It in a sentence.
    pub sentence: String,
    /// What to do about it.
    pub corrections: Vec<String>,
    /// Labels that would say more.
    pub labels_that_help: Vec<String>,
    /// What the poses are, as `--estimate-as` takes it: `inverse,wxyz`; empty where they are as they were read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub estimate_as: Vec<String>,
}
