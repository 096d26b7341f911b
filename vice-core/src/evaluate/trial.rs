//! A stream scored once more with another camera and other poses, by the same stages: what a diagnosis varies.

use super::score::{Scorer, score};
pub(crate) use super::streams::PosesAtFrames;
use super::{DepthTable, EvaluateError, Evaluation, extrinsics, keyframe_depths};
use crate::camera::Camera;
use crate::depth::{DepthSample, DepthSource};
use crate::error::DataResult;
use crate::frames::BodyFromCamera;
use crate::metrics::align::Alignment;
use crate::result::Sample;
use crate::time::Stamp;

/// Extrinsics at the selected frames.
pub(crate) type CamerasAtFrames = Vec<Option<BodyFromCamera>>;

/// Depths of the key-frame pixels, to be used with several trials.
pub(crate) struct TrialDepths(DepthTable);

impl TrialDepths {
    /// All of them longer by a factor.
    pub(crate) fn times(&self, factor: f64) -> Self {
        let longer = |sample: DepthSample| DepthSample { z_m: factor * sample.z_m, ..sample };
        Self(self.0.iter().map(|(at, depth)| (*at, depth.map(longer))).collect())
    }

    /// The median of the shares by which they differ from others, where both have one; zero where none has.
    pub(crate) fn typical_change(&self, other: &Self) -> f64 {
        let pairs = self.0.iter().filter_map(|(at, depth)| Some((depth.ok()?, other.0.get(at)?.ok()?)));
        let mut changes: Vec<f64> = pairs.map(|(a, b)| (a.z_m / b.z_m).ln().abs()).collect();
        changes.sort_by(f64::total_cmp);
        changes.get(changes.len() / 2).copied().unwrap_or(0.0)
    }
}

/// The stages of an evaluation, one by one.
pub(crate) struct Trial<'a> {
    evaluation: &'a Evaluation<'a>,
}

impl<'a> Trial<'a> {
    pub(crate) const fn new(evaluation: &'a Evaluation<'a>) -> Self {
        Self { evaluation }
    }

    /// Stamps of the selected frames, ascending: those of key frames and samples.
    pub(crate) fn stamps(&self) -> Vec<Stamp> {
        self.evaluation.selection.frames.iter().map(|f| self.evaluation.frames[*f]).collect()
    }

    /// The extrinsics as they are in use, at the selected frames.
    pub(crate) fn cameras(&self) -> DataResult<CamerasAtFrames> {
        extrinsics(self.evaluation)
    }

    /// Stage 3 with another camera and anchor.
    pub(crate) fn depths(
        &self,
        source: &dyn DepthSource,
        camera: &Camera,
        cameras: &CamerasAtFrames,
        anchor: &PosesAtFrames,
    ) -> Result<TrialDepths, EvaluateError> {
        keyframe_depths(&self.with(camera), source, cameras, anchor).map(TrialDepths)
    }

    /// Stage 4 with another camera and other poses: the scored samples by point and time.
    pub(crate) fn samples(
        &self,
        camera: &Camera,
        cameras: &CamerasAtFrames,
        poses: &PosesAtFrames,
        depths: &TrialDepths,
    ) -> Vec<Sample> {
        // Only a sink can fail, and there is none.
        let evaluation = &self.with(camera);
        let depths = &depths.0;
        let scorer = Scorer { evaluation, cameras, poses, depths, keep_samples: true, carries: false };
        score(&scorer, None).map_or_else(|_| Vec::new(), |all| all.samples)
    }

    fn with<'b>(&'b self, camera: &'b Camera) -> Evaluation<'b> {
        let e = self.evaluation;
        Evaluation {
            dataset: e.dataset,
            camera_name: e.camera_name,
            camera,
            frames: e.frames,
            selection: e.selection,
            streams: e.streams,
            anchor: e.anchor,
            own_anchors: e.own_anchors,
            depths: e.depths,
            checks: &[],
            max_gap: e.max_gap,
            subsets: None,
            align: Alignment::None,
            keep_samples: true,
        }
    }
}
