//! Pose streams at the evaluated frames, and an estimate against the reference there.

use super::EvaluateError;
use super::path_doubts::path_doubts;
use crate::frames::WorldFromBody;
use crate::metrics::align::{Alignment, ReferenceFromEstimate, align};
use crate::metrics::associate::PosePairs;
use crate::metrics::trajectory::Summary;
use crate::result::{Role, TrajectoryPart};
use crate::suspicion::Suspicion;
use crate::time::{Span, Stamp};
use crate::time_unit::mixed_up;
use crate::trajectory::{NoPose, Trajectory};

/// A named pose stream that is evaluated or compared with.
#[derive(Clone, Debug)]
pub struct Stream {
    /// Its name in tables and documents.
    pub name: String,
    /// What it is taken for.
    pub role: Role,
    /// Its poses, any clock offset already added.
    pub trajectory: Trajectory,
    /// The clock offset that was added to its stamps.
    pub time_offset: Span,
    /// How its trajectory errors are aligned, where that is not the evaluation's way: a stream that starts in the
    /// reference's own state is in its world already.
    pub align: Option<Alignment>,
}

/// A pose for each selected frame, or why there is none.
pub(crate) type PosesAtFrames = Vec<Result<WorldFromBody, NoPose>>;

impl Stream {
    /// A stream with its stamps as they are.
    pub fn new(name: impl Into<String>, role: Role, trajectory: Trajectory) -> Self {
        Self { name: name.into(), role, trajectory, time_offset: Span::ZERO, align: None }
    }

    pub(super) fn poses_at(&self, frames: &[Stamp], selected: &[usize], max_gap: Span) -> PosesAtFrames {
        selected.iter().map(|frame| self.trajectory.pose_at(frames[*frame], max_gap)).collect()
    }

    pub(crate) fn check_overlap(&self, frames: (Stamp, Stamp)) -> Result<(), EvaluateError> {
        let poses = (self.trajectory.start(), self.trajectory.end());
        if poses.0 <= frames.1 && frames.0 <= poses.1 {
            return Ok(());
        }
        let suspicion = mixed_up(("poses", poses), ("frames", frames));
        Err(EvaluateError::NoOverlap { stream: self.name.clone(), poses, frames, suspicion })
    }
}

/// RMSE_3D, AOE and ROE at the stamps where both streams have a pose, after alignment; and that alignment.
pub(super) fn compare(
    reference: &Stream,
    estimate: &Stream,
    stamps: &[Stamp],
    max_gap: Span,
    alignment: Alignment,
) -> (TrajectoryPart, Option<ReferenceFromEstimate>, Vec<Suspicion>) {
    let alignment = estimate.align.unwrap_or(alignment);
    let at_both = at_both(reference, estimate, stamps, max_gap);
    let mut part = TrajectoryPart {
        estimate: estimate.name.clone(),
        reference: reference.name.clone(),
        align: alignment.name().to_string(),
        matched: at_both.len(),
        rmse_3d_m: None,
        aoe_rad: None,
        roe_rad: None,
        problem: None,
        frames: vec![],
        since_keyframe: vec![],
    };
    let doubts = path_doubts(&estimate.name, &at_both, alignment);
    let found = PosePairs::new(at_both).and_then(|pairs| {
        let transform = align(&pairs, alignment, None)?;
        Ok((Summary::of(&transform.apply_to(&pairs))?, transform))
    });
    match found {
        Ok((summary, transform)) => {
            part.rmse_3d_m = Some(summary.rmse_3d_m);
            part.aoe_rad = Some(summary.aoe_rad);
            part.roe_rad = summary.roe_rad;
            (part, Some(transform), doubts)
        }
        Err(error) => {
            part.problem = Some(error.to_string());
            (part, None, vec![])
        }
    }
}

/// The poses of two streams at the stamps where both have one.
pub(super) fn at_both(
    reference: &Stream,
    estimate: &Stream,
    stamps: &[Stamp],
    max_gap: Span,
) -> Vec<(Stamp, WorldFromBody, WorldFromBody)> {
    let pair = |stamp: &Stamp| {
        let pose = reference.trajectory.pose_at(*stamp, max_gap).ok()?;
        Some((*stamp, pose, estimate.trajectory.pose_at(*stamp, max_gap).ok()?))
    };
    stamps.iter().filter_map(pair).collect()
}
