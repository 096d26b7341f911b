//! `results.csv`: one row a run, pose stream and depth source.

use std::path::Path;

use serde::{Deserialize, Serialize};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::result::{PixelPart, Role};

use crate::error::RunResult;
use crate::report::csv::{cell, finished};
use crate::result::{MAX_SKIPPED_PERCENT, ResultDocument};

/// Name and version of the columns.
pub const SCHEMA: &str = "vice.results/1";

/// A row. No time and no place is in it, so that it is the same wherever the run was made. Names say units; what could
/// not be had is empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResultRow {
    /// [`SCHEMA`].
    pub schema: String,
    /// Name of the run.
    pub run_id: String,
    /// Its group.
    pub group: String,
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
    /// The rows of a result, which start from `common`.
    pub(super) fn of_document(common: &Self, document: &ResultDocument) -> Vec<Self> {
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
                    camera: cell(&document.dataset.camera),
                    stream: cell(&part.stream),
                    role: role(part).to_string(),
                    depth: cell(&part.depth),
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

fn role(part: &PixelPart) -> &'static str {
    match part.role {
        Role::Reference => "reference",
        Role::Estimate => "estimate",
    }
}

/// Rows as CSV with a heading.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if a text is none.
pub fn to_csv(rows: &[impl Serialize]) -> RunResult<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    finished(writer)
}

/// Reads a `results.csv`.
///
/// # Errors
/// [`DataError`] with path and line for what is none, or of another version.
pub fn read(path: &Path) -> DataResult<Vec<ResultRow>> {
    let wrong = |e: csv::Error| {
        let error = DataError::new("is no results.csv").at(path);
        let line = e.position().map(csv::Position::line);
        line.map_or(error.hint("`vice batch collect` writes one"), |line| {
            DataError::new("is no row of a results.csv").at(path).line(line)
        })
        .because(e)
    };
    let text = crate::result::read_bytes(path)?;
    let mut reader = csv::Reader::from_reader(text.as_slice());
    let first = reader.headers().map_err(wrong)?.get(0).map(str::to_string);
    if first.as_deref() != Some("schema") {
        return Err(DataError::of_kind(
            ErrorKind::Usage,
            "is no results.csv: its first column is not `schema`",
        )
        .at(path)
        .hint("`vice batch collect` writes one"));
    }
    let mut rows = Vec::new();
    for row in reader.deserialize::<ResultRow>() {
        let row = row.map_err(wrong)?;
        if row.schema != SCHEMA {
            return Err(DataError::of_kind(
                ErrorKind::Unsupported,
                format!("is {}, this VICE reads {SCHEMA}", row.schema),
            )
            .at(path));
        }
        rows.push(row);
    }
    Ok(rows)
}
