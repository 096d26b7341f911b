//! What plots need beside the numbers: errors over time, and where each stream went.

use std::collections::BTreeSet;

use super::since::since_keyframe;
use super::streams::{PosesAtFrames, at_both, compare};
use super::{Evaluation, Stream};
use crate::frames::WorldFromBody;
use crate::metrics::align::ReferenceFromEstimate;
use crate::metrics::associate::PosePairs;
use crate::metrics::trajectory::ApeErrors;
use crate::result::{FrameError, PathPart, PathPose, Role, TrajectoryPart};
use crate::suspicion::Suspicions;
use crate::time::{Span, Stamp};

/// How many times between the evaluated frames fill a curve.
const BETWEEN: i64 = 300;

/// The estimates against the reference, where there is one, and the paths of all streams; what makes the errors
/// doubtful goes to `suspicions`. `poses` are those of the streams at the selected frames.
pub(super) fn trajectories(
    evaluation: &Evaluation<'_>,
    poses: &[PosesAtFrames],
    suspicions: &mut Suspicions,
) -> (Vec<TrajectoryPart>, Vec<PathPart>) {
    let stamps: Vec<Stamp> = evaluation.selection.in_window.iter().map(|f| evaluation.frames[*f]).collect();
    let evaluated: BTreeSet<Stamp> = stamps.iter().copied().collect();
    let shown = if evaluation.keep_samples { shown_stamps(&evaluated) } else { vec![] };
    let reference = evaluation.streams.iter().zip(poses).find(|(s, _)| s.role == Role::Reference);
    let (mut parts, mut paths) = (vec![], vec![]);
    for (stream, poses) in evaluation.streams.iter().zip(poses) {
        let mut transform = None;
        if let (Some((reference, reference_poses)), Role::Estimate) = (reference, stream.role) {
            let (mut part, found, doubts) =
                compare(reference, stream, &stamps, evaluation.max_gap, evaluation.align);
            suspicions.extend(doubts);
            if evaluation.keep_samples {
                part.since_keyframe = since_keyframe(evaluation, reference_poses, poses);
            }
            if let Some(found) = &found {
                part.frames = frame_errors(evaluation, (reference, stream), found, &shown, &evaluated);
            }
            parts.push(part);
            transform = found;
        }
        if evaluation.keep_samples {
            paths.push(path(evaluation, stream, transform.as_ref(), &shown));
        }
    }
    (parts, paths)
}

/// The evaluated frames, and times at even distances between the first and the last.
fn shown_stamps(evaluated: &BTreeSet<Stamp>) -> Vec<Stamp> {
    let (Some(first), Some(last)) = (evaluated.first(), evaluated.last()) else { return vec![] };
    let step_ns = last.since(*first).as_nanos() / BETWEEN;
    let between = (1..BETWEEN).map(|i| *first + Span::from_nanos(i * step_ns));
    evaluated.iter().copied().chain(between).collect::<BTreeSet<Stamp>>().into_iter().collect()
}

fn frame_errors(
    evaluation: &Evaluation<'_>,
    (reference, estimate): (&Stream, &Stream),
    transform: &ReferenceFromEstimate,
    shown: &[Stamp],
    evaluated: &BTreeSet<Stamp>,
) -> Vec<FrameError> {
    let Ok(pairs) = PosePairs::new(at_both(reference, estimate, shown, evaluation.max_gap)) else {
        return vec![];
    };
    let errors = ApeErrors::of(&transform.apply_to(&pairs));
    let both = errors.translation_m.iter().zip(&errors.rotation_rad);
    pairs
        .stamps()
        .iter()
        .zip(both)
        .map(|(stamp, (position_m, angle_rad))| FrameError {
            timestamp_ns: *stamp,
            position_m: *position_m,
            angle_rad: *angle_rad,
            evaluated: evaluated.contains(stamp),
        })
        .collect()
}

fn path(
    evaluation: &Evaluation<'_>,
    stream: &Stream,
    transform: Option<&ReferenceFromEstimate>,
    shown: &[Stamp],
) -> PathPart {
    let placed = |pose: WorldFromBody| transform.map_or(pose, |t| t.apply(&pose));
    let pose = |stamp: &Stamp| {
        let pose = placed(stream.trajectory.pose_at(*stamp, evaluation.max_gap).ok()?);
        let (position, rotation) = (pose.translation(), pose.rotation());
        Some(PathPose {
            timestamp_ns: *stamp,
            position_m: [position.x, position.y, position.z],
            rotation_wxyz: [rotation.w, rotation.i, rotation.j, rotation.k],
        })
    };
    PathPart {
        stream: stream.name.clone(),
        role: stream.role,
        in_reference_world: transform.is_some() || stream.role == Role::Reference,
        poses: shown.iter().filter_map(pose).collect(),
    }
}
