//! Which frames and labels take part, before any pose is looked at.

use std::sync::Arc;

use super::{EvaluateError, SkipReason};
use crate::camera::Camera;
use crate::label::{LabelSet, Observation, ObservationSource};
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
    fn leaves_out(self, observation: &Observation) -> Option<(SkipReason, SkipReason)> {
        match self {
            Self::Certain if observation.uncertain => {
                Some((SkipReason::Uncertain, SkipReason::KeyframeUncertain))
            }
            Self::Manual if observation.source != ObservationSource::Manual => {
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

/// A label and the index of its frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Matched<'a> {
    pub(super) observation: &'a Observation,
    pub(super) frame: usize,
}

/// A key frame and the labels that are scored against it.
#[derive(Debug)]
pub(super) struct SelectedSegment<'a> {
    pub(super) keyframe: Matched<'a>,
    pub(super) samples: Vec<Matched<'a>>,
}

/// A point with what is scored of it, and what is known not to be.
#[derive(Debug)]
pub(super) struct SelectedPoint<'a> {
    pub(super) name: Arc<str>,
    pub(super) segments: Vec<SelectedSegment<'a>>,
    pub(super) skips: Vec<(Stamp, SkipReason)>,
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
#[derive(Clone, Copy, Debug)]
pub struct SelectedKeyframe<'s> {
    /// Name of the point.
    pub point: &'s str,
    /// Its label at the key frame.
    pub keyframe: &'s Observation,
    /// The key frame.
    pub frame: usize,
    samples: &'s [Matched<'s>],
}

impl<'s> SelectedKeyframe<'s> {
    /// The labels that are scored, and their frames.
    pub fn samples(&self) -> impl Iterator<Item = (&'s Observation, usize)> + use<'s> {
        self.samples.iter().map(|s| (s.observation, s.frame))
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
        let mut selection = Self { points: Vec::new(), frames: Vec::new(), in_window: Vec::new() };
        let mut used = vec![false; frames.len()];
        let mut finder = FrameFinder { frames, next: 0 };
        let mut at_a_frame = false;
        for point in labels.points() {
            let mut selected =
                SelectedPoint { name: point.name.as_str().into(), segments: vec![], skips: vec![] };
            for observation in point.before_first_keyframe() {
                at_a_frame |= finder.find(observation.stamp).is_some();
                if kept.covers(observation.stamp) {
                    selected.skips.push((observation.stamp, SkipReason::BeforeFirstKeyframe));
                }
            }
            for segment in point.segments() {
                let keyframe = finder.find(segment.keyframe.stamp);
                at_a_frame |= keyframe.is_some();
                let keyframe_left_out =
                    window.observations.leaves_out(segment.keyframe).map(|(_, reason)| reason);
                let mut samples = Vec::new();
                for observation in segment.rest {
                    let frame = finder.find(observation.stamp);
                    at_a_frame |= frame.is_some();
                    if !kept.covers(observation.stamp) {
                        continue;
                    }
                    let Some(frame) = frame else {
                        selected.skips.push((observation.stamp, SkipReason::NoFrame));
                        continue;
                    };
                    if !kept.has(frame) {
                        continue;
                    }
                    let left_out = window.observations.leaves_out(observation).map(|(reason, _)| reason);
                    let reason = left_out
                        .or_else(|| keyframe.is_none().then_some(SkipReason::KeyframeNoFrame))
                        .or_else(|| observation.occluded.then_some(SkipReason::Occluded))
                        .or(keyframe_left_out);
                    match reason {
                        Some(reason) => selected.skips.push((observation.stamp, reason)),
                        None => samples.push(Matched { observation, frame }),
                    }
                }
                let Some(frame) = keyframe else {
                    if kept.covers(segment.keyframe.stamp) {
                        selected.skips.push((segment.keyframe.stamp, SkipReason::NoFrame));
                    }
                    continue;
                };
                if samples.is_empty() && !(kept.covers(segment.keyframe.stamp) && keyframe_left_out.is_none())
                {
                    continue;
                }
                used[frame] = true;
                samples.iter().for_each(|s| used[s.frame] = true);
                let keyframe = Matched { observation: segment.keyframe, frame };
                selected.segments.push(SelectedSegment { keyframe, samples });
            }
            selection.points.push(selected);
        }
        if !at_a_frame {
            return Err(no_label_at_a_frame(labels, (*first, *last)));
        }
        selection.frames = (0..frames.len()).filter(|f| used[*f]).collect();
        if selection.frames.is_empty() {
            let mut keyframes =
                labels.points().iter().flat_map(|p| &p.observations).filter(|o| o.keyframe).peekable();
            if keyframes.peek().is_some() && !keyframes.any(|o| window.observations.leaves_out(o).is_none()) {
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
        selection.in_window = selection.frames.iter().copied().filter(|f| kept.covers(frames[*f])).collect();
        Ok(selection)
    }

    /// The earliest key frame that takes part.
    pub fn first_keyframe(&self) -> Option<Stamp> {
        self.points.iter().flat_map(|p| &p.segments).map(|s| s.keyframe.observation.stamp).min()
    }

    /// The first and last frame that takes part.
    pub fn stamp_range(&self, frames: &[Stamp]) -> Option<(Stamp, Stamp)> {
        Some((frames[*self.frames.first()?], frames[*self.frames.last()?]))
    }

    /// The key frames that take part, by point and in time.
    pub fn keyframes(&self) -> impl Iterator<Item = SelectedKeyframe<'_>> {
        self.points.iter().flat_map(|p| {
            p.segments.iter().map(|s| SelectedKeyframe {
                point: &p.name,
                keyframe: s.keyframe.observation,
                frame: s.keyframe.frame,
                samples: &s.samples,
            })
        })
    }

    /// Number of points with a name, scored or not.
    pub fn point_count(&self) -> usize {
        self.points.len()
    }
}

fn check_inside(labels: &LabelSet, camera: &Camera) -> Result<(), EvaluateError> {
    for point in labels.points() {
        if let Some(o) = point.observations.iter().find(|o| !camera.contains(o.px)) {
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
    let stamps = || labels.points().iter().flat_map(|p| &p.observations).map(|o| o.stamp);
    let labels = (stamps().min().unwrap_or_default(), stamps().max().unwrap_or_default());
    EvaluateError::NoLabelAtFrame {
        labels,
        frames,
        suspicion: mixed_up(("labels", labels), ("frames", frames)),
    }
}

/// Finds frames by their exact stamp. Labels mostly go from one frame to the next, so that is looked at first.
struct FrameFinder<'a> {
    frames: &'a [Stamp],
    next: usize,
}

impl FrameFinder<'_> {
    fn find(&mut self, stamp: Stamp) -> Option<usize> {
        let frame = match self.frames.get(self.next) {
            Some(next) if *next == stamp => self.next,
            _ => self.frames.binary_search(&stamp).ok()?,
        };
        self.next = frame + 1;
        Some(frame)
    }
}

/// The frames of the window.
struct KeptFrames {
    first: Stamp,
    last: Stamp,
    /// With a rate, the frames nearest to its ticks; without, all.
    ticked: Option<Vec<bool>>,
}

impl KeptFrames {
    fn new(frames: &[Stamp], window: &Window) -> Self {
        let first = frames[0] + window.start;
        let last = window.duration.map_or(Stamp::MAX, |d| first + d);
        let ticked = window.fps.map(|fps| {
            let period_ns = 1e9 / fps;
            let end = last.min(frames[frames.len() - 1]);
            let mut ticked = vec![false; frames.len()];
            let mut next_frame = frames.partition_point(|s| *s < first);
            // Ticks between two frames all choose one of the two, so that walking frames, not ticks, bounds the work.
            while next_frame < frames.len() {
                let before = next_frame.checked_sub(1).filter(|i| frames[*i] >= first);
                let stamp = frames[next_frame];
                let from_ns = before.map_or(0, |i| frames[i].since(first).as_nanos()) as f64;
                let to_ns = stamp.since(first).as_nanos() as f64;
                let middle = before.map_or(f64::NEG_INFINITY, |_| 0.5 * (from_ns + to_ns));
                let limit_ns = end.since(first).as_nanos() as f64;
                let first_tick = (from_ns / period_ns).ceil();
                let last_tick = (to_ns.min(limit_ns) / period_ns).floor();
                if first_tick <= last_tick {
                    // A tick in the middle chooses the earlier frame.
                    if let Some(before) = before.filter(|_| first_tick * period_ns <= middle) {
                        ticked[before] = true;
                    }
                    if last_tick * period_ns > middle {
                        ticked[next_frame] = true;
                    }
                }
                next_frame += 1;
            }
            ticked
        });
        Self { first, last, ticked }
    }

    fn covers(&self, stamp: Stamp) -> bool {
        stamp >= self.first && stamp <= self.last
    }

    fn has(&self, frame: usize) -> bool {
        self.ticked.as_ref().is_none_or(|t| t[frame])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(millis: &[i64], fps: f64, duration_ms: Option<i64>) -> Vec<usize> {
        let frames: Vec<Stamp> = millis.iter().map(|m| Stamp::from_nanos(m * 1_000_000)).collect();
        let window =
            Window { fps: Some(fps), duration: duration_ms.map(Span::from_millis), ..Window::default() };
        let ticked = KeptFrames::new(&frames, &window).ticked.unwrap();
        (0..frames.len()).filter(|i| ticked[*i]).collect()
    }

    #[test]
    fn each_tick_keeps_its_nearest_frame() {
        let twenty_hz: Vec<i64> = (0..21).map(|i| 1000 + 50 * i).collect();
        assert_eq!(kept(&twenty_hz, 10.0, None), (0..21).step_by(2).collect::<Vec<_>>());
        assert_eq!(kept(&twenty_hz, 10.0, Some(300)), [0, 2, 4, 6]);
        // Ticks at 0, 100, 200 ...: 130 is nearest to 100, 180 to 200, and 500 to those from 340 on.
        assert_eq!(kept(&[0, 60, 130, 180, 500], 10.0, None), [0, 2, 3, 4]);
        assert_eq!(kept(&[0], 10.0, None), [0]);
        let window = Window { start: Span::from_nanos(90), fps: None, ..Window::default() };
        assert_eq!(window.frames(&[0, 100, 200].map(Stamp::from_nanos)), [1, 2]);
        assert_eq!(Window::default().frames(&[]), [0_usize; 0]);
        // Faster than the frames: all are kept.
        assert_eq!(kept(&[0, 10, 20, 33], 1000.0, None), [0, 1, 2, 3]);
    }
}
