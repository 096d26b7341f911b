//! Trajectories from rows that come one by one, without a copy of them.

use super::{PoseRow, Trajectory, TrajectoryError};
use crate::frames::Rigid;

/// Takes rows one by one.
#[derive(Clone, Debug)]
pub struct TrajectoryBuilder(Trajectory);

impl Default for TrajectoryBuilder {
    fn default() -> Self {
        Self(Trajectory::with_capacity(0))
    }
}

impl TrajectoryBuilder {
    /// Adds a row.
    ///
    /// # Errors
    /// [`TrajectoryError`] as in [`Trajectory::from_rows`], with the number of rows before as the row. It is not added.
    pub fn push(&mut self, row: &PoseRow) -> Result<(), TrajectoryError> {
        let index = self.0.stamps.len();
        let pose = Rigid::try_from_parts(row.position_m, row.rotation_wxyz)
            .map_err(|problem| TrajectoryError::Pose { row: index, problem })?;
        self.0.push(index, row.stamp, pose)
    }

    /// The trajectory.
    ///
    /// # Errors
    /// [`TrajectoryError::Empty`] where no row was added.
    pub fn finish(self) -> Result<Trajectory, TrajectoryError> {
        self.0.finish()
    }
}
