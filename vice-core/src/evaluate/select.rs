//! Which frames and labels take part, before any pose is looked at.

use std::sync::Arc;

use super::kept::{FrameFinder, KeptFrames};
use super::runs::{self, Run, index};
use super::{EvaluateError, SkipReason};
use crate::camera::{Camera, Pixel};
use crate::label::{LabelSet, Marks, Observation, ObservationList, ObservationSource, PointLabels};
use crate::parallel::*;
use crate::time::{Span, Stamp};
use crate::time_unit::mixed_up;

/// The part of a run that is evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Window {
    /// Keep the frame nearest to each tick of this rate (Hz), and every key frame. `None` keeps every labelled frame.
    pub fps: Option<f64>,
    /// Counts from the camera's first frame.
    pub start: Span,
    /// Counts from `start`; `None` to the end.
    pub duration: Option<Span>,
    /// Whose labels count.
    pub observations: Observations,
}

/// Whose labels count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Observations {
    /// Those that whoever made them is sure of. A segment whose key frame is flagged as uncertain is left out as a
    /// whole: all of it would be carried from a doubtful place.
    #[default]
    Certain,
    /// All, whoever made them and however sure.
    All,
    /// Only those that a human placed: no number depends on another one. A segment whose key frame a machine made is
    /// left out as a whole, since what its point is would be the machine's word.
    Manual,
}

impl Observations {
    /// The name in options and documents.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Certain => "certain",
            Self::All => "all",
            Self::Manual => "manual",
        }
    }

    /// Why a label does not count, as a sample and as a key frame; `None` where it does.
    #[inline]
    fn leaves_out(self, marks: Marks) -> Option<(SkipReason, SkipReason)> {
        match self {
            Self::Certain if marks.uncertain() => {
                Some((SkipReason::Uncertain, SkipReason::KeyframeUncertain))
            }
            Self::Manual if marks.source() != ObservationSource::Manual => {
                Some((SkipReason::NotManual, SkipReason::KeyframeNotManual))
            }
            _ => None,
        }
    }
}

impl std::str::FromStr for Observations {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "certain" => Ok(Self::Certain),
            "all" => Ok(Self::All),
            "manual" => Ok(Self::Manual),
            _ => Err("expected certain, manual or all".to_string()),
        }
    }
}

impl Window {
    /// Indices of the frames that the window keeps, ascending.
    pub fn frames(&self, frames: &[Stamp]) -> Vec<usize> {
        if frames.is_empty() {
            return vec![];
        }
        let kept = KeptFrames::new(frames, self);
        (0..frames.len()).filter(|i| kept.covers(frames[*i]) && kept.has(*i)).collect()
    }
}

/// A key frame and the labels that are scored against it.
#[derive(Clone, Debug)]
pub(super) struct SelectedSegment {
    /// Its label at the key frame, by its place among those of the point.
    pub(super) keyframe: usize,
    /// The key frame, among the camera's frames.
    pub(super) frame: usize,
    /// The same among the selected frames.
    pub(super) place: usize,
    /// Its part of the point's runs.
    pub(super) runs: std::ops::Range<usize>,
    /// How many labels are scored.
    pub(super) count: usize,
}

/// A point with what is scored of it, and what is known not to be.
#[derive(Debug)]
pub(super) struct SelectedPoint<'a> {
    pub(super) name: Arc<str>,
    pub(super) labels: &'a ObservationList,
    pub(super) segments: Vec<SelectedSegment>,
    /// The labels that are scored; frames are places among the selected ones.
    pub(super) runs: Vec<Run>,
    pub(super) skips: Vec<(Stamp, SkipReason)>,
}

impl SelectedPoint<'_> {
    /// A label's pixel.
    #[inline]
    pub(super) fn px(&self, label: usize) -> Pixel {
        Pixel::new(self.labels.u_px()[label], self.labels.v_px()[label])
    }

    /// A label's stamp.
    #[inline]
    pub(super) fn stamp(&self, label: usize) -> Stamp {
        self.labels.stamps()[label]
    }

    /// Labels of a segment that are scored, and their places among the selected frames.
    pub(super) fn samples(&self, segment: &SelectedSegment) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.runs[segment.runs.clone()].iter().flat_map(|run| run.pairs())
    }
}

/// The frames and labels that take part.
#[derive(Debug)]
pub struct Selection<'a> {
    pub(super) points: Vec<SelectedPoint<'a>>,
    /// Indices of frames with a key frame or a sample, ascending.
    pub(super) frames: Vec<usize>,
    /// Those of them that lie in the window: a key frame before it says what a point is, no more.
    pub(super) in_window: Vec<usize>,
}

/// A key frame that takes part, with the labels that are scored against it. Frames are indices.
#[derive(Clone, Debug)]
pub struct SelectedKeyframe<'s> {
    /// Name of the point.
    pub point: &'s str,
    /// Its label at the key frame.
    pub keyframe: Observation,
    /// The key frame.
    pub frame: usize,
    of: &'s SelectedPoint<'s>,
    segment: &'s SelectedSegment,
    frames: &'s [usize],
}

impl<'s> SelectedKeyframe<'s> {
    /// The labels that are scored, and their frames.
    pub fn samples(&self) -> impl Iterator<Item = (Observation, usize)> + use<'s> {
        let (of, frames) = (self.of, self.frames);
        of.samples(self.segment).filter_map(|(label, place)| Some((of.labels.get(label)?, frames[place])))
    }
}

impl<'a> Selection<'a> {
    /// Names of the points that take part.
    pub fn point_names(&self) -> impl Iterator<Item = &str> {
        self.points.iter().map(|p| p.name.as_ref())
    }

    /// Matches labels with frames by their exact stamp and keeps those of the window.
    ///
    /// A segment whose key frame lies before the window keeps that key frame: it says what the point is.
    ///
    /// # Errors
    /// [`EvaluateError`] if there are no labels, none is at a frame, one lies outside the image, or the window is
    /// empty.
    pub fn new(
        labels: &'a LabelSet,
        frames: &[Stamp],
        camera: &Camera,
        window: &Window,
    ) -> Result<Self, EvaluateError> {
        let (Some(first), Some(last)) = (frames.first(), frames.last()) else {
            return Err(EvaluateError::NoFrames);
        };
        if labels.observation_count() == 0 {
            return Err(EvaluateError::NoLabels);
        }
        check_inside(labels, camera)?;
        let kept = KeptFrames::new(frames, window);
        let chosen = |point: &'a PointLabels| choose(point, frames, &kept, window.observations);
        let (mut points, at_frames): (Vec<_>, Vec<bool>) =
            labels.points().par_iter().map(chosen).collect::<Vec<_>>().into_iter().unzip();
        let at_a_frame = at_frames.contains(&true);
        if !at_a_frame {
            return Err(no_label_at_a_frame(labels, (*first, *last)));
        }
        let used = used_frames(&points, frames.len());
        if used.is_empty() {
            let marks =
                || labels.points().iter().flat_map(|p| p.observations.marks()).filter(|m| m.keyframe());
            if marks().next().is_some() && !marks().any(|m| window.observations.leaves_out(*m).is_none()) {
                return Err(match window.observations {
                    Observations::Manual => EvaluateError::NoManualKeyframe,
                    _ => EvaluateError::NoCertainKeyframe,
                });
            }
            let all = Window { observations: Observations::default(), ..*window };
            return Err(if all != Window::default() {
                EvaluateError::EmptyWindow
            } else {
                EvaluateError::NoKeyframe
            });
        }
        let in_window = used.iter().copied().filter(|f| kept.covers(frames[*f])).collect();
        place(&mut points, &used, frames.len());
        Ok(Self { points, frames: used, in_window })
    }

    /// The earliest key frame that takes part.
    pub fn first_keyframe(&self) -> Option<Stamp> {
        self.points.iter().flat_map(|p| p.segments.iter().map(|s| p.stamp(s.keyframe))).min()
    }

    /// The first and last frame that takes part.
    pub fn stamp_range(&self, frames: &[Stamp]) -> Option<(Stamp, Stamp)> {
        Some((frames[*self.frames.first()?], frames[*self.frames.last()?]))
    }

    /// The key frames that take part, by point and in time.
    pub fn keyframes(&self) -> impl Iterator<Item = SelectedKeyframe<'_>> {
        self.points.iter().flat_map(|p| {
            p.segments.iter().filter_map(|segment| {
                Some(SelectedKeyframe {
                    point: &p.name,
                    keyframe: p.labels.get(segment.keyframe)?,
                    frame: segment.frame,
                    of: p,
                    segment,
                    frames: &self.frames,
                })
            })
        })
    }

    /// Number of points with a name, scored or not.
    pub fn point_count(&self) -> usize {
        self.points.len()
    }
}

/// What takes part of a point; frames are the camera's. And whether any label is at a frame.
fn choose<'a>(
    point: &'a PointLabels,
    frames: &[Stamp],
    kept: &KeptFrames,
    whose: Observations,
) -> (SelectedPoint<'a>, bool) {
    let labels = &point.observations;
    let (stamps, marks) = (labels.stamps(), labels.marks());
    let mut selected = SelectedPoint {
        name: point.name.as_str().into(),
        labels,
        segments: vec![],
        runs: vec![],
        skips: vec![],
    };
    let mut finder = FrameFinder::new(frames);
    let mut at_a_frame = false;
    for stamp in &stamps[..point.before_first_keyframe()] {
        at_a_frame |= finder.find(*stamp).is_some();
        if kept.covers(*stamp) {
            selected.skips.push((*stamp, SkipReason::BeforeFirstKeyframe));
        }
    }
    for segment in point.segments() {
        let keyframe = finder.find(segment.keyframe.stamp);
        at_a_frame |= keyframe.is_some();
        let keyframe_left_out = whose.leaves_out(marks[segment.at]).map(|(_, reason)| reason);
        let first = selected.runs.len();
        for label in segment.rest {
            let (stamp, marks) = (stamps[label], marks[label]);
            let frame = finder.find(stamp);
            at_a_frame |= frame.is_some();
            if !kept.covers(stamp) {
                continue;
            }
            let Some(frame) = frame else {
                selected.skips.push((stamp, SkipReason::NoFrame));
                continue;
            };
            if !kept.has(frame) {
                continue;
            }
            let left_out = whose.leaves_out(marks).map(|(reason, _)| reason);
            let reason = left_out
                .or_else(|| keyframe.is_none().then_some(SkipReason::KeyframeNoFrame))
                .or_else(|| marks.occluded().then_some(SkipReason::Occluded))
                .or(keyframe_left_out);
            match reason {
                Some(reason) => selected.skips.push((stamp, reason)),
                None => runs::add(&mut selected.runs, first, label, frame),
            }
        }
        let runs = first..selected.runs.len();
        let Some(frame) = keyframe else {
            if kept.covers(segment.keyframe.stamp) {
                selected.skips.push((segment.keyframe.stamp, SkipReason::NoFrame));
            }
            continue;
        };
        if runs.is_empty() && !(kept.covers(segment.keyframe.stamp) && keyframe_left_out.is_none()) {
            continue;
        }
        let count = selected.runs[runs.clone()].iter().map(|r| r.count as usize).sum();
        selected.segments.push(SelectedSegment { keyframe: segment.at, frame, place: 0, runs, count });
    }
    (selected, at_a_frame)
}

/// Frames with a key frame or a label that takes part, ascending.
fn used_frames(points: &[SelectedPoint<'_>], frames: usize) -> Vec<usize> {
    let mut used = vec![false; frames];
    for point in points {
        for segment in &point.segments {
            used[segment.frame] = true;
        }
        for run in &point.runs {
            let from = run.frame as usize;
            used[from..from + run.count as usize].fill(true);
        }
    }
    (0..frames).filter(|f| used[*f]).collect()
}

/// Makes places among the selected frames of the camera's frames.
fn place(points: &mut [SelectedPoint<'_>], selected: &[usize], frames: usize) {
    let mut places = vec![0; frames];
    for (place, frame) in selected.iter().enumerate() {
        places[*frame] = index(place);
    }
    for point in points {
        let mut placed: Vec<Run> = Vec::with_capacity(point.runs.len());
        for segment in &mut point.segments {
            segment.place = places[segment.frame] as usize;
            let first = placed.len();
            for run in &point.runs[segment.runs.clone()] {
                let run = Run { frame: places[run.frame as usize], ..*run };
                runs::add_run(&mut placed, first, run);
            }
            segment.runs = first..placed.len();
        }
        point.runs = placed;
    }
}

fn check_inside(labels: &LabelSet, camera: &Camera) -> Result<(), EvaluateError> {
    for point in labels.points() {
        let (u, v) = (point.observations.u_px(), point.observations.v_px());
        let outside = u.iter().zip(v).position(|(u, v)| !camera.contains(Pixel::new(*u, *v)));
        if let Some(o) = outside.and_then(|i| point.observations.get(i)) {
            return Err(EvaluateError::LabelOutside {
                point: point.name.clone(),
                stamp: o.stamp,
                u_px: o.px.u,
                v_px: o.px.v,
                width: camera.width(),
                height: camera.height(),
                line: (o.line > 0).then_some(o.line),
            });
        }
    }
    Ok(())
}

fn no_label_at_a_frame(labels: &LabelSet, frames: (Stamp, Stamp)) -> EvaluateError {
    let stamps = || labels.points().iter().flat_map(|p| p.observations.stamps()).copied();
    let labels = (stamps().min().unwrap_or_default(), stamps().max().unwrap_or_default());
    EvaluateError::NoLabelAtFrame {
        labels,
        frames,
        suspicion: mixed_up(("labels", labels), ("frames", frames)),
    }
}
