//! Labels of a run: all frames in parallel, then points over time.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

use rayon::prelude::*;
use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::{Dataset, Image};
use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelRow, LabelSet};
use vice_core::time::{Span, Stamp};

use crate::associate::{self, Gaps, Sighting};
use crate::board::{self, Board, BoardSize, Found};
use crate::gray::Gray;
use crate::saddle;
use crate::select::best_spread;
use crate::tag::{self, Tag, TagOptions};

/// What to look for, and how points are kept over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectOptions {
    /// Tags to look for.
    pub tags: Option<TagOptions>,
    /// Chessboard to look for.
    pub board: Option<BoardSize>,
    /// A point that was unseen for longer starts anew: 3 s, more than a trajectory's error over which it says anything.
    pub max_gap: Span,
    /// A point that was missed in a frame and unseen for longer starts anew: 0.5 s bridges a blurred frame.
    pub max_lost: Span,
    /// Keep only so many points, those that cover image and time best.
    pub select: Option<usize>,
}

impl Default for DetectOptions {
    fn default() -> Self {
        Self {
            tags: None,
            board: None,
            max_gap: Span::from_millis(3000),
            max_lost: Span::from_millis(500),
            select: None,
        }
    }
}

/// What was looked at and found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DetectReport {
    /// Frames that were decoded and looked at.
    pub frames: usize,
    /// Frames that could not be decoded, with the reason.
    pub undecoded: Vec<(Stamp, String)>,
    /// Frames with a tag.
    pub frames_with_tags: usize,
    /// Tags found, all frames together.
    pub tags: usize,
    /// Tags left out since the frame holds two of the same number.
    pub twice: usize,
    /// Frames with the chessboard.
    pub frames_with_board: usize,
    /// The size of full boards that are not the one asked for, shorter side first, with the number of their frames;
    /// the most frequent one.
    pub other_board: Option<(usize, usize, usize)>,
    /// Segments that the labels start: first sights and respawns.
    pub segments: usize,
}

/// Labels and how they came about.
#[derive(Clone, Debug)]
pub struct Detection {
    /// The labels, source `detected`; empty where no target is in view.
    pub labels: LabelSet,
    /// What was looked at and found.
    pub report: DetectReport,
}

impl DetectReport {
    /// Why there are no labels, in one line: what was looked for, in how many frames, and what might be meant.
    pub fn nothing_found(&self, options: &DetectOptions) -> String {
        let tags = options.tags.map(|t| format!("no tag {}", t.family.name()));
        let board = options.board.map(|size| format!("no chessboard of {size} inner corners"));
        let what: Vec<String> = [tags, board].into_iter().flatten().collect();
        let mut text = format!("{} in view in {} frames", what.join(" and "), self.frames);
        if !self.undecoded.is_empty() {
            text += &format!(", {} could not be decoded", self.undecoded.len());
        }
        if self.twice > 0 {
            text += &format!(
                ", {} tags were left out since their frames hold two of the same number",
                self.twice
            );
        }
        if let Some((w, h, count)) = self.other_board {
            text += &format!(" (a grid of {w}x{h} is in {count} of them)");
        }
        text
    }
}

/// The labels found that add to those that are there: points in frames where they have no label yet, in the order of
/// `found`. What is there is never changed.
pub fn additions(there: &LabelSet, found: &LabelSet) -> Vec<LabelRow> {
    let taken: BTreeSet<(&str, Stamp)> = there
        .points()
        .iter()
        .flat_map(|p| p.observations.iter().map(|o| (p.name.as_str(), o.stamp)))
        .collect();
    let all = found.points().iter().flat_map(|p| p.observations.iter().map(move |o| (p.name.as_str(), *o)));
    all.filter(|(point, o)| !taken.contains(&(*point, o.stamp)))
        .map(|(point, observation)| LabelRow { point: point.to_string(), observation })
        .collect()
}

/// Tags in one picture, by number. With the camera, corners are where undistorted edges cross.
pub fn find_tags(image: &Image, options: TagOptions, camera: Option<&Camera>) -> Vec<Tag> {
    tag::find(&Gray::of(image), options, camera)
}

/// The chessboard in one picture, all of its inner corners or `None`.
pub fn find_board(image: &Image, size: BoardSize) -> Option<Board> {
    match look_for_board(&Gray::of(image), size) {
        Found::Board(board) => Some(board),
        _ => None,
    }
}

fn look_for_board(gray: &Gray, size: BoardSize) -> Found {
    let smooth = gray.blurred(saddle::SMOOTHING_PX);
    board::find(&smooth, &saddle::find(&smooth), size)
}

/// One frame's findings.
enum Looked {
    At { sighting: Sighting, twice: usize, other: Option<(usize, usize)> },
    Undecoded(Stamp, String),
}

/// Labels the targets in the given frames (indices, ascending) of a camera.
///
/// Points are called `tag12.c0` (top left corner of the printed tag's border, then clockwise) and `board.r0c0` (row and
/// column of the inner corner). Frames are looked at in parallel, a few at a time, so that memory does not grow with
/// their number; the result does not depend on the number of threads. `progress` is called with (done, total), and may end
/// the search there: the labels are then those of the frames that were done.
/// A frame that cannot be decoded is skipped and reported.
///
/// # Errors
/// [`DataError`] if nothing is to be looked for, a frame does not exist, or images are not of the camera's size.
pub fn detect_labels(
    dataset: &dyn Dataset,
    camera_name: &str,
    camera: &Camera,
    frames: &[usize],
    options: &DetectOptions,
    progress: &(dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
) -> DataResult<Detection> {
    if options.tags.is_none() && options.board.is_none() {
        return Err(DataError::new("nothing to look for: neither tags nor a chessboard were named"));
    }
    let stamps = dataset.frames(camera_name)?;
    if let Some(frame) = frames.iter().find(|f| **f >= stamps.len()) {
        let count = stamps.len();
        return Err(DataError::new(format!("there is no frame {frame}: camera {camera_name} has {count}")));
    }
    let mut report = DetectReport::default();
    let mut sightings = Vec::with_capacity(frames.len());
    let mut others: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let mut done = 0;
    for some in frames.chunks(8 * rayon::current_num_threads()) {
        let looked: Vec<DataResult<Looked>> = some
            .par_iter()
            .map(|frame| look(dataset, camera_name, camera, *frame, stamps[*frame], options))
            .collect();
        for looked in looked {
            match looked? {
                Looked::At { sighting, twice, other } => {
                    report.frames += 1;
                    report.frames_with_tags += usize::from(!sighting.tags.is_empty());
                    report.tags += sighting.tags.len();
                    report.twice += twice;
                    report.frames_with_board += usize::from(sighting.board.is_some());
                    if let Some(size) = other {
                        *others.entry(size).or_default() += 1;
                    }
                    sightings.push(sighting);
                }
                Looked::Undecoded(stamp, reason) => report.undecoded.push((stamp, reason)),
            }
        }
        done += some.len();
        if progress(done, frames.len()).is_break() {
            break;
        }
    }
    report.other_board =
        others.into_iter().max_by_key(|(_, count)| *count).map(|((w, h), count)| (w, h, count));
    let gaps = Gaps { any: options.max_gap, missed: options.max_lost };
    let rows = associate::rows(&sightings, options.board, gaps, |px: Pixel| camera.contains(px));
    let mut labels = LabelSet::from_rows(rows)
        .map_err(|e| DataError::new("the corners found make no labels").because(e))?;
    if let Some(n) = options.select {
        let names = best_spread(&labels, camera, n);
        labels = labels.select(&names).map_err(|name| DataError::new(format!("there is no point {name}")))?;
    }
    labels.dataset = Some(dataset.name().to_string());
    labels.camera = Some(camera_name.to_string());
    report.segments = labels.points().iter().map(|p| p.segments().count()).sum();
    Ok(Detection { labels, report })
}

fn look(
    dataset: &dyn Dataset,
    camera_name: &str,
    camera: &Camera,
    frame: usize,
    stamp: Stamp,
    options: &DetectOptions,
) -> DataResult<Looked> {
    let image = match dataset.image(camera_name, frame) {
        Ok(image) => image,
        Err(error) => return Ok(Looked::Undecoded(stamp, error.to_string())),
    };
    if (image.width(), image.height()) != (camera.width(), camera.height()) {
        return Err(DataError::new(format!(
            "the image of {camera_name} at {stamp} ns is {}x{}, its calibration is for {}x{}",
            image.width(),
            image.height(),
            camera.width(),
            camera.height()
        )));
    }
    let gray = Gray::of(&image);
    drop(image);
    let mut tags = options.tags.map_or_else(Vec::new, |t| tag::find(&gray, t, Some(camera)));
    // Two of the same number cannot be told apart: neither is labelled.
    let found = tags.len();
    let same = |a: &Tag, b: &Tag| a.id == b.id && a.corners != b.corners;
    let all = tags.clone();
    tags.retain(|t| !all.iter().any(|other| same(t, other)));
    let (board, other) = match options.board.map(|size| look_for_board(&gray, size)) {
        Some(Found::Board(board)) => (Some(board), None),
        Some(Found::Other(w, h)) => (None, Some((w, h))),
        _ => (None, None),
    };
    let twice = found - tags.len();
    Ok(Looked::At { sighting: Sighting { stamp, tags, board }, twice, other })
}
