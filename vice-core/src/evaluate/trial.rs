//! A stream scored once more with another camera and other poses, by the same stages: what a diagnosis varies.

use super::depths::keyframe_depths;
use super::score::{Scorer, score};
use super::{EvaluateError, Evaluation, extrinsics};
use crate::error::DataResult;
use crate::frames::BodyFromCamera;
use crate::metrics::pixel::pooled_rmse_px;

/// Extrinsics at the selected frames.
pub(crate) type CamerasAtFrames = Vec<Option<BodyFromCamera>>;

/// The stages of an evaluation, one by one.
pub(crate) struct Trial<'a> {
    evaluation: &'a Evaluation<'a>,
}

impl<'a> Trial<'a> {
    pub(crate) const fn new(evaluation: &'a Evaluation<'a>) -> Self {
        Self { evaluation }
    }

    /// Indices of the selected frames, ascending: those of key frames and samples.
    pub(crate) fn frame_indices(&self) -> &'a [usize] {
        &self.evaluation.selection.frames
    }

    /// The extrinsics as they are in use, at the selected frames.
    pub(crate) fn cameras(&self) -> DataResult<CamerasAtFrames> {
        extrinsics(self.evaluation)
    }

    /// RMSE_2D of all points together, as an evaluation gives it, pixels; and how many labels it rests on.
    pub(crate) fn pooled_rmse_px(&self, stream: usize, depth: usize) -> Result<(f64, usize), EvaluateError> {
        let e = self.evaluation;
        let at = |stream: usize| e.streams[stream].poses_at(e.frames, &e.selection.frames, e.max_gap);
        let cameras = self.cameras()?;
        let depths = keyframe_depths(e, e.depths[depth], &cameras, &at(e.anchor_of(stream)))?;
        // Only a sink can fail, and there is none.
        let scorer = Scorer::new(e, &cameras, &at(stream), &depths);
        let errors = score(&scorer, None, &mut Vec::new()).map_or_else(|_| Vec::new(), |all| all.errors);
        Ok((pooled_rmse_px(&errors).unwrap_or(0.0), errors.iter().map(|e| e.count as usize).sum()))
    }
}
