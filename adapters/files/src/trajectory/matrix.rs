//! Poses as matrices: KITTI's twelve numbers, also as a whole 4x4 and behind a running number or a stamp.

use std::path::Path;

use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Rigid, WorldFromBody};
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

use super::{ReadOptions, at_line};
use crate::heading::TimeColumn;
use crate::leniency::Leniency;
use crate::rows::{self, Row};

/// Integers beyond this are no running numbers.
const LARGEST_INDEX: i64 = 100_000_000;

/// Where the matrix stands in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MatrixRows {
    /// Its first column: 1 behind a running number or a stamp.
    from: usize,
    /// 12 or 16.
    numbers: usize,
}

/// How the rows of a file of matrices are told apart.
#[derive(Clone, Debug, PartialEq)]
pub enum MatrixStamps {
    /// By their order.
    Order,
    /// By a running number in the first column.
    Index(Vec<u64>),
    /// By their own stamps.
    Stamps(Vec<Stamp>),
}

/// The poses of a file of matrices.
#[derive(Clone, Debug, PartialEq)]
pub struct MatrixPoses {
    /// How the rows are told apart.
    pub stamps: MatrixStamps,
    /// Their poses.
    pub poses: Vec<WorldFromBody>,
    pub(super) lines: Vec<u64>,
    pub(super) left_out: Vec<usize>,
}

/// Whether the numbers of a row are a matrix with a rotation.
pub(super) fn rows_of(row: &Row<'_>) -> Option<MatrixRows> {
    let (from, numbers) = match row.len() {
        12 => (0, 12),
        13 => (1, 12),
        16 => (0, 16),
        17 => (1, 16),
        _ => return None,
    };
    let rows = MatrixRows { from, numbers };
    rows.pose(row).is_ok().then_some(rows)
}

impl MatrixRows {
    fn width(self) -> usize {
        self.from + self.numbers
    }

    fn pose(self, row: &Row<'_>) -> DataResult<WorldFromBody> {
        let upper: [f64; 12] = row.numbers(self.from)?;
        let mut whole = [0.0; 16];
        whole[..12].copy_from_slice(&upper);
        whole[15] = 1.0;
        if self.numbers == 16 {
            let last: [f64; 4] = row.numbers(self.from + 12)?;
            whole[12..].copy_from_slice(&last);
        }
        Rigid::try_from_row_major(&whole).map_err(|e| row.error(e.to_string()))
    }
}

/// The rows so far.
pub(super) struct MatrixCollector {
    rows: MatrixRows,
    poses: Vec<WorldFromBody>,
    firsts: Vec<String>,
    lines: Vec<u64>,
    /// Places in the order of rows that are gaps.
    left_out: Vec<usize>,
    seen: usize,
}

impl MatrixCollector {
    pub(super) const fn new(rows: MatrixRows) -> Self {
        Self { rows, poses: Vec::new(), firsts: Vec::new(), lines: Vec::new(), left_out: Vec::new(), seen: 0 }
    }

    pub(super) fn push(&mut self, row: &Row<'_>, lenient: &mut Leniency) -> DataResult<()> {
        let width = self.rows.width();
        row.expect_columns(width)?;
        if row.len() != width {
            return Err(
                row.error(format!("expected {width} columns as in the first row, found {}", row.len()))
            );
        }
        self.seen += 1;
        if (self.rows.from..width).any(|c| row.is_nan(c)) {
            self.left_out.push(self.seen - 1);
            lenient.gap(row.line());
            return Ok(());
        }
        self.poses.push(self.rows.pose(row)?);
        if self.rows.from > 0 {
            self.firsts.push(row.field(0).unwrap_or_default().to_string());
        }
        self.lines.push(row.line());
        Ok(())
    }

    pub(super) fn finish(self) -> DataResult<MatrixPoses> {
        let Self { rows, poses, firsts, lines, left_out, .. } = self;
        let stamps = match rows.from {
            0 => MatrixStamps::Order,
            _ => match indices(&firsts) {
                Some(index) => MatrixStamps::Index(index),
                None => MatrixStamps::Stamps(own_stamps(&firsts, &lines)?),
            },
        };
        Ok(MatrixPoses { stamps, poses, lines, left_out })
    }
}

/// Whole numbers that go up from row to row, too small for a stamp.
fn indices(firsts: &[String]) -> Option<Vec<u64>> {
    let number = |text: &String| {
        // `3.0` and `3.000000e+00` are whole, as NumPy writes them.
        let value: f64 = text.parse().ok()?;
        let whole = value.fract() == 0.0 && (0.0..LARGEST_INDEX as f64).contains(&value);
        whole.then_some(value as u64)
    };
    let numbers: Vec<u64> = firsts.iter().map(number).collect::<Option<_>>()?;
    numbers.windows(2).all(|w| w[0] < w[1]).then_some(numbers)
}

fn own_stamps(firsts: &[String], lines: &[u64]) -> DataResult<Vec<Stamp>> {
    let mut time = TimeColumn::new(0, None);
    let mut stamps = Vec::with_capacity(firsts.len());
    for (text, line) in firsts.iter().zip(lines) {
        let mut one = rows::Rows::new(text.as_bytes());
        let row = one.next_row()?.ok_or_else(|| DataError::new("column 1 is empty").line(*line))?;
        stamps.push(time.stamp(&row).map_err(|e| DataError::new(e.problem()).line(*line))?);
    }
    Ok(stamps)
}

/// Gives the poses of a file of matrices their stamps.
pub(super) fn with_times(path: &Path, found: MatrixPoses, options: &ReadOptions) -> DataResult<Trajectory> {
    let MatrixPoses { stamps, poses, lines, left_out } = found;
    if let MatrixStamps::Stamps(stamps) = stamps {
        return Trajectory::from_poses(stamps.into_iter().zip(poses))
            .map_err(|e| at_line(&e, &lines).at(path));
    }
    let beside = path.with_file_name("times.txt");
    let times = match &options.times {
        Some(times) => Some(times.clone()),
        None => beside.is_file().then_some(beside),
    };
    let rows = poses.len() + left_out.len();
    // The place of each pose in the list of times.
    let (places, by_index): (Vec<u64>, bool) = match stamps {
        MatrixStamps::Index(index) => (index, true),
        _ => ((0..rows).filter(|i| left_out.binary_search(i).is_err()).map(|i| i as u64).collect(), false),
    };
    let Some(times) = times else {
        if options.index_as_seconds {
            let seconds =
                |i: u64| Stamp::from_nanos(i64::try_from(i).unwrap_or(0).saturating_mul(1_000_000_000));
            let stamped = places.into_iter().map(seconds).zip(poses);
            return Trajectory::from_poses(stamped).map_err(|e| at_line(&e, &lines).at(path));
        }
        let what = if by_index { "a KITTI file with a running number" } else { "a KITTI file" };
        return Err(DataError::new(format!("{what} has no stamps of its own"))
            .at(path)
            .hint("put a file times.txt of seconds, one for each row, beside it, or convert it to TUM"));
    };
    let (stamps, time_lines) = read_times(&times).map_err(|e| e.at(&times))?;
    let fits =
        if by_index { places.last().is_none_or(|i| *i < stamps.len() as u64) } else { stamps.len() == rows };
    if !fits {
        let of = match by_index {
            true => format!("the number {} of", places.last().copied().unwrap_or(0)),
            false => format!("the {rows} poses of"),
        };
        return Err(DataError::new(format!("{} times for {of} {}", stamps.len(), path.display())).at(&times));
    }
    let lines: Vec<u64> =
        places.iter().filter_map(|i| time_lines.get(usize::try_from(*i).ok()?).copied()).collect();
    let stamped = places.iter().filter_map(|i| stamps.get(usize::try_from(*i).ok()?).copied()).zip(poses);
    Trajectory::from_poses(stamped).map_err(|e| at_line(&e, &lines).at(&times))
}

fn read_times(path: &Path) -> DataResult<(Vec<Stamp>, Vec<u64>)> {
    let mut rows = rows::open(path)?;
    let beginning = rows.begin()?;
    let mut time = match beginning.heading.as_ref().map(|h| h.time()).transpose()? {
        Some(Some(time)) => time,
        _ => TimeColumn::new(0, Some(crate::columns::TimeUnit::Seconds)),
    };
    let (mut stamps, mut lines) = (Vec::new(), Vec::new());
    while let Some(row) = rows.next_row()? {
        stamps.push(time.stamp(&row)?);
        lines.push(row.line());
    }
    Ok((stamps, lines))
}
