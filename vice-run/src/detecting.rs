//! Calibration targets as labels: from a recording to a labels file.

use std::ops::ControlFlow;
use std::path::Path;

use vice_core::label::{LabelRow, LabelSet};
use vice_detect::{DetectOptions, DetectReport, additions, detect_labels};
use vice_files::atomic::Overwrite;
use vice_files::labels;

use crate::error::{RunError, RunResult};
use crate::open::Opened;
use crate::progress::Progress;
use crate::request::Protocol;

/// What was found, and how the search went.
pub struct Found {
    /// The new labels.
    pub labels: LabelSet,
    /// How many frames hold what, and what was left out.
    pub report: DetectReport,
}

/// Looks for targets and writes their corners as labels. With `add` those that the file holds already stay as they are;
/// without, a file that is there is refused.
///
/// # Errors
/// [`RunError`] if nothing is found, the window is empty, or the file cannot be written.
pub fn detect_to_file(
    opened: &Opened,
    protocol: &Protocol,
    options: &DetectOptions,
    (out, add): (&Path, bool),
    progress: &Progress<'_>,
) -> RunResult<Found> {
    let there = match (out.exists(), add) {
        (true, false) => {
            return Err(RunError::usage("out", format!("{} exists already", out.display()))
                .advise("`add` adds to it; or name another file"));
        }
        (true, true) => Some(labels::read(out, Some(&opened.frames))?),
        (false, _) => None,
    };
    if let Some(other) = there.as_ref().and_then(|l| l.camera.as_ref()).filter(|c| **c != opened.camera_name)
    {
        return Err(RunError::usage(
            "out",
            format!("{} holds labels of camera {other}, not {}", out.display(), opened.camera_name),
        ));
    }
    let frames = protocol.frames(opened)?;
    let (name, camera) = (&opened.camera_name, &opened.camera);
    let found = detect_labels(opened.dataset.as_ref(), name, camera, &frames, options, &|done, total| {
        progress("looking", done, total);
        ControlFlow::Continue(())
    })?;
    warn(&found.report);
    if found.labels.points().is_empty() {
        let text = format!("{}: {}", opened.dataset.name(), found.report.nothing_found(options));
        return Err(match found.report.other_board {
            Some((w, h, _)) => RunError::missing(text).advise(format!("`chessboard` {w}x{h}?")),
            None => RunError::missing(text),
        });
    }
    let all = match there {
        Some(there) => added(there, &found.labels)?,
        None => found.labels.clone(),
    };
    labels::write(out, &all, if add { Overwrite::Replace } else { Overwrite::Refuse })?;
    Ok(Found { labels: found.labels, report: found.report })
}

/// All labels that are there, and the new ones of points and frames that have none.
fn added(there: LabelSet, new: &LabelSet) -> RunResult<LabelSet> {
    let more = additions(&there, new);
    let rows = there
        .points()
        .iter()
        .flat_map(|p| p.observations.iter().map(|o| LabelRow { point: p.name.clone(), observation: o }));
    let mut labels = LabelSet::from_rows(rows.chain(more))
        .map_err(|e| RunError::usage("add", "the labels do not fit together").because(e))?;
    labels.dataset = there.dataset.or_else(|| new.dataset.clone());
    labels.camera = there.camera.or_else(|| new.camera.clone());
    Ok(labels)
}

fn warn(report: &DetectReport) {
    if let Some((stamp, reason)) = report.undecoded.first() {
        let count = report.undecoded.len();
        tracing::warn!(
            "{count} frames could not be decoded and were skipped, the first at {stamp} ns: {reason}"
        );
    }
    if report.twice > 0 {
        tracing::warn!("{} tags were left out: a frame holds two of the same number", report.twice);
    }
}
