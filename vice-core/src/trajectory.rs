//! Trajectories: poses of the body over time, and how they are read between their stamps.
//!
//! A [`Trajectory`] is validated when it is built, so that everything after it may rely on order, finite numbers
//! and unit quaternions. Between two poses position goes linearly and rotation by slerp; across a gap wider than
//! `max_gap`, before the first and after the last pose there is no pose, and the answer says which of these it was.

mod builder;

pub use builder::TrajectoryBuilder;

use nalgebra::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector3};

use crate::frames::{Body, FrameError, Rigid, World, WorldFromBody};
use crate::statistics::middle;
use crate::time::{Span, Stamp};

/// One row as a file has it: not checked yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseRow {
    /// When.
    pub stamp: Stamp,
    /// Position of the body in the world, metres.
    pub position_m: [f64; 3],
    /// Rotation `world_from_body` as a quaternion, w first.
    pub rotation_wxyz: [f64; 4],
}

/// What an estimator says of the errors of one of its poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseCovariance {
    /// When.
    pub stamp: Stamp,
    /// Of x, y, z (metres) and of rotations about x, y, z (radians), along the axes of the world, as ROS has it.
    pub matrix: Matrix6<f64>,
}

/// The paper's primary input: the motion between two instants, `T^{B_t1, B_t0}`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeMotion {
    /// The earlier instant.
    pub from: Stamp,
    /// The later instant.
    pub to: Stamp,
    /// Takes coordinates in the body at `from` to coordinates in the body at `to`.
    pub later_from_earlier: Rigid<Body, Body>,
}

/// A validated trajectory: strictly increasing stamps, finite unit poses `world_from_body`.
///
/// ```
/// use vice_core::time::{Span, Stamp};
/// use vice_core::trajectory::{NoPose, PoseRow, Trajectory};
///
/// let row = |millis: i64, x_m: f64| PoseRow {
///     stamp: Stamp::from_nanos(millis * 1_000_000),
///     position_m: [x_m, 0.0, 1.5],
///     rotation_wxyz: [1.0, 0.0, 0.0, 0.0],
/// };
/// let trajectory = Trajectory::from_rows([row(0, 0.0), row(50, 0.1), row(100, 0.2)])?;
/// // Between two poses it is interpolated, outside nothing is made up.
/// let max_gap = Span::from_millis(100);
/// let pose = trajectory.pose_at(Stamp::from_nanos(75_000_000), max_gap)?;
/// assert!((pose.translation().x - 0.15).abs() < 1e-12);
/// assert_eq!(trajectory.pose_at(Stamp::from_nanos(-1), max_gap), Err(NoPose::BeforeStart));
/// // Rows that are no trajectory are refused, with the row at fault.
/// let error = Trajectory::from_rows([row(50, 0.0), row(0, 0.1)]).unwrap_err();
/// assert_eq!(error.row(), Some(1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    stamps: Vec<Stamp>,
    poses: Vec<WorldFromBody>,
}

/// Why rows are no trajectory. Rows count from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// There is no row at all.
    #[error("no poses")]
    Empty,
    /// Numbers of a row are no pose.
    #[error("row {row}: {problem}")]
    Pose {
        /// Which row.
        row: usize,
        /// What is wrong with it.
        problem: FrameError,
    },
    /// The same stamp again.
    #[error("row {row}: stamp {stamp} ns appears twice")]
    Duplicate {
        /// Which row.
        row: usize,
        /// Its stamp.
        stamp: Stamp,
    },
    /// A stamp earlier than the one before.
    #[error("row {row}: stamp {stamp} ns is earlier than the one before, {previous} ns")]
    Unsorted {
        /// Which row.
        row: usize,
        /// Its stamp.
        stamp: Stamp,
        /// The stamp of the row before.
        previous: Stamp,
    },
    /// A relative motion that does not start where the one before ended.
    #[error("row {row}: the motion starts at {starts} ns, but the one before ended at {ended} ns")]
    Broken {
        /// Which row.
        row: usize,
        /// Where it starts.
        starts: Stamp,
        /// Where the one before ended.
        ended: Stamp,
    },
}

impl TrajectoryError {
    /// The row at fault, counted from 0.
    pub const fn row(&self) -> Option<usize> {
        match self {
            Self::Empty => None,
            Self::Pose { row, .. }
            | Self::Duplicate { row, .. }
            | Self::Unsorted { row, .. }
            | Self::Broken { row, .. } => Some(*row),
        }
    }

    /// The text without the row, for callers that name a line instead.
    pub fn problem(&self) -> String {
        let text = self.to_string();
        match self.row() {
            Some(row) => text.trim_start_matches(&format!("row {row}: ")).to_string(),
            None => text,
        }
    }
}

/// Why there is no pose at a stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoPose {
    /// Earlier than the first pose.
    #[error("before the first pose")]
    BeforeStart,
    /// Later than the last pose.
    #[error("after the last pose")]
    AfterEnd,
    /// Between two poses that are too far apart.
    #[error("in a gap of {gap} between two poses")]
    Gap {
        /// How wide the gap is.
        gap: Span,
    },
}

impl Trajectory {
    /// A trajectory from rows as files have them.
    ///
    /// # Errors
    /// [`TrajectoryError`] with the row (from 0) that is not finite, not a unit quaternion, duplicate or out of order.
    pub fn from_rows(rows: impl IntoIterator<Item = PoseRow>) -> Result<Self, TrajectoryError> {
        let mut builder = TrajectoryBuilder::default();
        for row in rows {
            builder.push(&row)?;
        }
        builder.finish()
    }

    /// A trajectory from poses.
    ///
    /// # Errors
    /// [`TrajectoryError`] as in [`Trajectory::from_rows`].
    pub fn from_poses(
        poses: impl IntoIterator<Item = (Stamp, WorldFromBody)>,
    ) -> Result<Self, TrajectoryError> {
        let poses = poses.into_iter();
        let mut trajectory = Self::with_capacity(poses.size_hint().0);
        for (row, (stamp, pose)) in poses.enumerate() {
            if !pose.isometry().to_homogeneous().iter().all(|v| v.is_finite()) {
                return Err(TrajectoryError::Pose { row, problem: FrameError::NotFinite("the pose") });
            }
            trajectory.push(row, stamp, pose)?;
        }
        trajectory.finish()
    }

    /// Chains relative motions (the paper's product in equation 1) from a first pose.
    ///
    /// `world_from_body(t1) = world_from_body(t0) * (T^{B_t1, B_t0})⁻¹`. Only relative motion enters the method, so
    /// the first pose may be the identity. Rotations are renormalised at each step.
    ///
    /// # Errors
    /// [`TrajectoryError`] if a motion does not start where the one before ended or runs backwards in time.
    pub fn from_relative(motions: &[RelativeMotion], first: WorldFromBody) -> Result<Self, TrajectoryError> {
        let start = motions.first().ok_or(TrajectoryError::Empty)?;
        let mut trajectory = Self::with_capacity(motions.len() + 1);
        trajectory.push(0, start.from, first)?;
        let (mut pose, mut ended) = (first, start.from);
        for (row, motion) in motions.iter().enumerate() {
            if motion.from != ended {
                return Err(TrajectoryError::Broken { row, starts: motion.from, ended });
            }
            pose = pose * motion.later_from_earlier.inverse();
            let rotation = UnitQuaternion::new_normalize(pose.rotation().into_inner());
            pose = Rigid::from_parts(pose.translation(), rotation);
            trajectory.push(row, motion.to, pose)?;
            ended = motion.to;
        }
        trajectory.finish()
    }

    fn with_capacity(n: usize) -> Self {
        Self { stamps: Vec::with_capacity(n), poses: Vec::with_capacity(n) }
    }

    fn push(&mut self, row: usize, stamp: Stamp, pose: WorldFromBody) -> Result<(), TrajectoryError> {
        if let Some(&previous) = self.stamps.last() {
            if stamp == previous {
                return Err(TrajectoryError::Duplicate { row, stamp });
            }
            if stamp < previous {
                return Err(TrajectoryError::Unsorted { row, stamp, previous });
            }
        }
        self.stamps.push(stamp);
        self.poses.push(pose);
        Ok(())
    }

    /// Its stamps and poses.
    pub(crate) fn into_parts(self) -> (Vec<Stamp>, Vec<WorldFromBody>) {
        (self.stamps, self.poses)
    }

    fn finish(self) -> Result<Self, TrajectoryError> {
        if self.stamps.is_empty() { Err(TrajectoryError::Empty) } else { Ok(self) }
    }

    /// Number of poses, at least 1.
    #[expect(clippy::len_without_is_empty, reason = "a trajectory is never empty")]
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Stamps, strictly increasing.
    pub fn stamps(&self) -> &[Stamp] {
        &self.stamps
    }

    /// Poses, one for each stamp.
    pub fn poses(&self) -> &[WorldFromBody] {
        &self.poses
    }

    /// Stamps and poses together.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (Stamp, WorldFromBody)> + '_ {
        self.stamps.iter().copied().zip(self.poses.iter().copied())
    }

    /// Stamp of the first pose.
    pub fn start(&self) -> Stamp {
        self.stamps[0]
    }

    /// Stamp of the last pose.
    pub fn end(&self) -> Stamp {
        self.stamps[self.stamps.len() - 1]
    }

    /// The time between two poses, half of them closer; `None` for a single pose.
    pub fn median_spacing(&self) -> Option<Span> {
        let mut spans: Vec<Span> = self.stamps.windows(2).map(|w| w[1].since(w[0])).collect();
        middle(&mut spans, Ord::cmp)
    }

    /// The pose at `stamp`: linear in position, slerp in rotation, between neighbours at most `max_gap` apart.
    ///
    /// Costs a binary search.
    ///
    /// # Errors
    /// [`NoPose`] outside the trajectory or inside a wider gap; nothing is ever extrapolated.
    pub fn pose_at(&self, stamp: Stamp, max_gap: Span) -> Result<WorldFromBody, NoPose> {
        let after = self.stamps.partition_point(|s| *s < stamp);
        match self.stamps.get(after) {
            Some(s) if *s == stamp => return Ok(self.poses[after]),
            None => return Err(NoPose::AfterEnd),
            Some(_) if after == 0 => return Err(NoPose::BeforeStart),
            Some(_) => {}
        }
        let (t0, t1) = (self.stamps[after - 1], self.stamps[after]);
        let gap = t1.since(t0);
        if gap > max_gap {
            return Err(NoPose::Gap { gap });
        }
        let fraction = stamp.since(t0).as_nanos() as f64 / gap.as_nanos() as f64;
        Ok(interpolate(&self.poses[after - 1], &self.poses[after], fraction))
    }

    /// Index of the pose nearest in time, the earlier one of two at the same distance.
    pub fn nearest(&self, stamp: Stamp) -> usize {
        let after = self.stamps.partition_point(|s| *s < stamp);
        if after == 0 {
            return 0;
        }
        if after == self.stamps.len() {
            return after - 1;
        }
        let (before_by, after_by) = (stamp.since(self.stamps[after - 1]), self.stamps[after].since(stamp));
        if after_by < before_by { after } else { after - 1 }
    }

    /// The same poses with `offset` added to every stamp.
    ///
    /// # Errors
    /// [`TrajectoryError::Duplicate`] if stamps run into the end of the range.
    pub fn shifted(&self, offset: Span) -> Result<Self, TrajectoryError> {
        Self::from_poses(self.iter().map(|(stamp, pose)| (stamp + offset, pose)))
    }

    /// The same stamps with each pose changed.
    pub fn map_poses(&self, mut f: impl FnMut(Stamp, WorldFromBody) -> WorldFromBody) -> Self {
        let poses = self.iter().map(|(stamp, pose)| f(stamp, pose)).collect();
        Self { stamps: self.stamps.clone(), poses }
    }

    /// The poses between two stamps, both included; `None` where there are none.
    pub fn between(&self, first: Stamp, last: Stamp) -> Option<Self> {
        let from = self.stamps.partition_point(|s| *s < first);
        let to = self.stamps.partition_point(|s| *s <= last);
        (from < to)
            .then(|| Self { stamps: self.stamps[from..to].to_vec(), poses: self.poses[from..to].to_vec() })
    }

    /// Length of the path, metres.
    pub fn path_length_m(&self) -> f64 {
        self.poses.windows(2).map(|w| (w[1].translation() - w[0].translation()).norm()).sum()
    }

    /// Median time between two poses; zero for a single pose.
    pub fn median_period(&self) -> Span {
        self.median_spacing().unwrap_or(Span::ZERO)
    }
}

/// Linear in position, slerp in rotation, the short way round; `fraction` 0 gives `a`, 1 gives `b`.
pub fn interpolate<D, S>(a: &Rigid<D, S>, b: &Rigid<D, S>, fraction: f64) -> Rigid<D, S> {
    let position: Vector3<f64> = a.translation() * (1.0 - fraction) + b.translation() * fraction;
    let a_from_b = a.rotation().inverse() * b.rotation();
    // By the rotation vector with atan2: nalgebra's own slerp gives up near opposite quaternions.
    let step = UnitQuaternion::from_scaled_axis(crate::frames::rotation_vector_rad(&a_from_b) * fraction);
    Rigid::from_isometry(Isometry3::from_parts(Translation3::from(position), a.rotation() * step))
}

/// The same pose in a world moved by `new_from_old`.
pub fn in_other_world(new_from_old: &Rigid<World, World>, trajectory: &Trajectory) -> Trajectory {
    trajectory.map_poses(|_, pose| *new_from_old * pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn row(nanos: i64, x: f64) -> PoseRow {
        PoseRow {
            stamp: Stamp::from_nanos(nanos),
            position_m: [x, 0.0, 0.0],
            rotation_wxyz: [1.0, 0.0, 0.0, 0.0],
        }
    }

    #[test]
    fn bad_rows_are_named() {
        assert_eq!(Trajectory::from_rows([]), Err(TrajectoryError::Empty));
        let error = |rows: &[PoseRow]| Trajectory::from_rows(rows.iter().copied()).unwrap_err();
        assert!(matches!(error(&[row(1, 0.0), row(1, 0.0)]), TrajectoryError::Duplicate { row: 1, .. }));
        assert!(matches!(error(&[row(2, 0.0), row(1, 0.0)]), TrajectoryError::Unsorted { row: 1, .. }));
        let nan = error(&[row(1, 0.0), row(2, f64::NAN)]);
        assert_eq!(nan.to_string(), "row 1: the translation is not finite");
        assert_eq!(nan.problem(), "the translation is not finite");
    }

    #[test]
    fn no_pose_is_made_up() {
        let t = Trajectory::from_rows([row(0, 0.0), row(100, 1.0), row(1000, 2.0)]).unwrap();
        let at = |nanos, gap| {
            t.pose_at(Stamp::from_nanos(nanos), Span::from_nanos(gap)).map(|p| p.translation().x)
        };
        assert_eq!(at(-1, 1000), Err(NoPose::BeforeStart));
        assert_eq!(at(1001, 1000), Err(NoPose::AfterEnd));
        assert_eq!(at(50, 100), Ok(0.5));
        assert_eq!(at(500, 100), Err(NoPose::Gap { gap: Span::from_nanos(900) }));
        assert_eq!(at(1000, 100), Ok(2.0), "a stamp that is a pose needs no neighbour");
        assert_eq!(at(550, 900), Ok(1.5));
        assert_eq!((t.nearest(Stamp::from_nanos(50)), t.nearest(Stamp::from_nanos(51))), (0, 1));
        assert_eq!((t.nearest(Stamp::from_nanos(-9)), t.nearest(Stamp::from_nanos(9999))), (0, 2));
    }

    #[test]
    fn a_broken_chain_is_refused() {
        let motion = |a, b| RelativeMotion {
            from: Stamp::from_nanos(a),
            to: Stamp::from_nanos(b),
            later_from_earlier: Rigid::identity(),
        };
        let broken = Trajectory::from_relative(&[motion(0, 1), motion(2, 3)], Rigid::identity());
        assert!(matches!(broken, Err(TrajectoryError::Broken { row: 1, .. })));
        let back = Trajectory::from_relative(&[motion(0, 1), motion(1, 0)], Rigid::identity());
        assert!(matches!(back, Err(TrajectoryError::Unsorted { row: 1, .. })));
    }

    fn any_pose() -> impl Strategy<Value = WorldFromBody> {
        (prop::array::uniform3(-5.0..5.0_f64), prop::array::uniform3(-3.0..3.0_f64)).prop_map(|(t, r)| {
            Rigid::from_parts(t.into(), UnitQuaternion::from_scaled_axis(Vector3::from(r)))
        })
    }

    proptest! {
        #[test]
        fn relative_motions_chain_back_to_the_poses(poses in prop::collection::vec(any_pose(), 2..20)) {
            let absolute = Trajectory::from_poses(
                poses.iter().enumerate().map(|(i, p)| (Stamp::from_nanos(i as i64), *p)),
            ).unwrap();
            let motions: Vec<_> = absolute.iter().zip(absolute.iter().skip(1)).map(|((t0, p0), (t1, p1))| {
                RelativeMotion { from: t0, to: t1, later_from_earlier: p1.inverse() * p0 }
            }).collect();
            let chained = Trajectory::from_relative(&motions, poses[0]).unwrap();
            for (a, b) in absolute.poses().iter().zip(chained.poses()) {
                assert_relative_eq!(a.isometry().to_homogeneous(), b.isometry().to_homogeneous(), epsilon = 1e-9);
            }
        }

        #[test]
        fn interpolation_does_not_care_about_the_sign_of_a_quaternion(a in any_pose(), b in any_pose(), f in 0.0..1.0_f64) {
            let minus = UnitQuaternion::new_unchecked(-b.rotation().into_inner());
            let b2 = Rigid::from_parts(b.translation(), minus);
            let (p, q) = (interpolate(&a, &b, f), interpolate(&a, &b2, f));
            assert_relative_eq!(p.isometry().to_homogeneous(), q.isometry().to_homogeneous(), epsilon = 1e-9);
        }
    }
}
