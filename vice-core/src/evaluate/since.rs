//! By how much an estimate's motion since each key frame is off: what the pixel error is made of.

use std::collections::BTreeSet;

use super::streams::PosesAtFrames;
use super::{Evaluation, position};
use crate::frames::rotation_angle_rad;
use crate::result::MotionError;

/// The error of the body's motion from each key frame to each of its labelled frames, once for each pair, where both
/// streams have both poses.
pub(super) fn since_keyframe(
    evaluation: &Evaluation<'_>,
    reference: &PosesAtFrames,
    estimate: &PosesAtFrames,
) -> Vec<MotionError> {
    let segments = evaluation.selection.points.iter().flat_map(|p| &p.segments);
    let pairs: BTreeSet<(usize, usize)> =
        segments.flat_map(|s| s.samples.iter().map(|sample| (s.keyframe.frame, sample.frame))).collect();
    let error = |(from, to): (usize, usize)| {
        let at = |frame| position(&evaluation.selection.frames, frame);
        let motion = |poses: &PosesAtFrames| Some(poses[at(from)].ok()?.inverse() * poses[at(to)].ok()?);
        let (reference, estimate) = (motion(reference)?, motion(estimate)?);
        Some(MotionError {
            keyframe_ns: evaluation.frames[from],
            timestamp_ns: evaluation.frames[to],
            position_m: (estimate.translation() - reference.translation()).norm(),
            angle_rad: rotation_angle_rad(&(reference.rotation().inverse() * estimate.rotation())),
        })
    };
    pairs.into_iter().filter_map(error).collect()
}
