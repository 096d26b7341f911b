//! Depths at the key frames, asked of each source once: for all streams together, or for each by its own place.

use crate::parallel::*;

use super::streams::PosesAtFrames;
use super::{EvaluateError, Evaluation};
use crate::camera::Pixel;
use crate::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use crate::error::{DataResult, one_line};
use crate::frames::BodyFromCamera;
use crate::suspicion::Suspicion;
use crate::triangulate::TriangulatedDepth;

/// Depths at the key frames of one source.
pub(super) struct DepthTable {
    /// By point and segment; `None` where it was not asked.
    by_segment: Vec<Vec<Option<Depth>>>,
    /// The same with what is known of triangulated depths; empty for all other sources.
    triangulated: Vec<Vec<Option<Triangulated>>>,
}

type Triangulated = Result<TriangulatedDepth, DepthMiss>;

type Depth = Result<DepthSample, DepthMiss>;

impl DepthTable {
    /// Of a point's segment; `None` where it was not asked.
    pub(super) fn get(&self, point: usize, segment: usize) -> Option<Depth> {
        *self.by_segment.get(point)?.get(segment)?
    }

    /// Depths that labels gave.
    pub(super) fn triangulated(triangulated: Vec<Vec<Option<Triangulated>>>) -> Self {
        let depth = |found: &Option<Triangulated>| found.map(|found| found.map(|f| DepthSample::new(f.z_m)));
        let by_segment = triangulated.iter().map(|point| point.iter().map(depth).collect()).collect();
        Self { by_segment, triangulated }
    }

    /// What is known of a triangulated depth.
    pub(super) fn triangulation(&self, point: usize, segment: usize) -> Option<&TriangulatedDepth> {
        self.triangulated.get(point)?.get(segment)?.as_ref()?.as_ref().ok()
    }

    /// All that were triangulated, or why they have no depth.
    pub(super) fn found(&self) -> impl Iterator<Item = &Triangulated> {
        self.triangulated.iter().flatten().flatten()
    }
}

/// A pixel as a key: two labels at the same place are one question.
type PixelKey = (u64, u64);

fn pixel_key(px: Pixel) -> PixelKey {
    (px.u.to_bits(), px.v.to_bits())
}

/// What a source says for each stream.
pub(super) struct SourceDepths<'a> {
    pub(super) source: &'a dyn DepthSource,
    /// One for all streams, or one for each.
    tables: Vec<DepthTable>,
}

impl<'a> SourceDepths<'a> {
    /// Asks with the camera placed by each of `placing`, once where the source does not ask for its place.
    pub(super) fn ask(
        evaluation: &Evaluation<'_>,
        source: &'a dyn DepthSource,
        cameras: &[Option<BodyFromCamera>],
        placing: &[&PosesAtFrames],
    ) -> Result<Self, EvaluateError> {
        let alike = match evaluation.selection.first_keyframe() {
            Some(stamp) => !source.needs_world(&evaluation.rig.floor(stamp)?),
            None => true,
        };
        let asked = if alike { &placing[..placing.len().min(1)] } else { placing };
        let tables: Result<_, _> =
            asked.iter().map(|poses| keyframe_depths(evaluation, source, cameras, poses)).collect();
        Ok(Self { source, tables: tables? })
    }

    /// Triangulated by each stream for itself.
    pub(super) const fn triangulated(source: &'a dyn DepthSource, tables: Vec<DepthTable>) -> Self {
        Self { source, tables }
    }

    /// For a stream, by its index.
    pub(super) fn of(&self, stream: usize) -> &DepthTable {
        &self.tables[stream.min(self.tables.len() - 1)]
    }
}

/// A source that is only compared with and cannot answer stops nothing.
pub(super) fn check_failed(source: &dyn DepthSource, error: &EvaluateError) -> Suspicion {
    Suspicion::new("depth-not-compared", source.name(), "depths cannot be compared with this source")
        .evidence(one_line(error))
        .advice("leave it out with `depth-check` off")
}

/// Asks one source for the depths of all key-frame pixels, key frames in parallel.
pub(super) fn keyframe_depths(
    evaluation: &Evaluation<'_>,
    source: &dyn DepthSource,
    cameras: &[Option<BodyFromCamera>],
    anchor: &PosesAtFrames,
) -> Result<DepthTable, EvaluateError> {
    let points = &evaluation.selection.points;
    let key = |point: usize, segment: usize| {
        let (of, segment_of) = (&points[point], &points[point].segments[segment]);
        (segment_of.frame, pixel_key(of.px(segment_of.keyframe)), point, segment)
    };
    let mut keys: Vec<(usize, PixelKey, usize, usize)> = points
        .iter()
        .enumerate()
        .flat_map(|(point, of)| (0..of.segments.len()).map(move |segment| (point, segment)))
        .map(|(point, segment)| key(point, segment))
        .collect();
    keys.sort_unstable();
    let asked: Vec<&[(usize, PixelKey, usize, usize)]> = keys.chunk_by(|a, b| a.0 == b.0).collect();
    let answers: Vec<DataResult<Vec<(usize, usize, Depth)>>> = asked
        .par_iter()
        .map(|keys| {
            let (frame, _, point, segment) = keys[0];
            let at = points[point].segments[segment].place;
            let Some(body_from_camera) = cameras[at] else { return Ok(vec![]) };
            let stamp = evaluation.frames[frame];
            let keyframe = Keyframe {
                stamp,
                frame,
                camera: evaluation.camera,
                body_from_camera,
                world_from_camera: anchor[at].ok().map(|pose| pose * body_from_camera),
                floor: evaluation.rig.floor(stamp)?,
            };
            // Two labels at the same place are one question.
            let alike: Vec<_> = keys.chunk_by(|a, b| a.1 == b.1).collect();
            let px = |some: &&[(usize, PixelKey, usize, usize)]| {
                let (_, _, point, segment) = some[0];
                points[point].px(points[point].segments[segment].keyframe)
            };
            let list: Vec<Pixel> = alike.iter().map(px).collect();
            let depths = source.depths(&keyframe, &list)?;
            let each = alike.into_iter().zip(depths);
            Ok(each.flat_map(|(some, depth)| some.iter().map(move |(_, _, p, s)| (*p, *s, depth))).collect())
        })
        .collect();
    let mut by_segment: Vec<Vec<Option<Depth>>> =
        points.iter().map(|p| vec![None; p.segments.len()]).collect();
    for answer in answers {
        for (point, segment, depth) in answer? {
            by_segment[point][segment] = Some(depth);
        }
    }
    Ok(DepthTable { by_segment, triangulated: vec![] })
}
