//! Trajectories in files: what other programs write, found out by content, never guessed by name.
//!
//! | format | a row | stamps |
//! | --- | --- | --- |
//! | TUM | `t tx ty tz qx qy qz qw` | decimal seconds, read exactly |
//! | EuRoC | `t,px,py,pz,qw,qx,qy,qz` and optionally `v`, gyro bias, accel bias | nanoseconds |
//! | any table | columns by their names, above the rows or in a comment; see [`crate::columns`] | as named, else by size |
//! | KITTI | 12 numbers, the upper rows of a 4x4 matrix, or all 16 | seconds in a file of times beside it |
//! | KITTI and more | the same behind a running number, or behind a stamp | of that number in the times, or its own |
//! | relative | `t0 t1 tx ty tz qx qy qz qw` of `T^{B_t1,B_t0}` | decimal seconds |
//!
//! A column more or less than these is never guessed away. What is left out or repaired is in
//! [`TrajectoryFile::suspicions`], by the rules of [`crate::leniency`].
//!
//! Metres and `world_from_body`. Relative motions are the paper's primary input; they look like TUM rows with further
//! columns, so they are asked for by name: `rel:FILE`.

mod layout;
mod matrix;
mod parse;
mod plausible;
mod relative;
mod write;

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use vice_core::error::{DataError, DataResult};
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::trajectory::{Trajectory, TrajectoryError};

use crate::leniency::Leniency;

pub use matrix::{MatrixPoses, MatrixStamps};
pub use parse::{Parsed, PoseRows, read_micros_rows, read_rows};
pub use relative::read_relative_rows;
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
    /// What was left out or repaired, and what looks wrong. About the file, once it was read from one.
    pub suspicions: Suspicions,
    pub(crate) lenient: Leniency,
    /// Columns of a row, where those beyond the eighth were passed over without names.
    pub(crate) passed_over: Option<usize>,
}

impl TrajectoryFile {
    fn new(format: TrajectoryFormat, trajectory: Trajectory) -> Self {
        Self {
            format,
            trajectory,
            inertial: None,
            suspicions: Suspicions::new(),
            lenient: Leniency::new(),
            passed_over: None,
        }
    }

    /// As [`Self::about`], for poses without a clock.
    fn counted(mut self, path: &Path) -> Self {
        self.suspicions.extend(self.lenient.suspicions(&path.display().to_string()));
        self
    }

    /// Puts what was met into words, now that the name of the file is known.
    fn about(mut self, path: &Path) -> Self {
        let about = path.display().to_string();
        self.suspicions.extend(self.lenient.suspicions(&about));
        if let Some(columns) = self.passed_over {
            self.suspicions.add(
                Suspicion::new("columns-passed-over", &about, "columns without names are passed over")
                    .evidence(format!("{columns} columns, of which the first 8 are read{}", beyond(columns)))
                    .advice("name the columns in a first line, such as timestamp tx ty tz qx qy qz qw"),
            );
        }
        self.suspicions.extend(plausible::suspicion(&self.trajectory, &about));
        self
    }
}

/// What so many columns may be, for a person to recognise.
const fn beyond(columns: usize) -> &'static str {
    match columns {
        29 | 44 => "; the others are as many as a covariance has",
        14 => "; the others are as many as the variances of a pose",
        _ => "",
    }
}

/// How to read what a file alone does not say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The file of times of a KITTI file; by default `times.txt` beside it.
    pub times: Option<PathBuf>,
    /// A KITTI file without times counts its rows as seconds, where that is enough (comparing two such files).
    pub index_as_seconds: bool,
}

/// Reads a file of absolute poses in the format its content shows.
///
/// # Errors
/// [`DataError`] with path and line for rows that are infinite, not sorted, not unit quaternions within 1 %, or of
/// another width, for names that contradict, for an empty file, and for a KITTI file without times.
pub fn read(path: impl AsRef<Path>, options: &ReadOptions) -> DataResult<TrajectoryFile> {
    let path = path.as_ref();
    let parsed = read_rows(crate::rows::open(path)?).map_err(|e| e.at(path))?;
    match parsed {
        Parsed::Stamped(file) => Ok(file.about(path)),
        Parsed::Kitti(poses, lenient) => {
            let timed = !matches!(poses.stamps, MatrixStamps::Stamps(_));
            let mut file =
                TrajectoryFile::new(TrajectoryFormat::Kitti, matrix::with_times(path, poses, options)?);
            file.lenient = lenient;
            // Rows counted as seconds have no speed.
            let counted = timed && options.index_as_seconds;
            Ok(if counted { file.counted(path) } else { file.about(path) })
        }
    }
}

/// Reads a file that is known to have EuRoC's layout, such as the ground truth of a sequence.
///
/// # Errors
/// As [`read`].
pub fn read_euroc(path: impl AsRef<Path>) -> DataResult<TrajectoryFile> {
    let path = path.as_ref();
    parse::read_euroc_rows(crate::rows::open(path)?).map(|file| file.about(path)).map_err(|e| e.at(path))
}

/// Reads a file of relative motions and chains them from the identity.
///
/// # Errors
/// [`DataError`] with path and line, as [`read`], and where a motion does not start at the end of the one before.
pub fn read_relative(path: impl AsRef<Path>) -> DataResult<TrajectoryFile> {
    let path = path.as_ref();
    read_relative_rows(crate::rows::open(path)?).map(|file| file.about(path)).map_err(|e| e.at(path))
}

/// Whether a table begins with poses, by the names above it or its first rows.
pub fn looks_like_poses(path: impl AsRef<Path>) -> bool {
    crate::rows::open(path).and_then(parse::first_is_pose).unwrap_or(false)
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
mod dialect_tests;
#[cfg(test)]
mod tests;
