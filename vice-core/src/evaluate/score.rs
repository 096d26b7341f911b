//! Tracking and scoring of the labels of one pose stream with one depth source.

use crate::parallel::*;
use nalgebra::Point3;

use super::select::{SelectedPoint, SelectedSegment};
use super::streams::PosesAtFrames;
use super::{DepthTable, Evaluation, SkipReason, pixel_key, position, skip};
use crate::camera::Pixel;
use crate::frames::{self, BodyFromCamera, Rigid, WorldFromBody, WorldFromCamera};
use crate::metrics::held::{Carried, CarriedSegment};
use crate::metrics::pixel::SquaredErrors;
use crate::result::{KeyframePart, PointName, Sample, Skip};
use crate::track::lift;
use crate::trajectory::NoPose;

/// What was scored of all points, in their order and in time.
#[derive(Default)]
pub(super) struct Scored {
    pub(super) errors: Vec<SquaredErrors>,
    pub(super) samples: Vec<Sample>,
    pub(super) skipped: Vec<Skip>,
    pub(super) keyframes: Vec<KeyframePart>,
    /// What was carried of each segment with a sample, where that is asked for.
    pub(super) carried: Vec<CarriedSegment>,
}

#[derive(Default)]
struct ScoredPoint {
    carried: Vec<CarriedSegment>,
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
pub(super) fn score(scorer: &Scorer<'_>, mut sink: Option<TakePoint<'_>>) -> std::io::Result<Scored> {
    let mut all = Scored::default();
    for (chunk, some) in scorer.evaluation.selection.points.chunks(POINTS_AT_A_TIME).enumerate() {
        let first = chunk * POINTS_AT_A_TIME;
        let one = |(place, point): (usize, &SelectedPoint<'_>)| scorer.point(first + place, point);
        let points: Vec<ScoredPoint> = some.par_iter().enumerate().map(one).collect();
        for point in points {
            all.errors.push(point.errors);
            match &mut sink {
                Some(sink) => sink(&point.samples)?,
                None => all.samples.extend(point.samples),
            }
            all.skipped.extend(point.skipped);
            all.keyframes.extend(point.keyframes);
            all.carried.extend(point.carried);
        }
    }
    Ok(all)
}

/// What one stream with one depth source is scored with.
pub(super) struct Scorer<'a> {
    pub(super) evaluation: &'a Evaluation<'a>,
    /// Where the camera is at each selected frame.
    pub(super) placed: Vec<Result<WorldFromCamera, SkipReason>>,
    pub(super) depths: &'a DepthTable,
    /// Whether samples are listed, or handed on.
    pub(super) keep_samples: bool,
    /// Whether residuals are kept by segment, in a few bytes each.
    pub(super) carries: bool,
}

impl<'a> Scorer<'a> {
    /// Lists no samples and keeps no residuals, unless told otherwise.
    pub(super) fn new(
        evaluation: &'a Evaluation<'a>,
        cameras: &[Option<BodyFromCamera>],
        poses: &PosesAtFrames,
        depths: &'a DepthTable,
    ) -> Self {
        let place = |(pose, camera): (&Result<WorldFromBody, NoPose>, &Option<BodyFromCamera>)| {
            let world_from_body = pose.map_err(SkipReason::of_frame)?;
            Ok(world_from_body * camera.ok_or(SkipReason::NoExtrinsics)?)
        };
        let placed = poses.iter().zip(cameras).map(place).collect();
        Self { evaluation, placed, depths, keep_samples: false, carries: false }
    }

    fn point(&self, place: usize, point: &SelectedPoint<'_>) -> ScoredPoint {
        let name = PointName(point.name.clone());
        let mut scored = ScoredPoint::default();
        scored.skipped.extend(point.skips.iter().map(|(stamp, reason)| skip(&name, *stamp, *reason)));
        for segment in &point.segments {
            if let Err(reason) = self.segment(segment, (place, &name), &mut scored) {
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
        (place, name): (usize, &PointName),
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
            label_px: Some(keyframe.observation.px),
            depth_z_m: depth.z_m,
            point_world_m: Some(at_keyframe.transform_point(&point_camera_m).coords.into()),
            on_edge: depth.on_edge,
        });
        let mut at = self.at(keyframe.frame);
        let mut carried = CarriedSegment { point: place, keyframe: frame_u32(at), samples: Vec::new() };
        for sample in &segment.samples {
            let label = sample.observation;
            at = self.at_or_after(at, sample.frame);
            let point_m = self.placed[at].map(|now| {
                let now_from_keyframe: Rigid<frames::Camera, frames::Camera> = now.inverse() * at_keyframe;
                now_from_keyframe.transform_point(&point_camera_m)
            });
            let tracked = point_m.and_then(|point_m| {
                let tracked_px = camera.project(&point_m).map_err(SkipReason::of_projection)?;
                Ok((point_m, tracked_px))
            });
            match tracked {
                Ok((point_m, tracked_px)) => {
                    let error_px = tracked_px.distance_px(label.px);
                    scored.errors.add(error_px);
                    if self.carries {
                        carried.samples.push(self.carried(label.px, at, &point_m, tracked_px));
                    }
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
        if !carried.samples.is_empty() {
            scored.carried.push(carried);
        }
        Ok(())
    }

    /// The residual of a sample, in pixels, as an angle, and at its depth. `point_m` is the carried point in the camera
    /// frame of the label.
    fn carried(&self, label: Pixel, at: usize, point_m: &Point3<f64>, tracked_px: Pixel) -> Carried {
        let mut carried = Carried {
            frame: frame_u32(at),
            residual_px: [tracked_px.u - label.u, tracked_px.v - label.v],
            angle_rad: f32::NAN,
            offset_m: f32::NAN,
        };
        if let Ok(ray) = self.evaluation.camera.unproject(label) {
            let point_m = point_m.coords;
            carried.angle_rad = point_m.cross(&ray).norm().atan2(point_m.dot(&ray)) as f32;
            carried.offset_m = (point_m - point_m.z * ray).norm() as f32;
        }
        carried
    }

    /// Place of a frame among the selected ones.
    fn at(&self, frame: usize) -> usize {
        position(&self.evaluation.selection.frames, frame)
    }

    /// The same from the place of a frame that is most often the one before.
    fn at_or_after(&self, before: usize, frame: usize) -> usize {
        let next = before + 1;
        if self.evaluation.selection.frames.get(next) == Some(&frame) { next } else { self.at(frame) }
    }

    pub(super) fn world_from_camera(&self, frame: usize) -> Result<WorldFromCamera, SkipReason> {
        self.placed[self.at(frame)]
    }
}

/// A place as residuals keep it.
fn frame_u32(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}
