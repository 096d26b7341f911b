//! Trajectories in files: what other programs write, found out by content, never guessed by name.
//!
//! | format | a row | stamps |
//! | --- | --- | --- |
//! | TUM | `t tx ty tz qx qy qz qw`, further columns ignored | decimal seconds, read exactly |
//! | EuRoC | `t,px,py,pz,qw,qx,qy,qz` and optionally `v`, gyro bias, accel bias | nanoseconds |
//! | KITTI | 12 numbers, the upper rows of a 4x4 matrix | seconds in a file of times beside it |
//! | relative | `t0 t1 tx ty tz qx qy qz qw` of `T^{B_t1,B_t0}` | decimal seconds |
//!
//! Metres and `world_from_body`. Relative motions are the paper's primary input; they look like TUM rows with further
//! columns, so they are asked for by name: `rel:FILE`.

mod parse;
mod write;

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use vice_core::error::{DataError, DataResult};
use vice_core::trajectory::{Trajectory, TrajectoryError};

pub use parse::{Parsed, read_relative_rows, read_rows};
pub use write::{write_euroc, write_kitti, write_relative, write_tum};

/// A format of trajectories.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrajectoryFormat {
    /// `t tx ty tz qx qy qz qw`.
    Tum,
    /// The ground-truth layout of EuRoC.
    Euroc,
    /// 3x4 matrices.
    Kitti,
    /// Relative motions, chained from the identity.
    Relative,
}

impl TrajectoryFormat {
    /// Its name in tables and options.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tum => "tum",
            Self::Euroc => "euroc",
            Self::Kitti => "kitti",
            Self::Relative => "relative",
        }
    }
}

/// What a row of EuRoC's ground truth has beside the pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InertialRow {
    /// Velocity of the body in the world, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Bias of the gyroscope, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Bias of the accelerometer, m/s².
    pub accel_bias_m_s2: Vector3<f64>,
}

/// A trajectory as a file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryFile {
    /// The format found.
    pub format: TrajectoryFormat,
    /// The poses.
    pub trajectory: Trajectory,
    /// Velocity and biases, one for each pose, where the file has all 17 columns of EuRoC.
    pub inertial: Option<Vec<InertialRow>>,
}

/// How to read what a file alone does not say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The file of times of a KITTI file; by default `times.txt` beside it.
    pub times: Option<PathBuf>,
    /// A KITTI file without times counts its rows as seconds, where that is enough (comparing two such files).
    pub index_as_seconds: bool,
}

/// Reads what an option names: `FILE`, or `rel:FILE` for relative motions.
///
/// # Errors
/// As [`read`] and [`read_relative`].
pub fn read_spec(spec: &str, options: &ReadOptions) -> DataResult<TrajectoryFile> {
    match spec.strip_prefix("rel:") {
        Some(file) => read_relative(file),
        None => read(spec, options),
    }
}

/// Reads a file of absolute poses in the format its content shows.
///
/// # Errors
/// [`DataError`] with path and line for rows that are not finite, not sorted, duplicate, not unit quaternions or too
/// short, for an empty file, and for a KITTI file without times.
pub fn read(path: impl AsRef<Path>, options: &ReadOptions) -> DataResult<TrajectoryFile> {
    let path = path.as_ref();
    let parsed = read_rows(crate::rows::open(path)?).map_err(|e| e.at(path))?;
    match parsed {
        Parsed::Stamped(file) => Ok(file),
        Parsed::Kitti(poses) => {
            let trajectory = parse::with_times(path, poses, options)?;
            Ok(TrajectoryFile { format: TrajectoryFormat::Kitti, trajectory, inertial: None })
        }
    }
}

/// Reads a file that is known to have EuRoC's layout, such as the ground truth of a sequence.
///
/// # Errors
/// As [`read`].
pub fn read_euroc(path: impl AsRef<Path>) -> DataResult<TrajectoryFile> {
    let path = path.as_ref();
    parse::read_euroc_rows(crate::rows::open(path)?).map_err(|e| e.at(path))
}

/// Reads a file of relative motions and chains them from the identity.
///
/// # Errors
/// [`DataError`] with path and line, as [`read`], and where a motion does not start at the end of the one before.
pub fn read_relative(path: impl AsRef<Path>) -> DataResult<TrajectoryFile> {
    let path = path.as_ref();
    read_relative_rows(crate::rows::open(path)?).map_err(|e| e.at(path))
}

/// An error of the core, which counts rows, as one of a file, which counts lines.
pub(crate) fn at_line(error: &TrajectoryError, lines: &[u64]) -> DataError {
    let named = match error {
        TrajectoryError::Empty => return DataError::new("the file holds no poses"),
        other => DataError::new(other.problem()),
    };
    match error.row().and_then(|row| lines.get(row)) {
        Some(line) => named.line(*line),
        None => named,
    }
}

#[cfg(test)]
mod tests;
