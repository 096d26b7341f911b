//! Tracking and scoring of the labels of one pose stream with one depth source.

use rayon::prelude::*;

use super::select::{SelectedPoint, SelectedSegment};
use super::streams::PosesAtFrames;
use super::{DepthTable, Evaluation, SkipReason, pixel_key, position, skip};
use crate::frames::{BodyFromCamera, WorldFromCamera};
use crate::metrics::pixel::SquaredErrors;
use crate::result::{KeyframePart, PointName, Sample, Skip};
use crate::track::{lift, track};

/// What was scored of all points, in their order and in time.
#[derive(Default)]
pub(super) struct Scored {
    pub(super) errors: Vec<SquaredErrors>,
    pub(super) samples: Vec<Sample>,
    pub(super) skipped: Vec<Skip>,
    pub(super) keyframes: Vec<KeyframePart>,
}

#[derive(Default)]
struct ScoredPoint {
    errors: SquaredErrors,
    samples: Vec<Sample>,
    skipped: Vec<Skip>,
    keyframes: Vec<KeyframePart>,
}

/// Points that are scored before their samples are handed on: enough for all threads, few enough for the memory.
const POINTS_AT_A_TIME: usize = 32;

/// Takes the samples of one point.
pub(super) type TakePoint<'a> = &'a mut dyn FnMut(&[Sample]) -> std::io::Result<()>;

/// Scores all points. Their samples go to `sink` where there is one, in the order of the points.
///
/// # Errors
/// Those of the sink.
pub(super) fn score(
    evaluation: &Evaluation<'_>,
    cameras: &[Option<BodyFromCamera>],
    poses: &PosesAtFrames,
    depths: &DepthTable,
    mut sink: Option<TakePoint<'_>>,
) -> std::io::Result<Scored> {
    let keep_samples = evaluation.keep_samples || sink.is_some();
    let scorer = Scorer { evaluation, cameras, poses, depths, keep_samples };
    let mut all = Scored::default();
    for some in evaluation.selection.points.chunks(POINTS_AT_A_TIME) {
        let points: Vec<ScoredPoint> = some.par_iter().map(|point| scorer.point(point)).collect();
        for point in points {
            all.errors.push(point.errors);
            match &mut sink {
                Some(sink) => sink(&point.samples)?,
                None => all.samples.extend(point.samples),
            }
            all.skipped.extend(point.skipped);
            all.keyframes.extend(point.keyframes);
        }
    }
    Ok(all)
}

struct Scorer<'a> {
    evaluation: &'a Evaluation<'a>,
    cameras: &'a [Option<BodyFromCamera>],
    poses: &'a PosesAtFrames,
    depths: &'a DepthTable,
    keep_samples: bool,
}

impl Scorer<'_> {
    fn point(&self, point: &SelectedPoint<'_>) -> ScoredPoint {
        let name = PointName(point.name.clone());
        let mut scored = ScoredPoint::default();
        scored.skipped.extend(point.skips.iter().map(|(stamp, reason)| skip(&name, *stamp, *reason)));
        for segment in &point.segments {
            if let Err(reason) = self.segment(segment, &name, &mut scored) {
                let stamps = segment.samples.iter().map(|s| s.observation.stamp);
                scored.skipped.extend(stamps.map(|stamp| skip(&name, stamp, reason)));
            }
        }
        scored.skipped.sort_by_key(|s| s.timestamp_ns);
        scored
    }

    /// Scores a segment; the error is what its key frame lacks, and so why all of it is skipped.
    fn segment(
        &self,
        segment: &SelectedSegment<'_>,
        name: &PointName,
        scored: &mut ScoredPoint,
    ) -> Result<(), SkipReason> {
        let camera = self.evaluation.camera;
        let keyframe = segment.keyframe;
        let at_keyframe = self.world_from_camera(keyframe.frame).map_err(|reason| match reason {
            SkipReason::NoExtrinsics => reason,
            _ => SkipReason::KeyframeGap,
        })?;
        let depth = self.depths.get(&(keyframe.frame, pixel_key(keyframe.observation.px)));
        let depth = depth.ok_or(SkipReason::NoExtrinsics)?.map_err(SkipReason::NoDepth)?;
        let point_camera_m =
            lift(camera, keyframe.observation.px, depth.z_m).map_err(|_| SkipReason::OutsideModel)?;
        scored.keyframes.push(KeyframePart {
            point: name.clone(),
            timestamp_ns: keyframe.observation.stamp,
            depth_z_m: depth.z_m,
            on_edge: depth.on_edge,
        });
        for sample in &segment.samples {
            let label = sample.observation;
            let tracked = self.world_from_camera(sample.frame).and_then(|now| {
                track(camera, &at_keyframe, &now, &point_camera_m).map_err(SkipReason::of_projection)
            });
            match tracked {
                Ok(tracked_px) => {
                    let error_px = tracked_px.distance_px(label.px);
                    scored.errors.add(error_px);
                    if self.keep_samples {
                        scored.samples.push(Sample {
                            point: name.clone(),
                            timestamp_ns: label.stamp,
                            label_px: label.px,
                            tracked_px,
                            error_px,
                        });
                    }
                }
                Err(reason) => scored.skipped.push(skip(name, label.stamp, reason)),
            }
        }
        Ok(())
    }

    fn world_from_camera(&self, frame: usize) -> Result<WorldFromCamera, SkipReason> {
        let at = position(&self.evaluation.selection.frames, frame);
        let world_from_body = self.poses[at].map_err(SkipReason::of_frame)?;
        let body_from_camera = self.cameras[at].ok_or(SkipReason::NoExtrinsics)?;
        Ok(world_from_body * body_from_camera)
    }
}
