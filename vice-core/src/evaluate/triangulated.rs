//! Depth source `triangulated`: the depth of a key point from half of its own later labels and the stream under test.
//!
//! It is for recordings of which no depth is known at all. Each stream has depths of its own, and what gave them is not
//! scored. See [`mod@crate::triangulate`] for what such depths cannot show.

use std::ops::Range;

use super::Evaluation;
use super::depths::DepthTable;
use super::runs::{self, Run};
use super::select::{SelectedPoint, SelectedSegment, Selection};
use super::streams::PosesAtFrames;
use crate::camera::Pixel;
use crate::dataset::Floor;
use crate::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use crate::error::{DataError, DataResult, ErrorKind};
use crate::frames::{BodyFromCamera, WorldFromCamera};
use crate::parallel::*;
use crate::result::{CANNOT_SHOW, RULE, TriangulatedPart, TriangulationPart};
use crate::statistics::median;
use crate::triangulate::{TriangulatedDepth as Found, triangulate};

/// The depth source `triangulated`. [`evaluate`](super::evaluate()) works the depths out; a key frame alone has none.
#[derive(Clone, Copy, Debug, Default)]
pub struct TriangulatedDepth;

impl DepthSource for TriangulatedDepth {
    fn name(&self) -> &'static str {
        "triangulated"
    }

    fn depths(&self, _: &Keyframe<'_>, _: &[Pixel]) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        Err(DataError::of_kind(
            ErrorKind::Unsupported,
            "the depth source triangulated needs labels and a pose stream: a frame alone has no such depth",
        )
        .hint("`vice evaluate --depth triangulated` works it out for each stream"))
    }

    fn needs_world(&self, _: &Floor) -> bool {
        false
    }

    fn needs_track(&self) -> bool {
        true
    }
}

/// The labels in two halves: those that are scored, and those that give depth.
pub(super) struct Split<'a> {
    /// What is scored.
    pub(super) scored: Selection<'a>,
    /// By point: what gives depth.
    for_depth: Vec<ForDepth>,
}

/// What gives depth at a point.
#[derive(Default)]
struct ForDepth {
    /// By segment: its part of the runs.
    segments: Vec<Range<usize>>,
    runs: Vec<Run>,
}

impl<'a> Split<'a> {
    /// Every second label of a segment is scored: [`RULE`].
    pub(super) fn of(selection: &Selection<'a>) -> Self {
        let (points, for_depth) = selection.points.iter().map(split).unzip();
        let (frames, in_window) = (selection.frames.clone(), selection.in_window.clone());
        Self { scored: Selection { points, frames, in_window }, for_depth }
    }

    /// The depths by the poses of a stream at the selected frames.
    pub(super) fn depths(
        &self,
        evaluation: &Evaluation<'_>,
        cameras: &[Option<BodyFromCamera>],
        poses: &PosesAtFrames,
    ) -> DepthTable {
        let placed: Vec<Option<WorldFromCamera>> =
            poses.iter().zip(cameras).map(|(pose, camera)| Some(pose.ok()? * (*camera)?)).collect();
        let of_point =
            |(point, lent): (&SelectedPoint<'_>, &ForDepth)| -> Vec<Option<Result<Found, DepthMiss>>> {
                let of_segment = |(segment, runs): (&SelectedSegment, &Range<usize>)| {
                    let at_keyframe = placed[segment.place]?;
                    let labels = lent.runs[runs.clone()].iter().flat_map(|run| run.pairs());
                    let views = labels.filter_map(|(label, place)| Some((placed[place]?, point.px(label))));
                    Some(triangulate(evaluation.camera, &at_keyframe, point.px(segment.keyframe), views))
                };
                point.segments.iter().zip(&lent.segments).map(of_segment).collect()
            };
        let found: Vec<_> = self.scored.points.par_iter().zip(&self.for_depth).map(of_point).collect();
        DepthTable::triangulated(found)
    }

    /// How the depths of a stream came about.
    pub(super) fn part(&self, depths: &DepthTable) -> TriangulationPart {
        let labels =
            self.for_depth.iter().flat_map(|point| &point.runs).map(|run| u64::from(run.count)).sum();
        let found: Vec<&Found> = depths.found().filter_map(|found| found.as_ref().ok()).collect();
        let mut shares: Vec<f64> = found.iter().map(|f| f.sigma_m / f.z_m).collect();
        let mut angles: Vec<f64> = found.iter().map(|f| f.parallax_rad.to_degrees()).collect();
        TriangulationPart {
            rule: RULE.to_string(),
            labels_for_depth: labels,
            keyframes: found.len() as u64,
            keyframes_without_depth: depths.found().filter(|found| found.is_err()).count() as u64,
            median_sigma_share: median(&mut shares),
            median_parallax_deg: median(&mut angles),
            cannot_show: CANNOT_SHOW.to_string(),
        }
    }
}

/// What a document says of a depth.
pub(super) fn part_of(found: &Found) -> TriangulatedPart {
    TriangulatedPart {
        depth_sigma_m: found.sigma_m,
        parallax_deg: found.parallax_rad.to_degrees(),
        labels: found.views as u64,
        left_px: found.left_px,
    }
}

fn split<'a>(point: &SelectedPoint<'a>) -> (SelectedPoint<'a>, ForDepth) {
    let mut scored = SelectedPoint {
        name: point.name.clone(),
        labels: point.labels,
        segments: Vec::with_capacity(point.segments.len()),
        runs: Vec::new(),
        skips: point.skips.clone(),
    };
    let mut for_depth = ForDepth::default();
    for segment in &point.segments {
        let (first, first_for_depth) = (scored.runs.len(), for_depth.runs.len());
        for (i, (label, place)) in point.samples(segment).enumerate() {
            match i % 2 {
                0 => runs::add(&mut for_depth.runs, first_for_depth, label, place),
                _ => runs::add(&mut scored.runs, first, label, place),
            }
        }
        let runs = first..scored.runs.len();
        let count = scored.runs[runs.clone()].iter().map(|r| r.count as usize).sum();
        scored.segments.push(SelectedSegment { runs, count, ..segment.clone() });
        for_depth.segments.push(first_for_depth..for_depth.runs.len());
    }
    (scored, for_depth)
}
