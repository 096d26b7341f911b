//! The results of a batch: one row a run, pose stream and depth source.

use serde::{Deserialize, Serialize};
use vice_core::result::{PixelPart, Role};

use crate::result::{MAX_SKIPPED_PERCENT, ResultDocument};

/// Name and version of the columns.
pub const SCHEMA: &str = "vice.results/2";

/// A row. No time and no place is in it, so that it is the same wherever the run was made. Names say units; what could
/// not be had is empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ResultRow {
    /// [`SCHEMA`].
    pub schema: String,
    /// Name of the run.
    pub run_id: String,
    /// Its group.
    pub group: String,
    /// The flight that it stands under in a table; runs of one flight are repeated runs.
    pub flight: String,
    /// The data set, as the manifest has it.
    pub dataset: String,
    /// What the result is filed under.
    pub key: String,
    /// `done`, `failed`, or `missing` where it was not tried yet.
    pub status: String,
    /// As `vice evaluate` ends: 0 done, 1 failed, 2 wrong usage, 3 more than 10 % of the labels not scored; 101 where the
    /// program itself failed. Empty where it was not tried yet.
    pub exit_code: Option<u8>,
    /// Why it failed.
    pub error: String,
    /// Version of VICE that evaluated it.
    pub vice_version: String,
    /// Format of the data set.
    pub format: String,
    /// The camera.
    pub camera: String,
    /// The pose stream.
    pub stream: String,
    /// The estimator whose estimate it is, which repeated runs share: the stream, unless the manifest says another.
    pub estimator: String,
    /// `reference` or `estimate`.
    pub role: String,
    /// The depth source.
    pub depth: String,
    /// RMS position error of an estimate against the reference, metres.
    pub rmse_3d_m: Option<f64>,
    /// RMS rotation error, radians.
    pub aoe_rad: Option<f64>,
    /// Mean rotation error from frame to frame, radians.
    pub roe_rad: Option<f64>,
    /// How many poses these three rest on.
    pub poses: Option<usize>,
    /// Their alignment.
    pub align: String,
    /// RMSE_2D of single points: mean over the points, pixels.
    pub mean_1_px: Option<f64>,
    /// Its standard deviation over the points.
    pub std_1_px: Option<f64>,
    /// Of subsets of 2 points.
    pub mean_2_px: Option<f64>,
    /// Its standard deviation over the subsets.
    pub std_2_px: Option<f64>,
    /// Of subsets of 3 points.
    pub mean_3_px: Option<f64>,
    /// Its standard deviation over the subsets.
    pub std_3_px: Option<f64>,
    /// Of subsets of 4 points.
    pub mean_4_px: Option<f64>,
    /// Its standard deviation over the subsets.
    pub std_4_px: Option<f64>,
    /// RMSE_2D of all points together, pixels.
    pub pooled_px: Option<f64>,
    /// RMSE_2D of the labels that hold, pixels.
    pub held_px: Option<f64>,
    /// Lower end of its 95 % interval.
    pub low_95_px: Option<f64>,
    /// Upper end.
    pub high_95_px: Option<f64>,
    /// Scored samples.
    pub scored: Option<u64>,
    /// Labels that could not be scored.
    pub skipped: Option<usize>,
    /// Share of the labels that could not be scored and should have been, percent.
    pub skipped_percent: Option<f64>,
    /// Share whose point was carried behind the camera or out of its model, percent.
    pub carried_away_percent: Option<f64>,
    /// What looks wrong in the data: how many remarks the run's document has.
    pub suspicions: Option<usize>,
}

impl ResultRow {
    /// The rows of a result, which start from `common`. `estimators` says whose the estimates are, in their order.
    pub(super) fn of_document(common: &Self, document: &ResultDocument, estimators: &[String]) -> Vec<Self> {
        let mut estimates: Vec<&str> = Vec::new();
        for part in document.pixel.iter().filter(|p| p.role == Role::Estimate) {
            if !estimates.contains(&part.stream.as_str()) {
                estimates.push(&part.stream);
            }
        }
        let estimator = |part: &PixelPart| {
            let place = estimates.iter().position(|e| *e == part.stream).unwrap_or(0);
            match (part.role, estimators) {
                (Role::Estimate, [one]) => one.clone(),
                (Role::Estimate, several) => several.get(place).unwrap_or(&part.stream).clone(),
                (Role::Reference, _) => part.stream.clone(),
            }
        };
        let exit_code = if document.worst_skipped_percent() > MAX_SKIPPED_PERCENT { 3 } else { 0 };
        document
            .pixel
            .iter()
            .map(|part| {
                let trajectory = match part.role {
                    Role::Estimate => document.trajectory.iter().find(|t| t.estimate == part.stream),
                    Role::Reference => None,
                };
                let size = |n: usize| part.rmse_px.get(&n).copied().flatten();
                Self {
                    status: "done".to_string(),
                    exit_code: Some(exit_code),
                    vice_version: document.vice_version.clone(),
                    format: document.dataset.format.clone(),
                    camera: document.dataset.camera.clone(),
                    stream: part.stream.clone(),
                    estimator: estimator(part),
                    role: role_name(part.role).to_string(),
                    depth: part.depth.clone(),
                    rmse_3d_m: trajectory.and_then(|t| t.rmse_3d_m),
                    aoe_rad: trajectory.and_then(|t| t.aoe_rad),
                    roe_rad: trajectory.and_then(|t| t.roe_rad),
                    poses: trajectory.map(|t| t.matched),
                    align: trajectory.map(|t| t.align.clone()).unwrap_or_default(),
                    mean_1_px: size(1).map(|r| r.mean),
                    std_1_px: size(1).map(|r| r.std),
                    mean_2_px: size(2).map(|r| r.mean),
                    std_2_px: size(2).map(|r| r.std),
                    mean_3_px: size(3).map(|r| r.mean),
                    std_3_px: size(3).map(|r| r.std),
                    mean_4_px: size(4).map(|r| r.mean),
                    std_4_px: size(4).map(|r| r.std),
                    pooled_px: part.pooled_rmse_px,
                    held_px: part.held_rmse_px,
                    low_95_px: part.interval_95.map(|i| i[0]),
                    high_95_px: part.interval_95.map(|i| i[1]),
                    scored: Some(part.scored),
                    skipped: Some(part.skipped.len()),
                    skipped_percent: Some(part.skipped_percent()),
                    carried_away_percent: Some(part.carried_away_percent()),
                    suspicions: Some(document.suspicions.iter().count()),
                    ..common.clone()
                }
            })
            .collect()
    }

    /// Mean and standard deviation of RMSE_2D over subsets of 1, 2 and 3 points, pixels.
    pub(super) fn by_points(&self) -> [Option<(f64, f64)>; 3] {
        let pair = |mean: Option<f64>, std: Option<f64>| mean.zip(std);
        [
            pair(self.mean_1_px, self.std_1_px),
            pair(self.mean_2_px, self.std_2_px),
            pair(self.mean_3_px, self.std_3_px),
        ]
    }
}

/// The role as a word.
pub(super) const fn role_name(role: Role) -> &'static str {
    match role {
        Role::Reference => "reference",
        Role::Estimate => "estimate",
    }
}
