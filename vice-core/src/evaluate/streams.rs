//! Pose streams at the evaluated frames, and an estimate against the reference there.

use super::EvaluateError;
use crate::frames::WorldFromBody;
use crate::metrics::align::{Alignment, align};
use crate::metrics::trajectory::seed_metrics;
use crate::result::{Role, TrajectoryPart};
use crate::time::{Span, Stamp, suspect_unit};
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
}

/// A pose for each selected frame, or why there is none.
pub(super) type PosesAtFrames = Vec<Result<WorldFromBody, NoPose>>;

impl Stream {
    pub(super) fn poses_at(&self, frames: &[Stamp], selected: &[usize], max_gap: Span) -> PosesAtFrames {
        selected.iter().map(|frame| self.trajectory.pose_at(frames[*frame], max_gap)).collect()
    }

    pub(super) fn check_overlap(&self, frames: (Stamp, Stamp)) -> Result<(), EvaluateError> {
        let poses = (self.trajectory.start(), self.trajectory.end());
        if poses.0 <= frames.1 && frames.0 <= poses.1 {
            return Ok(());
        }
        let suspicion = suspect_unit(poses, frames);
        Err(EvaluateError::NoOverlap { stream: self.name.clone(), poses, frames, suspicion })
    }
}

/// RMSE_3D, AOE and ROE at the stamps where both streams have a pose, after alignment.
pub(super) fn compare(
    reference: &Stream,
    estimate: &Stream,
    stamps: &[Stamp],
    max_gap: Span,
    alignment: Alignment,
) -> TrajectoryPart {
    let pairs: Vec<(WorldFromBody, WorldFromBody)> = stamps
        .iter()
        .filter_map(|stamp| {
            let reference = reference.trajectory.pose_at(*stamp, max_gap).ok()?;
            Some((reference, estimate.trajectory.pose_at(*stamp, max_gap).ok()?))
        })
        .collect();
    let (references, estimates): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
    let mut part = TrajectoryPart {
        estimate: estimate.name.clone(),
        reference: reference.name.clone(),
        align: alignment.name().to_string(),
        matched: references.len(),
        rmse_3d_m: None,
        aoe_rad: None,
        roe_rad: None,
        problem: None,
    };
    match align(&references, &estimates, alignment, None) {
        Ok(aligned) => {
            let moved: Vec<WorldFromBody> = estimates.iter().map(|pose| aligned.apply(pose)).collect();
            let metrics = seed_metrics(&references, &moved);
            part.rmse_3d_m = metrics.rmse_3d_m;
            part.aoe_rad = metrics.aoe_rad;
            part.roe_rad = metrics.roe_rad;
        }
        Err(error) => part.problem = Some(error.to_string()),
    }
    part
}
