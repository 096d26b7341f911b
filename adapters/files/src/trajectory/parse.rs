//! From rows to poses.

use std::io::BufRead;
use std::path::Path;

use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Rigid, WorldFromBody};
use vice_core::time::Stamp;
use vice_core::trajectory::{PoseRow, RelativeMotion, Trajectory};

use super::{InertialRow, ReadOptions, TrajectoryFile, TrajectoryFormat, at_line};
use crate::rows::{self, Row, Rows, Separator};

/// Digits of an integer first column from which on it counts nanoseconds (or a smaller unit by mistake), not seconds.
const DIGITS_BEYOND_SECONDS: usize = 12;
/// Columns of a full row of EuRoC's ground truth.
const EUROC_COLUMNS: usize = 17;

/// What rows of absolute poses hold.
#[derive(Clone, Debug, PartialEq)]
pub enum Parsed {
    /// Poses with stamps.
    Stamped(TrajectoryFile),
    /// The poses of a KITTI file, whose stamps are elsewhere.
    Kitti(Vec<WorldFromBody>),
}

/// Reads rows of absolute poses in the format that the first of them shows.
///
/// # Errors
/// [`DataError`] with the line, as [`super::read`].
pub fn read_rows<R: BufRead>(rows: Rows<R>) -> DataResult<Parsed> {
    collect(rows, format_of)?.finish()
}

/// Reads rows in the ground-truth layout of EuRoC, whatever else they might be.
pub(super) fn read_euroc_rows<R: BufRead>(rows: Rows<R>) -> DataResult<TrajectoryFile> {
    match collect(rows, |_| Ok(TrajectoryFormat::Euroc))?.finish()? {
        Parsed::Stamped(file) => Ok(file),
        Parsed::Kitti(_) => Err(DataError::new("the rows have no stamps")),
    }
}

fn collect<R: BufRead>(
    mut rows: Rows<R>,
    format: impl Fn(&Row<'_>) -> DataResult<TrajectoryFormat>,
) -> DataResult<Collected> {
    let mut collected: Option<Collected> = None;
    let mut heading = false;
    while let Some(row) = rows.next_row()? {
        match &mut collected {
            Some(collected) => collected.push(&row)?,
            None if !heading && is_heading(&row) => heading = true,
            None => collected.insert(Collected::new(format(&row)?, row.len())).push(&row)?,
        }
    }
    match collected {
        Some(collected) => Ok(collected),
        None if heading => Err(DataError::new("the file holds a heading but no poses")),
        None => Err(DataError::new("the file is empty: it holds no poses")),
    }
}

/// Reads rows of relative motions and chains them from the identity.
///
/// # Errors
/// [`DataError`] with the line, as [`super::read_relative`].
pub fn read_relative_rows<R: BufRead>(mut rows: Rows<R>) -> DataResult<TrajectoryFile> {
    let (mut motions, mut lines) = (Vec::new(), Vec::new());
    let mut heading = false;
    while let Some(row) = rows.next_row()? {
        if motions.is_empty() && !heading && is_heading(&row) {
            heading = true;
            continue;
        }
        row.expect_columns(9).map_err(|e| e.hint("a relative motion is `t0 t1 tx ty tz qx qy qz qw`"))?;
        let [x, y, z, qx, qy, qz, qw] = row.numbers(2)?;
        let later_from_earlier =
            Rigid::try_from_parts([x, y, z], [qw, qx, qy, qz]).map_err(|e| row.error(e.to_string()))?;
        motions.push(RelativeMotion { from: row.seconds(0)?, to: row.seconds(1)?, later_from_earlier });
        lines.push(row.line());
    }
    let trajectory =
        Trajectory::from_relative(&motions, Rigid::identity()).map_err(|e| at_line(&e, &lines))?;
    Ok(TrajectoryFile { format: TrajectoryFormat::Relative, trajectory, inertial: None })
}

/// The rows so far, in the format of the first.
enum Collected {
    Tum { poses: Vec<PoseRow>, lines: Vec<u64> },
    Euroc { poses: Vec<PoseRow>, inertial: Vec<InertialRow>, columns: usize, lines: Vec<u64> },
    Kitti(Vec<WorldFromBody>),
}

impl Collected {
    fn new(format: TrajectoryFormat, columns: usize) -> Self {
        match format {
            TrajectoryFormat::Kitti => Self::Kitti(Vec::new()),
            TrajectoryFormat::Euroc => Self::Euroc {
                poses: Vec::new(),
                inertial: Vec::new(),
                columns: if columns >= EUROC_COLUMNS { EUROC_COLUMNS } else { 8 },
                lines: Vec::new(),
            },
            _ => Self::Tum { poses: Vec::new(), lines: Vec::new() },
        }
    }

    fn push(&mut self, row: &Row<'_>) -> DataResult<()> {
        match self {
            Self::Tum { poses, lines } => {
                row.expect_columns(8)?;
                let [x, y, z, qx, qy, qz, qw] = row.numbers(1)?;
                poses.push(PoseRow {
                    stamp: row.seconds(0)?,
                    position_m: [x, y, z],
                    rotation_wxyz: [qw, qx, qy, qz],
                });
                lines.push(row.line());
            }
            Self::Euroc { poses, inertial, columns, lines } => {
                row.expect_columns(*columns)?;
                let [x, y, z, qw, qx, qy, qz] = row.numbers(1)?;
                poses.push(PoseRow {
                    stamp: row.nanos(0)?,
                    position_m: [x, y, z],
                    rotation_wxyz: [qw, qx, qy, qz],
                });
                if *columns == EUROC_COLUMNS {
                    inertial.push(InertialRow {
                        velocity_m_s: row.numbers(8)?.into(),
                        gyro_bias_rad_s: row.numbers(11)?.into(),
                        accel_bias_m_s2: row.numbers(14)?.into(),
                    });
                }
                lines.push(row.line());
            }
            Self::Kitti(poses) => {
                row.expect_columns(12)?;
                poses.push(matrix(row)?);
            }
        }
        Ok(())
    }

    fn finish(self) -> DataResult<Parsed> {
        let (format, poses, inertial, lines) = match self {
            Self::Kitti(poses) => return Ok(Parsed::Kitti(poses)),
            Self::Tum { poses, lines } => (TrajectoryFormat::Tum, poses, None, lines),
            Self::Euroc { poses, inertial, lines, .. } => {
                (TrajectoryFormat::Euroc, poses, (!inertial.is_empty()).then_some(inertial), lines)
            }
        };
        let trajectory = Trajectory::from_rows(poses).map_err(|e| at_line(&e, &lines))?;
        Ok(Parsed::Stamped(TrajectoryFile { format, trajectory, inertial }))
    }
}

/// A first row of names, which some tools write without `#`.
fn is_heading(row: &Row<'_>) -> bool {
    let is_word = |text: &str| {
        text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '"') && text.parse::<f64>().is_err()
    };
    (0..row.len()).all(|i| row.field(i).is_some_and(is_word))
}

/// The format of a row. Twelve columns are a matrix where they hold a rotation, else a pose with four more columns.
fn format_of(row: &Row<'_>) -> DataResult<TrajectoryFormat> {
    let stamp = row.field(0).unwrap_or_default();
    let counts_nanos = stamp.len() >= DIGITS_BEYOND_SECONDS && stamp.bytes().all(|b| b.is_ascii_digit());
    if row.len() == 12 && matrix(row).is_ok() {
        Ok(TrajectoryFormat::Kitti)
    } else if row.len() < 8 {
        Err(row
            .error(format!("a row of {} columns is no pose", row.len()))
            .hint("known: TUM (8 columns), EuRoC CSV (8 or 17), KITTI (12), and rel:FILE (9)"))
    } else if row.separator() != Separator::Space && (counts_nanos || row.len() == EUROC_COLUMNS) {
        Ok(TrajectoryFormat::Euroc)
    } else {
        Ok(TrajectoryFormat::Tum)
    }
}

fn matrix(row: &Row<'_>) -> DataResult<WorldFromBody> {
    let upper: [f64; 12] = row.numbers(0)?;
    let mut whole = [0.0; 16];
    whole[..12].copy_from_slice(&upper);
    whole[15] = 1.0;
    Rigid::try_from_row_major(&whole).map_err(|e| row.error(e.to_string()))
}

/// Gives the poses of a KITTI file their stamps.
pub(super) fn with_times(
    path: &Path,
    poses: Vec<WorldFromBody>,
    options: &ReadOptions,
) -> DataResult<Trajectory> {
    let beside = path.with_file_name("times.txt");
    let times = match &options.times {
        Some(times) => Some(times.clone()),
        None => beside.is_file().then_some(beside),
    };
    let Some(times) = times else {
        if options.index_as_seconds {
            let stamps = (0..).map(|i: i64| Stamp::from_nanos(i * 1_000_000_000));
            return Trajectory::from_poses(stamps.zip(poses)).map_err(|e| at_line(&e, &[]).at(path));
        }
        return Err(DataError::new("a KITTI file has no stamps of its own")
            .at(path)
            .hint("put a file times.txt of seconds, one for each row, beside it, or convert it to TUM"));
    };
    let (stamps, lines) = read_times(&times).map_err(|e| e.at(&times))?;
    if stamps.len() != poses.len() {
        return Err(DataError::new(format!(
            "{} times for the {} poses of {}",
            stamps.len(),
            poses.len(),
            path.display()
        ))
        .at(&times));
    }
    Trajectory::from_poses(stamps.into_iter().zip(poses)).map_err(|e| at_line(&e, &lines).at(&times))
}

fn read_times(path: &Path) -> DataResult<(Vec<Stamp>, Vec<u64>)> {
    let mut rows = rows::open(path)?;
    let (mut stamps, mut lines) = (Vec::new(), Vec::new());
    while let Some(row) = rows.next_row()? {
        stamps.push(row.seconds(0)?);
        lines.push(row.line());
    }
    Ok((stamps, lines))
}
