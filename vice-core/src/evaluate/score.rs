//! Tracking and scoring of the labels of one pose stream with one depth source.

use crate::parallel::*;
use nalgebra::Point3;

use super::carry::Start;
use super::columns::{Columns, Scratch, median_residual};
use super::runs::index;
use super::select::{SelectedPoint, SelectedSegment};
use super::streams::PosesAtFrames;
use super::triangulated::part_of;
use super::windows::Windows;
use super::{DepthTable, Evaluation, SkipReason, skip};
use crate::camera::Pixel;
use crate::frames::{BodyFromCamera, WorldFromBody, WorldFromCamera};
use crate::metrics::by_age::SegmentErrors;
use crate::metrics::pixel::SquaredErrors;
use crate::result::{KeyframePart, PointName, Sample, Skip};
use crate::track::{CameraPath, lift, track};
use crate::trajectory::NoPose;

/// What was scored of all points, in their order and in time.
#[derive(Default)]
pub(super) struct Scored {
    pub(super) errors: Vec<SquaredErrors>,
    pub(super) samples: Vec<Sample>,
    pub(super) skipped: Vec<Skip>,
    pub(super) keyframes: Vec<KeyframePart>,
    /// The segments with a sample, where they are asked for.
    pub(super) segments: Vec<ScoredSegment>,
    /// By point: the numbers of its samples.
    pub(super) columns: Vec<Columns>,
}

/// A segment with samples.
#[derive(Clone, Debug)]
pub(super) struct ScoredSegment {
    /// Of which point, and which of its segments.
    pub(super) point: usize,
    pub(super) segment: usize,
    /// Place of the key frame.
    pub(super) keyframe: u32,
    /// Its part of the point's columns.
    pub(super) first: usize,
    pub(super) count: usize,
    /// Which of the segment's labels the samples are, where it is not all of them.
    pub(super) which: Option<Box<[u32]>>,
    /// Length of the median of the first residuals, px.
    pub(super) start_px: f64,
    /// Sums with nothing set aside.
    pub(super) errors: SegmentErrors,
}

#[derive(Default)]
struct ScoredPoint {
    errors: SquaredErrors,
    samples: Vec<Sample>,
    skipped: Vec<Skip>,
    keyframes: Vec<KeyframePart>,
    segments: Vec<ScoredSegment>,
    columns: Columns,
}

/// Points that are scored before their samples are handed on: enough for all threads, few enough for the memory.
const POINTS_AT_A_TIME: usize = 32;

/// Takes the samples of one point.
pub(super) type TakePoint<'a> = &'a mut dyn FnMut(&[Sample]) -> std::io::Result<()>;

/// Scores all points. Their samples go to `sink` where there is one, in the order of the points. `room` are columns of
/// another stream that are no longer needed: memory that need not be asked for again.
///
/// # Errors
/// Those of the sink.
pub(super) fn score(
    scorer: &Scorer<'_>,
    mut sink: Option<TakePoint<'_>>,
    room: &mut Vec<Columns>,
) -> std::io::Result<Scored> {
    let mut all = Scored::default();
    for (chunk, some) in scorer.evaluation.selection.points.chunks(POINTS_AT_A_TIME).enumerate() {
        let first = chunk * POINTS_AT_A_TIME;
        let one = |(place, (point, columns)): (usize, (&SelectedPoint<'_>, Columns))| {
            scorer.point(first + place, point, columns)
        };
        let columns: Vec<Columns> = some.iter().map(|_| room.pop().unwrap_or_default()).collect();
        let points: Vec<ScoredPoint> = some.par_iter().zip(columns).enumerate().map(one).collect();
        for point in points {
            all.errors.push(point.errors);
            match &mut sink {
                Some(sink) => sink(&point.samples)?,
                None => all.samples.extend(point.samples),
            }
            all.skipped.extend(point.skipped);
            all.keyframes.extend(point.keyframes);
            all.segments.extend(point.segments);
            all.columns.push(point.columns);
        }
    }
    Ok(all)
}

/// What one stream with one depth source is scored with.
pub(super) struct Scorer<'a> {
    pub(super) evaluation: &'a Evaluation<'a>,
    /// Where the camera is at each selected frame.
    pub(super) placed: Vec<Result<WorldFromCamera, SkipReason>>,
    /// The same for many at once.
    pub(super) path: CameraPath,
    pub(super) depths: &'a DepthTable,
    /// Whether samples are listed, or handed on.
    pub(super) keep_samples: bool,
    /// Parts of segments by age and motion, where residuals are kept by segment.
    pub(super) windows: Option<&'a Windows<'a>>,
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
        let placed: Vec<_> = poses.iter().zip(cameras).map(place).collect();
        let path = CameraPath::new(placed.iter().map(|p: &Result<_, _>| p.ok()));
        Self { evaluation, placed, path, depths, keep_samples: false, windows: None }
    }

    fn point(&self, place: usize, point: &SelectedPoint<'_>, columns: Columns) -> ScoredPoint {
        let name = PointName(point.name.clone());
        let mut scored = ScoredPoint { columns, ..ScoredPoint::default() };
        let mut scratch = Scratch::default();
        if self.windows.is_some() {
            let count = point.segments.iter().map(|s| s.count).sum();
            scored.columns.empty(count);
        }
        scored.skipped.extend(point.skips.iter().map(|(stamp, reason)| skip(&name, *stamp, *reason)));
        for segment in 0..point.segments.len() {
            let done = self.segment(point, (place, segment, &name), &mut scored, &mut scratch);
            if let Err(reason) = done {
                let stamps = point.samples(&point.segments[segment]).map(|(label, _)| point.stamp(label));
                scored.skipped.extend(stamps.map(|stamp| skip(&name, stamp, reason)));
            }
        }
        scored.skipped.sort_by_key(|s| s.timestamp_ns);
        scored
    }

    /// The point of a segment in the camera of its key frame, metres, and where that camera is; what is lacking is why all
    /// of it is skipped.
    fn lifted(&self, (place, number): (usize, usize)) -> Result<Lifted, SkipReason> {
        let point = &self.evaluation.selection.points[place];
        let segment = &point.segments[number];
        let px = point.px(segment.keyframe);
        let at_keyframe = self.placed[segment.place].map_err(|reason| match reason {
            SkipReason::NoExtrinsics => reason,
            _ => SkipReason::KeyframeGap,
        })?;
        let depth = self.depths.get(place, number);
        let depth = depth.ok_or(SkipReason::NoExtrinsics)?.map_err(SkipReason::NoDepth)?;
        let point_camera_m =
            lift(self.evaluation.camera, px, depth.z_m).map_err(|_| SkipReason::OutsideModel)?;
        Ok(Lifted { at_keyframe, point_camera_m, z_m: depth.z_m, on_edge: depth.on_edge })
    }

    /// Scores a segment; the error is what its key frame lacks, and so why all of it is skipped.
    fn segment(
        &self,
        point: &SelectedPoint<'_>,
        (place, number, name): (usize, usize, &PointName),
        scored: &mut ScoredPoint,
        scratch: &mut Scratch,
    ) -> Result<(), SkipReason> {
        let segment = &point.segments[number];
        let lifted = self.lifted((place, number))?;
        scored.keyframes.push(KeyframePart {
            point: name.clone(),
            timestamp_ns: point.stamp(segment.keyframe),
            label_px: Some(point.px(segment.keyframe)),
            depth_z_m: lifted.z_m,
            point_world_m: Some(lifted.at_keyframe.transform_point(&lifted.point_camera_m).coords.into()),
            on_edge: lifted.on_edge,
            triangulated: self.depths.triangulation(place, number).map(part_of),
        });
        self.carry(point, segment, &lifted, scratch);
        let Scratch { carried, .. } = &*scratch;
        let mut which = None;
        if !carried.valid.iter().all(|valid| *valid) {
            let scored_ones = (0..carried.valid.len()).filter(|i| carried.valid[*i]);
            which = Some(scored_ones.map(index).collect::<Box<[u32]>>());
            for ((label, now), valid) in point.samples(segment).zip(&carried.valid) {
                if !valid {
                    let reason = self.no_pixel(&lifted, now);
                    scored.skipped.push(skip(name, point.stamp(label), reason));
                }
            }
        }
        if self.keep_samples {
            for (i, (label, _)) in point.samples(segment).enumerate().filter(|(i, _)| carried.valid[*i]) {
                let label_px = point.px(label);
                let tracked_px = Pixel::new(carried.tracked_px[0][i], carried.tracked_px[1][i]);
                scored.samples.push(Sample {
                    point: name.clone(),
                    timestamp_ns: point.stamp(label),
                    label_px,
                    tracked_px,
                    error_px: tracked_px.distance_px(label_px),
                });
            }
        }
        scratch.compare(which.as_deref(), &mut scored.errors);
        let count = scratch.places.len();
        let Some(windows) = self.windows.filter(|_| count > 0) else { return Ok(()) };
        let first = scored.columns.squares_px2.len();
        scratch.keep(&mut scored.columns);
        let start = median_residual(&scratch.residuals, 0..count.min(3));
        scored.segments.push(ScoredSegment {
            point: place,
            segment: number,
            keyframe: index(segment.place),
            first,
            count,
            which,
            start_px: (start[0] * start[0] + start[1] * start[1]).sqrt(),
            errors: scratch.errors(windows, segment.place, &[]),
        });
        Ok(())
    }

    /// Carries the point of a segment to all its labels.
    fn carry(
        &self,
        point: &SelectedPoint<'_>,
        segment: &SelectedSegment,
        lifted: &Lifted,
        scratch: &mut Scratch,
    ) {
        let Lifted { at_keyframe, point_camera_m, .. } = lifted;
        let start = Start { camera: self.evaluation.camera, at_keyframe, point_camera_m: *point_camera_m };
        scratch.carry(&start, &self.path, point, segment);
    }

    /// Why the point has no pixel at a place.
    fn no_pixel(&self, lifted: &Lifted, place: usize) -> SkipReason {
        let now = match &self.placed[place] {
            Ok(now) => now,
            Err(reason) => return *reason,
        };
        match track(self.evaluation.camera, &lifted.at_keyframe, now, &lifted.point_camera_m) {
            Err(error) => SkipReason::of_projection(error),
            Ok(_) => SkipReason::OutsideModel,
        }
    }

    /// The errors of a segment without some of its samples.
    pub(super) fn errors_without(
        &self,
        segment: &ScoredSegment,
        windows: &Windows<'_>,
        without: &[usize],
    ) -> SegmentErrors {
        let point = &self.evaluation.selection.points[segment.point];
        let selected = &point.segments[segment.segment];
        let Ok(lifted) = self.lifted((segment.point, segment.segment)) else {
            return SegmentErrors::default();
        };
        let mut scratch = Scratch::default();
        self.carry(point, selected, &lifted, &mut scratch);
        scratch.compare(segment.which.as_deref(), &mut SquaredErrors::default());
        scratch.errors(windows, selected.place, without)
    }

    /// Where some samples of a segment are carried minus where their labels are, px.
    pub(super) fn residuals(
        &self,
        segment: &ScoredSegment,
        samples: std::ops::Range<usize>,
    ) -> Vec<[f64; 2]> {
        let point = &self.evaluation.selection.points[segment.point];
        let selected = &point.segments[segment.segment];
        let Ok(Lifted { at_keyframe, point_camera_m, .. }) = self.lifted((segment.point, segment.segment))
        else {
            return Vec::new();
        };
        let residual = |(label, place): (usize, usize)| {
            let now = self.placed[place].as_ref().ok()?;
            let tracked = track(self.evaluation.camera, &at_keyframe, now, &point_camera_m).ok()?;
            let label = point.px(label);
            Some([tracked.u - label.u, tracked.v - label.v])
        };
        let labels: Vec<(usize, usize)> = match &segment.which {
            None => point.samples(selected).skip(samples.start).take(samples.len()).collect(),
            Some(which) => {
                let all: Vec<(usize, usize)> = point.samples(selected).collect();
                which[samples].iter().map(|i| all[*i as usize]).collect()
            }
        };
        labels.into_iter().filter_map(residual).collect()
    }

    /// Places of the samples of a segment.
    pub(super) fn places(&self, segment: &ScoredSegment) -> Vec<u32> {
        let point = &self.evaluation.selection.points[segment.point];
        let all = point.samples(&point.segments[segment.segment]).map(|(_, place)| index(place));
        match &segment.which {
            None => all.collect(),
            Some(which) => {
                let all: Vec<u32> = all.collect();
                which.iter().map(|i| all[*i as usize]).collect()
            }
        }
    }
}

/// A point of a key frame.
struct Lifted {
    at_keyframe: WorldFromCamera,
    point_camera_m: Point3<f64>,
    z_m: f64,
    on_edge: bool,
}
