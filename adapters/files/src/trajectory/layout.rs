//! Which column of a table of poses holds what: by the names above it, else by the format that its rows show.

use vice_core::error::{DataError, DataResult, ErrorKind};

use super::TrajectoryFormat;
use super::matrix::{self, MatrixRows};
use super::relative;
use crate::columns::{Quantity, TimeUnit};
use crate::heading::{Heading, TimeColumn};
use crate::rows::{Beginning, Row, Separator};

/// Digits of an integer first column from which on it counts nanoseconds (or a smaller unit by mistake), not seconds.
const DIGITS_BEYOND_SECONDS: usize = 12;
/// Columns of a full row of EuRoC's ground truth.
const EUROC_COLUMNS: usize = 17;
/// Columns of a stamped pose.
const POSE_COLUMNS: usize = 8;

/// Columns of stamped poses.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PoseLayout {
    pub(super) format: TrajectoryFormat,
    pub(super) time: TimeColumn,
    /// x, y, z.
    pub(super) position: [usize; 3],
    /// Metres in one of the position's unit.
    pub(super) metres: f64,
    /// w, x, y, z.
    pub(super) rotation: [usize; 4],
    /// Velocity, gyro bias, accel bias.
    pub(super) inertial: Option<[[usize; 3]; 3]>,
    /// Columns of the first row, which the others must have too.
    pub(super) width: usize,
    /// Whether columns beyond those of the format are passed over without a name for them.
    pub(super) passes_over: bool,
}

/// What columns without names hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Places {
    /// What the first row shows.
    Shown,
    /// `ns,x,y,z,qw,qx,qy,qz` and optionally more, as EuRoC has it.
    Euroc,
    /// The same eight with microseconds, as Blackbird has it.
    Blackbird,
}

/// What the rows of a file are.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Layout {
    Poses(PoseLayout),
    Matrices(MatrixRows),
}

/// The layout by the heading, else by the places.
pub(super) fn find(beginning: &Beginning, row: &Row<'_>, places: Places) -> DataResult<Layout> {
    let headings = beginning.heading.iter().chain(&beginning.comments);
    for heading in headings {
        if let Some(layout) = by_names(heading, row)? {
            let time = layout.time.small_in(match places {
                Places::Shown => TimeUnit::Seconds,
                Places::Euroc => TimeUnit::Nanos,
                Places::Blackbird => TimeUnit::Micros,
            });
            return Ok(Layout::Poses(PoseLayout { time, ..layout }));
        }
    }
    match places {
        Places::Shown => by_first_row(row),
        Places::Euroc => by_place(row, TrajectoryFormat::Euroc).map(Layout::Poses),
        Places::Blackbird => {
            row.expect_columns(POSE_COLUMNS)?;
            if row.len() > POSE_COLUMNS {
                return Err(one_more(row, "the table has 8"));
            }
            let layout = by_place(row, TrajectoryFormat::Euroc)?;
            Ok(Layout::Poses(PoseLayout { time: TimeColumn::new(0, Some(TimeUnit::Micros)), ..layout }))
        }
    }
}

/// `None` where the heading is none of poses.
fn by_names(heading: &Heading, row: &Row<'_>) -> DataResult<Option<PoseLayout>> {
    let columns = row.len();
    let names_pose = heading.has(Quantity::Position) || heading.has(Quantity::Rotation);
    // A comment of another number of words may be prose.
    let certain = !heading.is_commented() || heading.names().len() == columns;
    let (position, rotation) = (heading.vector(Quantity::Position), heading.quaternion());
    let (position, rotation) = match (position, rotation) {
        _ if !names_pose => return Ok(None),
        (Ok(Some(position)), Ok(Some(rotation))) => (position, rotation),
        (Err(error), _) | (_, Err(error)) => return if certain { Err(error) } else { Ok(None) },
        _ if !certain => return Ok(None),
        (Ok(position), Ok(rotation)) => {
            return Err(incomplete(heading, position.is_some(), rotation.is_some()));
        }
    };
    if relative::names_motion(heading) {
        return Err(heading
            .error(format!("the heading names two stamps, {}: these are relative motions", heading.shown()))
            .hint("read them as rel:FILE"));
    }
    let Some(time) = heading.time()? else {
        return Err(heading
            .error(format!("the heading names a pose but no stamp: {}", heading.shown()))
            .hint("name the column of the stamps `timestamp`, with its unit: `timestamp [ns]`"));
    };
    let needed = time.columns().chain(position).chain(rotation);
    heading.check_width(columns, needed)?;
    let name = |column: usize| &heading.names()[column];
    let metres = name(position[0]).metres();
    if position.iter().any(|c| name(*c).metres() != metres) || metres.is_none() {
        let units: Vec<String> =
            position.iter().map(|c| format!("{} [{}]", name(*c).text, name(*c).unit)).collect();
        return Err(heading
            .error(format!("the unit of the position is not one length: {}", units.join(", ")))
            .hint("known: m, cm, mm, km"));
    }
    if let Some(odd) = rotation.iter().find(|c| !name(**c).unit.is_empty()) {
        return Err(heading.error(format!(
            "`{}` is in {}, but a part of a quaternion has no unit",
            name(*odd).text,
            name(*odd).unit
        )));
    }
    let inertial = match (
        heading.vector(Quantity::Velocity),
        heading.vector(Quantity::GyroBias),
        heading.vector(Quantity::AccelBias),
    ) {
        (Ok(Some(v)), Ok(Some(bg)), Ok(Some(ba))) => Some([v, bg, ba]),
        _ => None,
    };
    let inertial = inertial.filter(|all| all.iter().flatten().all(|c| *c < columns));
    let nanos_first = heading.names().first().and_then(|n| n.time_unit()) == Some(TimeUnit::Nanos)
        || row.field(0).is_some_and(counts_nanos);
    let format = match row.separator() != Separator::Space && rotation[0] < rotation[1] && nanos_first {
        true => TrajectoryFormat::Euroc,
        false => TrajectoryFormat::Tum,
    };
    Ok(Some(PoseLayout {
        format,
        time,
        position,
        metres: metres.unwrap_or(1.0),
        rotation,
        inertial,
        width: columns,
        passes_over: false,
    }))
}

fn incomplete(heading: &Heading, position: bool, rotation: bool) -> DataError {
    let names = heading.shown();
    if heading.has(Quantity::RotationByNumber) {
        return heading
            .error(format!("the heading numbers the quaternion: {names}: is the first number w or x?"))
            .hint("name its columns qw qx qy qz");
    }
    if !rotation && heading.has(Quantity::Angles) {
        return heading
            .error(format!("the heading names angles, and poses are read with quaternions: {names}"))
            .hint("convert the rotations to quaternions qx qy qz qw");
    }
    let what = match (position, rotation) {
        (true, false) => "x, y and z but no whole quaternion",
        (false, true) => "a quaternion but not x, y and z",
        _ => "neither x, y and z nor a whole quaternion",
    };
    heading
        .error(format!("the heading names {what}: {names}"))
        .hint("names such as timestamp tx ty tz qx qy qz qw are known")
}

fn counts_nanos(stamp: &str) -> bool {
    stamp.len() >= DIGITS_BEYOND_SECONDS && stamp.bytes().all(|b| b.is_ascii_digit())
}

/// Twelve columns are a matrix where they hold a rotation, else a pose with four more columns.
fn by_first_row(row: &Row<'_>) -> DataResult<Layout> {
    if let Some(matrices) = matrix::rows_of(row) {
        return Ok(Layout::Matrices(matrices));
    }
    if row.len() < POSE_COLUMNS {
        return Err(row
            .error(format!("a row of {} columns is no pose", row.len()))
            .hint("known: TUM (8 columns), EuRoC CSV (8 or 17), KITTI (12), and rel:FILE (9)"));
    }
    let stamp = row.field(0).unwrap_or_default();
    let euroc = row.separator() != Separator::Space && (counts_nanos(stamp) || row.len() == EUROC_COLUMNS);
    by_place(row, if euroc { TrajectoryFormat::Euroc } else { TrajectoryFormat::Tum }).map(Layout::Poses)
}

fn by_place(row: &Row<'_>, format: TrajectoryFormat) -> DataResult<PoseLayout> {
    let columns = row.len();
    let whole = format == TrajectoryFormat::Euroc && columns == EUROC_COLUMNS;
    let euroc = format == TrajectoryFormat::Euroc;
    // One column more or less means that something stands elsewhere than it is looked for.
    let near = columns == POSE_COLUMNS + 1 || (euroc && columns.abs_diff(EUROC_COLUMNS) == 1);
    if near {
        return Err(one_more(row, if euroc { "EuRoC has 8 or 17" } else { "TUM has 8" }));
    }
    row.expect_columns(POSE_COLUMNS)?;
    let rotation = if euroc { [4, 5, 6, 7] } else { [7, 4, 5, 6] };
    if columns > POSE_COLUMNS && !whole && !is_unit(row, rotation) {
        let (from, name) = if euroc { (5, "EuRoC has 8 or 17") } else { (5, "TUM has 8") };
        return Err(row
            .error(format!(
                "{columns} columns, where {name}, and columns {from} to {} are no unit quaternion",
                from + 3
            ))
            .hint("name the columns in a first line, such as timestamp tx ty tz qx qy qz qw"));
    }
    Ok(PoseLayout {
        format,
        time: TimeColumn::new(0, Some(if euroc { TimeUnit::Nanos } else { TimeUnit::Seconds })),
        position: [1, 2, 3],
        metres: 1.0,
        rotation,
        inertial: whole.then_some([[8, 9, 10], [11, 12, 13], [14, 15, 16]]),
        width: columns,
        passes_over: columns > POSE_COLUMNS && !whole,
    })
}

fn one_more(row: &Row<'_>, expected: &str) -> DataError {
    let first = row.field(0).unwrap_or_default();
    let index = first.len() < 10 && first.bytes().all(|b| b.is_ascii_digit());
    let index = if index { format!("; column 1 is {first}: a running number?") } else { String::new() };
    DataError::of_kind(ErrorKind::Unsupported, format!("{} columns, where {expected}{index}", row.len()))
        .line(row.line())
        .hint(
            "name the columns in a first line, such as `index timestamp tx ty tz qx qy qz qw`; relative motions are \
             read as rel:FILE",
        )
}

fn is_unit(row: &Row<'_>, rotation: [usize; 4]) -> bool {
    let parts: Option<Vec<f64>> = rotation.iter().map(|c| row.number(*c).ok()).collect();
    // A first row may be a gap.
    parts.is_none_or(|parts| {
        let length = parts.iter().map(|v| v * v).sum::<f64>().sqrt();
        (length - 1.0).abs() <= crate::leniency::SCALED_WITHIN
    })
}
