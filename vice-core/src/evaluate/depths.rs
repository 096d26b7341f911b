//! Depths at the key frames, asked of each source once: for all streams together, or for each by its own place.

use std::collections::BTreeMap;

use crate::parallel::*;

use super::streams::PosesAtFrames;
use super::{EvaluateError, Evaluation, position};
use crate::camera::Pixel;
use crate::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use crate::error::{DataResult, one_line};
use crate::frames::BodyFromCamera;
use crate::suspicion::Suspicion;

/// Depths of the pixels at the key frames of one source, by frame and pixel bits.
pub(super) type DepthTable = BTreeMap<(usize, PixelKey), Result<DepthSample, DepthMiss>>;

/// A pixel as a key: two labels at the same place are one question.
type PixelKey = (u64, u64);

pub(super) fn pixel_key(px: Pixel) -> PixelKey {
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
    let mut pixels: BTreeMap<usize, BTreeMap<PixelKey, Pixel>> = BTreeMap::new();
    for segment in evaluation.selection.points.iter().flat_map(|p| &p.segments) {
        let px = segment.keyframe.observation.px;
        pixels.entry(segment.keyframe.frame).or_default().insert(pixel_key(px), px);
    }
    let asked: Vec<(usize, BTreeMap<PixelKey, Pixel>)> = pixels.into_iter().collect();
    let answers: Vec<DataResult<Vec<_>>> = asked
        .par_iter()
        .map(|(frame, pixels)| {
            let at = position(&evaluation.selection.frames, *frame);
            let Some(body_from_camera) = cameras[at] else { return Ok(vec![]) };
            let stamp = evaluation.frames[*frame];
            let keyframe = Keyframe {
                stamp,
                frame: *frame,
                camera: evaluation.camera,
                body_from_camera,
                world_from_camera: anchor[at].ok().map(|pose| pose * body_from_camera),
                floor: evaluation.rig.floor(stamp)?,
            };
            let list: Vec<Pixel> = pixels.values().copied().collect();
            let depths = source.depths(&keyframe, &list)?;
            Ok(pixels.keys().zip(depths).map(|(key, depth)| ((*frame, *key), depth)).collect())
        })
        .collect();
    let mut table = DepthTable::new();
    for answer in answers {
        table.extend(answer?);
    }
    Ok(table)
}
