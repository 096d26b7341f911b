//! Looking for calibration targets in the frames that are labelled.

use std::ops::ControlFlow;

use serde::Deserialize;
use vice_core::error::{DataError, DataResult, one_line};
use vice_detect::{BoardSize, DetectOptions, Detection, TagFamily, TagOptions, additions, detect_labels};

use super::{Job, Listener, Progress};
use crate::desk::Desk;
use crate::store::{By, StoreError};

/// What is to be looked for, in the words of `vice labels detect`.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectRequest {
    /// The revision that the asker has seen.
    pub revision: u64,
    /// AprilTags of this family.
    pub apriltag: Option<String>,
    /// Cells that the tags' dark border is wide, 1 or 2; either where it is not said.
    pub border_bits: Option<u8>,
    /// A chessboard by its inner corners, such as `6x7`.
    pub chessboard: Option<String>,
    /// Keep only so many points, those that cover image and time best.
    pub select: Option<u32>,
}

impl DetectRequest {
    /// The same, checked.
    ///
    /// # Errors
    /// [`DataError`] if nothing is to be looked for, or it is no target that is known.
    pub fn options(&self) -> DataResult<DetectOptions> {
        let border = match self.border_bits {
            None => None,
            Some(cells @ 1..=2) => Some(usize::from(cells)),
            Some(cells) => {
                return Err(DataError::new(format!("a tag's border is 1 or 2 cells wide, not {cells}")));
            }
        };
        let family =
            self.apriltag.as_deref().map(str::parse::<TagFamily>).transpose().map_err(DataError::new)?;
        let board =
            self.chessboard.as_deref().map(str::parse::<BoardSize>).transpose().map_err(DataError::new)?;
        if family.is_none() && board.is_none() {
            return Err(DataError::new("name a family of tags, the size of a chessboard, or both"));
        }
        if self.select == Some(0) {
            return Err(DataError::new("no point would be kept: keep at least one"));
        }
        Ok(DetectOptions {
            tags: family.map(|family| TagOptions { family, border }),
            board,
            select: self.select.map(|n| n as usize),
            ..DetectOptions::default()
        })
    }
}

/// Looks through the chosen frames and adds what is found as one step; nothing where it is stopped.
pub(super) fn run(desk: &Desk, listener: &dyn Listener, job: &Job, options: &DetectOptions) {
    let outcome = look(desk, listener, job, options);
    job.update(listener, |state| {
        (state.state, state.message) = match outcome {
            Ok(message) => (Progress::Done, Some(message)),
            Err(_) if job.is_stopped() => (Progress::Stopped, None),
            Err(error) => (Progress::Failed, Some(error)),
        };
    });
}

fn look(desk: &Desk, listener: &dyn Listener, job: &Job, options: &DetectOptions) -> Result<String, String> {
    let progress = |done: usize, _: usize| {
        job.update(listener, |state| state.done = done);
        if job.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let found = detect_labels(
        desk.dataset.as_ref(),
        &desk.camera_name,
        &desk.camera,
        &desk.chosen,
        options,
        &progress,
    )
    .map_err(|e| one_line(&e))?;
    let Detection { labels, report } = &found;
    if labels.points().is_empty() && !job.is_stopped() {
        return Ok(format!("{}; nothing has changed", report.nothing_found(options)));
    }
    let mut store = desk.store();
    // What stopped it may have been an undo: then nothing may come on top of that.
    if job.is_stopped() {
        return Err("stopped".to_string());
    }
    let more = additions(&store.document().labels().map_err(|e| one_line(&e))?, labels);
    let document = store.document();
    let cells: Vec<_> = more
        .into_iter()
        .filter_map(|row| document.cell(&row.point, row.observation.stamp, Some(row.observation)))
        .collect();
    let added = cells.len();
    let label = format!("detect {}", what(options));
    let id = job.state().id;
    let committed = store.commit(By::Detect, label, Some(id), cells);
    let changed = committed.map_err(|e: StoreError| one_line(&e))?;
    if !changed.points.is_empty() {
        listener.changed(&store, &changed);
    }
    drop(store);
    let mut text = frames_with(&found, options);
    text += &match (added, changed.points.len()) {
        (0, _) => ": all of it is labelled already; nothing has changed".to_string(),
        (_, points) => format!(": {added} observations of {points} points added"),
    };
    if !report.undecoded.is_empty() {
        text += &format!("; {} frames could not be decoded", report.undecoded.len());
    }
    if report.twice > 0 {
        text += &format!("; {} tags were left out, since a frame holds two of the same number", report.twice);
    }
    Ok(text)
}

fn what(options: &DetectOptions) -> String {
    let tags = options.tags.map(|t| format!("tags {}", t.family.name()));
    let board = options.board.map(|size| format!("chessboard {size}"));
    tags.into_iter().chain(board).collect::<Vec<_>>().join(" and ")
}

fn frames_with(found: &Detection, options: &DetectOptions) -> String {
    let report = &found.report;
    let mut with = Vec::new();
    if options.tags.is_some() {
        with.push(format!("{} with tags", report.frames_with_tags));
    }
    if options.board.is_some() {
        with.push(format!("{} with the chessboard", report.frames_with_board));
    }
    format!("{} frames, {}", report.frames, with.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_targets_that_are_known_are_looked_for() {
        let request = |text: &str| serde_json::from_str::<DetectRequest>(text).unwrap().options();
        let options =
            request(r#"{"revision": 1, "apriltag": "36h11", "border_bits": 2, "chessboard": "6x7"}"#);
        let options = options.unwrap();
        assert_eq!(options.tags, Some(TagOptions { family: TagFamily::T36h11, border: Some(2) }));
        assert_eq!(options.board.map(|b| b.to_string()), Some("6x7".to_string()));
        for (text, word) in [
            (r#"{"revision": 1}"#, "name a family"),
            (r#"{"revision": 1, "apriltag": "36h12"}"#, "36h12"),
            (r#"{"revision": 1, "apriltag": "36h11", "border_bits": 3}"#, "not 3"),
            (r#"{"revision": 1, "chessboard": "6"}"#, "6"),
            (r#"{"revision": 1, "chessboard": "1x1"}"#, "1x1"),
            (r#"{"revision": 1, "chessboard": "6x7", "select": 0}"#, "at least one"),
        ] {
            let error = request(text).unwrap_err().to_string();
            assert!(error.contains(word), "{text}: {error}");
        }
    }
}
