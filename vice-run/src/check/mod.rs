//! What is wrong with a recording, before any label: from a request to a list of findings.
//!
//! The checks are [`vice_core::check`]'s. Here the recording is opened as far as it can be, they are handed what it has,
//! and the document is made. What cannot be read is a finding itself.

mod calibration_diff;
mod clock;
mod cloud;
mod gather;
mod images;
mod page;
mod stereo;
mod text;
mod turns;

use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use vice_core::check::{CHECKS, Finding, State};
use vice_core::dataset::Dataset;

pub use calibration_diff::{CalibrationDiffDocument, CalibrationDiffRequest, compare_calibrations};
pub use clock::{ClockDocument, ClockRequest, compare_clocks};
pub use page::page;
pub use text::{head, list_text, render};

use crate::error::{RunError, RunResult};
use crate::formats;
use crate::open::Opened;
use crate::progress::Progress;
use crate::request::{DatasetSpec, Request, StreamsSpec};

/// What is checked.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CheckRequest {
    /// The recording.
    pub dataset: DatasetSpec,
    /// The pose streams beside its own.
    #[serde(default)]
    pub streams: StreamsSpec,
    /// Also look at a sample of images and depth images, and at the cloud.
    #[serde(default)]
    pub images: bool,
    /// An earlier recording of the same rig, with images: whether the cameras lie in the body as they did then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before: Option<DatasetSpec>,
}

/// The document `vice.check/1`.
#[derive(Clone, Debug, Serialize)]
pub struct CheckDocument {
    /// The schema's name and version.
    pub schema: &'static str,
    /// What was asked for.
    pub request: CheckRequest,
    /// Name of the recording.
    pub name: String,
    /// Its format.
    pub format: String,
    /// The worst state there is.
    pub worst: State,
    /// How many findings there are of each state.
    pub counts: Counts,
    /// The findings, in the order of the checks.
    pub findings: Vec<Finding>,
}

/// How many findings there are of each state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Wrong.
    pub wrong: usize,
    /// Worth a look.
    pub look: usize,
    /// As it should be.
    pub ok: usize,
    /// Not known.
    pub unknown: usize,
}

impl CheckRequest {
    /// The files that are read.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let files = |dataset: &DatasetSpec, streams: &StreamsSpec| {
            Request { dataset: dataset.clone(), streams: streams.clone(), ..Request::default() }.inputs()
        };
        let mut inputs = files(&self.dataset, &self.streams);
        inputs.extend(self.before.iter().flat_map(|before| files(before, &StreamsSpec::default())));
        inputs
    }
}

/// Checks a recording. `progress` is told how many images of how many were looked at.
///
/// # Errors
/// [`RunError`] if no format reads it, or a stream that is named cannot be read.
pub fn check(request: &CheckRequest, progress: &Progress<'_>) -> RunResult<CheckDocument> {
    let spec = &request.dataset;
    check_open(request, spec.open_raw(&formats::registry(&spec.plugins)?)?, progress)
}

/// Checks a recording that is open already, as the request's data set without its overrides.
///
/// # Errors
/// As [`check`].
pub fn check_open(
    request: &CheckRequest,
    dataset: Arc<dyn Dataset>,
    progress: &Progress<'_>,
) -> RunResult<CheckDocument> {
    if request.before.is_some() && !request.images {
        return Err(RunError::usage("before", "compares what the images of both recordings say")
            .advise("give `images`"));
    }
    checked(request, &gather::gather(request, dataset)?, progress)
}

/// Checks a recording that is open with the overrides of the request in place.
///
/// # Errors
/// As [`check`].
pub fn check_opened(
    request: &CheckRequest,
    opened: &Opened,
    progress: &Progress<'_>,
) -> RunResult<CheckDocument> {
    checked(request, &gather::gather_opened(request, opened)?, progress)
}

fn checked(
    request: &CheckRequest,
    gathered: &gather::Gathered,
    progress: &Progress<'_>,
) -> RunResult<CheckDocument> {
    let mut findings = gathered.findings(request.images.then_some(progress));
    findings.sort_by_key(place);
    let count = |state: State| findings.iter().filter(|f| f.state == state).count();
    Ok(CheckDocument {
        schema: "vice.check/1",
        request: request.clone(),
        name: gathered.name().to_string(),
        format: gathered.format().to_string(),
        worst: findings.iter().map(|f| f.state).max().unwrap_or(State::Unknown),
        counts: Counts {
            wrong: count(State::Wrong),
            look: count(State::Look),
            ok: count(State::Ok),
            unknown: count(State::Unknown),
        },
        findings,
    })
}

/// Where a check stands in the list; those of readers and formats stand first.
fn place(finding: &Finding) -> usize {
    CHECKS.iter().position(|c| c.name == finding.check).map_or(0, |p| p + 1)
}
