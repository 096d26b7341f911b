//! The result document `vice.result/2`: what was asked for, what an evaluation found, and all that is needed to repeat
//! and to plot it.
//!
//! Units stand in the names. A number that could not be had is null, never NaN.

mod of_request;
mod read;
mod version_1;

use serde::{Deserialize, Serialize};
use vice_core::error::ErrorKind;
use vice_core::result::{DatasetPart, Evaluated, PathPart, PixelPart, TrajectoryPart, worst_skipped_percent};
use vice_core::suspicion::Suspicions;

use read::parse;
pub use read::read;
pub(crate) use read::read_bytes;

use crate::error::{RunError, RunResult};
use crate::request::Request;
use crate::tracking_summary::TrackingSummary;

/// The schema's name and version.
pub const SCHEMA: &str = "vice.result/2";

/// The schema of results of several cameras: a list of these documents, with what was asked for.
pub const SCHEMA_OF_RIGS: &str = "vice.rig/1";

/// Share of labels that may be skipped before `vice evaluate` ends with 3, unless it is told another, percent.
pub const MAX_SKIPPED_PERCENT: f64 = 10.0;

/// The document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResultDocument {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of VICE that wrote it.
    #[serde(default)]
    pub vice_version: String,
    /// What was asked for: `vice evaluate --request` with this document asks for the same again.
    pub request: Request,
    /// What took the place of what the request leaves open.
    pub used: Used,
    /// What was evaluated.
    pub dataset: DatasetPart,
    /// Pixel errors, one entry for each pose stream and depth source.
    pub pixel: Vec<PixelPart>,
    /// Estimates against the reference, where there is one.
    pub trajectory: Vec<TrajectoryPart>,
    /// Where each stream went, for plots; empty where the samples were not asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub paths: Vec<PathPart>,
    /// What looks wrong in the data but did not stop the evaluation.
    #[serde(default, skip_serializing_if = "Suspicions::is_empty")]
    pub suspicions: Suspicions,
}

/// Refuses results by triangulated depth beside results by another: it takes a part of the error for depth, so that the
/// numbers are no comparison.
///
/// # Errors
/// [`RunError`] of the kind usage.
pub fn check_unmixed<'a>(documents: impl IntoIterator<Item = &'a ResultDocument>) -> RunResult<()> {
    let (mut with, mut without) = (false, false);
    for part in documents.into_iter().flat_map(|document| &document.pixel) {
        with |= part.triangulation.is_some();
        without |= part.triangulation.is_none();
    }
    if with && without {
        let problem = "results by triangulated depth cannot stand beside other depths: it takes a part of the error for depth";
        return Err(RunError::new(ErrorKind::Usage, problem).advise("show or compare them apart"));
    }
    Ok(())
}

/// In place of a stream's name where each stream places the camera for its own depth.
pub const OWN_ANCHOR: &str = "each stream its own";

/// What took the place of what a request leaves open.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Used {
    /// Names of the points that take part.
    pub points: Vec<String>,
    /// The pose stream that places the camera for depth, or [`OWN_ANCHOR`].
    pub anchor: String,
    /// Seconds added to the estimates' stamps.
    pub time_offset_s: f64,
    /// Alignment of the trajectory errors.
    pub align: String,
    /// Noise of the labels that the intervals are without, pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label_noise_px: Option<f64>,
    /// How the labels came about, where no person made them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracking: Option<TrackingSummary>,
}

impl ResultDocument {
    /// The document of what was found.
    pub fn new(request: Request, used: Used, found: Evaluated) -> Self {
        Self {
            schema: SCHEMA.to_string(),
            vice_version: env!("CARGO_PKG_VERSION").to_string(),
            request: request.without_secrets(),
            used,
            dataset: found.dataset,
            pixel: found.pixel,
            trajectory: found.trajectory,
            paths: found.paths,
            suspicions: found.suspicions,
        }
    }

    /// Leaves out the scored samples and what only plots need, as if they had not been asked for.
    pub fn drop_samples(&mut self) {
        self.paths.clear();
        self.pixel.iter_mut().for_each(|p| p.samples.clear());
        self.trajectory.iter_mut().for_each(TrajectoryPart::drop_plots);
    }

    /// Largest [`PixelPart::skipped_percent`] of all parts.
    pub fn worst_skipped_percent(&self) -> f64 {
        worst_skipped_percent(&self.pixel)
    }
}
