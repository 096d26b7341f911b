//! From rows to poses.

use std::io::BufRead;
use std::path::Path;

use vice_core::error::{DataError, DataResult};
use vice_core::suspicion::Suspicions;
use vice_core::time::Stamp;
use vice_core::trajectory::{PoseRow, Trajectory, TrajectoryBuilder};

use super::layout::{self, Layout, Places, PoseLayout};
use super::matrix::{MatrixCollector, MatrixPoses};
use super::{InertialRow, TrajectoryFile, at_line};
use crate::leniency::{Leniency, Order};
use crate::rows::{Row, Rows};

/// What rows of absolute poses hold.
#[derive(Clone, Debug, PartialEq)]
pub enum Parsed {
    /// Poses with stamps.
    Stamped(TrajectoryFile),
    /// Matrices, whose stamps may be elsewhere, and what was left out.
    Kitti(MatrixPoses, Leniency),
}

/// Reads rows of absolute poses in the format that names above them, or else the first of them, show.
///
/// # Errors
/// [`DataError`] with the line, as [`super::read`].
pub fn read_rows<R: BufRead>(rows: Rows<R>) -> DataResult<Parsed> {
    collect(rows, Places::Shown)
}

/// Rows of poses as they stand in a file, before they are taken for poses of the body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseRows {
    /// The poses.
    pub rows: Vec<PoseRow>,
    /// The line of each.
    pub lines: Vec<u64>,
    /// What was left out.
    pub suspicions: Suspicions,
}

/// Reads `µs, x, y, z, qw, qx, qy, qz`, or a table whose heading names the columns.
///
/// # Errors
/// [`DataError`] with path and line, as [`super::read`].
pub fn read_micros_rows(path: &Path) -> DataResult<PoseRows> {
    let read = |rows| {
        let (collected, lenient) = gather(rows, Places::Blackbird, || Kept::Rows(Vec::new(), Vec::new()))?;
        if let Collected::Poses(poses) = collected
            && let Kept::Rows(rows, lines) = poses.kept
        {
            lenient.check(rows.len(), "pose")?;
            let suspicions = lenient.suspicions(&path.display().to_string());
            return Ok(PoseRows { rows, lines, suspicions });
        }
        Err(DataError::new("the rows have no stamps"))
    };
    crate::rows::open(path).and_then(read).map_err(|e| e.at(path))
}

/// Reads rows in the ground-truth layout of EuRoC, whatever else they might be, unless names say otherwise.
pub(super) fn read_euroc_rows<R: BufRead>(rows: Rows<R>) -> DataResult<TrajectoryFile> {
    match collect(rows, Places::Euroc)? {
        Parsed::Stamped(file) => Ok(file),
        Parsed::Kitti(..) => Err(DataError::new("the rows have no stamps")),
    }
}

fn collect<R: BufRead>(rows: Rows<R>, places: Places) -> DataResult<Parsed> {
    let (collected, lenient) = gather(rows, places, Kept::poses)?;
    collected.finish(lenient)
}

fn gather<R: BufRead>(
    mut rows: Rows<R>,
    places: Places,
    kept: fn() -> Kept,
) -> DataResult<(Collected, Leniency)> {
    let beginning = rows.begin()?;
    let mut lenient = Leniency::new();
    let mut collected: Option<Collected> = None;
    while let Some(row) = rows.next_row()? {
        let collected = match &mut collected {
            Some(collected) => collected,
            None => collected.insert(Collected::new(layout::find(&beginning, &row, places)?, kept())),
        };
        lenient.row();
        collected.push(&row, &mut lenient)?;
    }
    match collected {
        Some(collected) => Ok((collected, lenient)),
        None if beginning.heading.is_some() => Err(DataError::new("the file holds a heading but no poses")),
        None => Err(DataError::new("the file is empty: it holds no poses")),
    }
}

/// Whether the first row is a pose.
pub(super) fn first_is_pose<R: BufRead>(mut rows: Rows<R>) -> DataResult<bool> {
    let beginning = rows.begin()?;
    let Some(row) = rows.next_row()? else { return Ok(false) };
    let mut collected = Collected::new(layout::find(&beginning, &row, Places::Shown)?, Kept::poses());
    collected.push(&row, &mut Leniency::new())?;
    collected.finish(Leniency::new()).map(|_| true)
}

/// The rows so far, in the layout of the first.
enum Collected {
    Poses(Box<PoseCollector>),
    Matrices(MatrixCollector),
}

impl Collected {
    fn new(layout: Layout, kept: Kept) -> Self {
        match layout {
            Layout::Poses(layout) => Self::Poses(Box::new(PoseCollector::new(layout, kept))),
            Layout::Matrices(rows) => Self::Matrices(MatrixCollector::new(rows)),
        }
    }

    fn push(&mut self, row: &Row<'_>, lenient: &mut Leniency) -> DataResult<()> {
        match self {
            Self::Poses(poses) => poses.push(row, lenient),
            Self::Matrices(matrices) => matrices.push(row, lenient),
        }
    }

    fn finish(self, lenient: Leniency) -> DataResult<Parsed> {
        match self {
            Self::Poses(poses) => poses.finish(lenient).map(Parsed::Stamped),
            Self::Matrices(matrices) => {
                let found = matrices.finish()?;
                lenient.check(found.poses.len(), "pose")?;
                Ok(Parsed::Kitti(found, lenient))
            }
        }
    }
}

/// What rows become.
enum Kept {
    /// They stay as they are, each with its line.
    Rows(Vec<PoseRow>, Vec<u64>),
    /// Poses at once. What the core refuses is said once all rows were read, and are wrong in no other way.
    Poses(TrajectoryBuilder, Option<DataError>),
}

impl Kept {
    fn poses() -> Self {
        Self::Poses(TrajectoryBuilder::default(), None)
    }

    fn push(&mut self, row: PoseRow, line: u64) {
        match self {
            Self::Rows(rows, lines) => {
                rows.push(row);
                lines.push(line);
            }
            Self::Poses(poses, refused @ None) => {
                *refused = poses.push(&row).err().map(|e| DataError::new(e.problem()).line(line));
            }
            Self::Poses(..) => {}
        }
    }
}

struct PoseCollector {
    layout: PoseLayout,
    kept: Kept,
    /// How many are kept, and the stamp of the last of them.
    count: usize,
    last_kept: Option<Stamp>,
    inertial: Vec<InertialRow>,
    /// Of the last row, kept or not.
    last: Option<Stamp>,
}

impl PoseCollector {
    const fn new(layout: PoseLayout, kept: Kept) -> Self {
        Self { layout, kept, count: 0, last_kept: None, inertial: Vec::new(), last: None }
    }

    fn push(&mut self, row: &Row<'_>, lenient: &mut Leniency) -> DataResult<()> {
        let PoseLayout { position, metres, rotation, inertial, width, .. } = self.layout;
        // Without names the columns beyond the eighth are nobody's.
        row.expect_width(if self.layout.passes_over { 8 } else { width })?;
        if row.len() == width + 1 {
            return Err(
                row.error(format!("expected {width} columns as in the first row, found {}", row.len()))
            );
        }
        if row.len() > width {
            lenient.other_width(row.line());
        }
        let parts = || position.into_iter().chain(rotation);
        if parts().any(|c| row.is_nan(c)) || parts().all(|c| row.is_missing(c)) {
            // Its stamp is read all the same, so that a broken one does not hide in a gap.
            let stamp = self.layout.time.stamp(row)?;
            self.check_order(stamp, row, lenient)?;
            lenient.gap(row.line());
            return Ok(());
        }
        let mut position_m = [0.0; 3];
        for (value, column) in position_m.iter_mut().zip(position) {
            *value = row.number(column)? * metres;
        }
        let mut rotation_wxyz = [0.0; 4];
        // In the order of the file, so that the first that is wrong is named.
        let mut order = [0, 1, 2, 3];
        order.sort_by_key(|i| rotation[*i]);
        for i in order {
            rotation_wxyz[i] = row.number(rotation[i])?;
        }
        let stamp = self.layout.time.stamp(row)?;
        self.check_order(stamp, row, lenient)?;
        if lenient.order(self.last_kept, stamp, row.line())? == Order::Again {
            return Ok(());
        }
        if let Some([velocity, gyro, accel]) = inertial {
            let vector = |columns: [usize; 3]| -> DataResult<nalgebra::Vector3<f64>> {
                let [x, y, z] = columns;
                Ok([row.number(x)?, row.number(y)?, row.number(z)?].into())
            };
            self.inertial.push(InertialRow {
                velocity_m_s: vector(velocity)?,
                gyro_bias_rad_s: vector(gyro)?,
                accel_bias_m_s2: vector(accel)?,
            });
        }
        let rotation_wxyz = lenient.quaternion(rotation_wxyz, row.line());
        self.kept.push(PoseRow { stamp, position_m, rotation_wxyz }, row.line());
        self.last_kept = Some(stamp);
        self.count += 1;
        Ok(())
    }

    /// Stamps must not run backwards, not even across rows that are left out.
    fn check_order(&mut self, stamp: Stamp, row: &Row<'_>, lenient: &mut Leniency) -> DataResult<()> {
        if self.last.is_some_and(|last| stamp < last) {
            lenient.order(self.last, stamp, row.line())?;
        }
        self.last = Some(stamp);
        Ok(())
    }

    fn finish(self, lenient: Leniency) -> DataResult<TrajectoryFile> {
        lenient.check(self.count, "pose")?;
        let columns = self.layout.passes_over.then_some(self.layout.width);
        let trajectory = match self.kept {
            Kept::Poses(_, Some(refused)) => return Err(refused),
            Kept::Poses(poses, None) => poses.finish().map_err(|e| at_line(&e, &[]))?,
            Kept::Rows(rows, lines) => Trajectory::from_rows(rows).map_err(|e| at_line(&e, &lines))?,
        };
        let mut file = TrajectoryFile::new(self.layout.format, trajectory);
        file.inertial = (!self.inertial.is_empty()).then_some(self.inertial);
        file.lenient = lenient;
        file.passed_over = columns;
        Ok(file)
    }
}
