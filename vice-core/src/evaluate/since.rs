//! By how much an estimate's motion since each key frame is off: what the pixel error is made of.

use std::collections::BTreeSet;

use super::Evaluation;
use super::streams::PosesAtFrames;
use crate::frames::rotation_angle_rad;
use crate::result::MotionError;

/// The error of the body's motion from each key frame to each of its labelled frames, once for each pair, where both
/// streams have both poses.
pub(super) fn since_keyframe(
    evaluation: &Evaluation<'_>,
    reference: &PosesAtFrames,
    estimate: &PosesAtFrames,
) -> Vec<MotionError> {
    let mut pairs: BTreeSet<(usize, usize)> = BTreeSet::new();
    for point in &evaluation.selection.points {
        for segment in &point.segments {
            pairs.extend(point.samples(segment).map(|(_, place)| (segment.place, place)));
        }
    }
    let stamp = |place: usize| evaluation.frames[evaluation.selection.frames[place]];
    let error = |(from, to): (usize, usize)| {
        let motion = |poses: &PosesAtFrames| Some(poses[from].ok()?.inverse() * poses[to].ok()?);
        let (reference, estimate) = (motion(reference)?, motion(estimate)?);
        Some(MotionError {
            keyframe_ns: stamp(from),
            timestamp_ns: stamp(to),
            position_m: (estimate.translation() - reference.translation()).norm(),
            angle_rad: rotation_angle_rad(&(reference.rotation().inverse() * estimate.rotation())),
        })
    };
    pairs.into_iter().filter_map(error).collect()
}
