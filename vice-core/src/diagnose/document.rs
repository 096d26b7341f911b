//! The document `vice.diagnosis/1`: each flaw with what the labels say about it, and the verdict.
//!
//! Units stand in the names. All values are errors of what is in use; the correction is the same with the sign turned.

use serde::{Deserialize, Serialize};

use super::flaw::Flaw;

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
    /// Standard deviation of one coordinate by the wander of the poses, one second after a key frame, pixels.
    pub wander_px_root_s: f64,
    /// Each flaw fitted alone.
    pub flaws: Vec<FlawPart>,
    /// Pairs of flaws of which one could account for more than half of what the other does.
    pub overlaps: Vec<Overlap>,
    /// What it comes to.
    pub verdict: Verdict,
}

/// What was fitted to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LabelsPart {
    /// Scored labels.
    pub scored: usize,
    /// Points with a scored label.
    pub points: usize,
    /// Blocks of time that are taken as independent.
    pub blocks: usize,
    /// What the blocks are groups of: `keyframes` or `frames`.
    pub blocks_of: String,
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
    /// How much likelier it makes labels that the fit has not seen, as a natural logarithm; negative where it does harm.
    pub likelier: f64,
    /// How sure it is that the fit explains unseen labels better than no flaw does, 0 to 1.
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
pub enum VerdictKind {
    /// Nothing stands out above the noise of labels and poses.
    NoFlaw,
    /// These flaws, and no others.
    Named,
    /// A flaw, but one of several.
    CannotTell,
}

/// The verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Which kind.
    pub kind: VerdictKind,
    /// The flaws that are named, the first one first found; or those that cannot be told apart, the likeliest first.
    pub flaws: Vec<Flaw>,
    /// How sure the name is, 0 to 1: the least of its comparisons with no flaw and with every other flaw.
    pub sureness: f64,
    /// The named flaws fitted together; empty unless [`VerdictKind::Named`].
    pub fitted: Vec<FlawPart>,
    /// RMSE_2D with the named flaws taken out, pixels.
    pub rmse_px: f64,
    /// It in a sentence.
    pub sentence: String,
    /// What to do about it.
    pub corrections: Vec<String>,
    /// Labels that would say more.
    pub labels_that_help: Vec<String>,
}
