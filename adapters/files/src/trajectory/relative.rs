//! Relative motions, chained.

use std::io::BufRead;

use vice_core::error::DataResult;
use vice_core::frames::Rigid;
use vice_core::trajectory::{RelativeMotion, Trajectory};

use super::{TrajectoryFile, TrajectoryFormat, at_line};
use crate::columns::{ColumnName, Quantity, TimeUnit};
use crate::heading::{Heading, TimeColumn};
use crate::leniency::Leniency;
use crate::rows::{Row, Rows};

/// Columns of a relative motion.
const COLUMNS: usize = 9;

struct Columns {
    from: TimeColumn,
    to: TimeColumn,
    position: [usize; 3],
    rotation: [usize; 4],
    metres: f64,
    width: usize,
}

/// Reads rows of relative motions and chains them from the identity.
///
/// # Errors
/// [`DataError`](vice_core::error::DataError) with the line, as [`super::read_relative`].
pub fn read_relative_rows<R: BufRead>(mut rows: Rows<R>) -> DataResult<TrajectoryFile> {
    let (mut motions, mut lines) = (Vec::new(), Vec::new());
    let mut lenient = Leniency::new();
    let beginning = rows.begin()?;
    let mut columns: Option<Columns> = None;
    while let Some(row) = rows.next_row()? {
        let columns = match &mut columns {
            Some(columns) => columns,
            None => {
                let headings = beginning.heading.iter().chain(&beginning.comments);
                let named = headings.map(|h| by_names(h, &row)).find_map(Result::transpose).transpose()?;
                columns.insert(match named {
                    Some(named) => named,
                    None => by_place(&row)?,
                })
            }
        };
        row.expect_columns(columns.width)
            .map_err(|e| e.hint("a relative motion is `t0 t1 tx ty tz qx qy qz qw`"))?;
        if row.len() != columns.width {
            return Err(row.error(format!("expected {} columns, found {}", columns.width, row.len())));
        }
        lenient.row();
        // A motion that is missing breaks the chain: it is no gap that can be left out.
        let mut position = [0.0; 3];
        for (value, column) in position.iter_mut().zip(columns.position) {
            *value = row.number(column)? * columns.metres;
        }
        let mut rotation = [0.0; 4];
        for (value, column) in rotation.iter_mut().zip(columns.rotation) {
            *value = row.number(column)?;
        }
        let rotation = lenient.quaternion(rotation, row.line());
        let later_from_earlier =
            Rigid::try_from_parts(position, rotation).map_err(|e| row.error(e.to_string()))?;
        let (from, to) = (columns.from.stamp(&row)?, columns.to.stamp(&row)?);
        motions.push(RelativeMotion { from, to, later_from_earlier });
        lines.push(row.line());
    }
    let trajectory =
        Trajectory::from_relative(&motions, Rigid::identity()).map_err(|e| at_line(&e, &lines))?;
    let mut file = TrajectoryFile::new(TrajectoryFormat::Relative, trajectory);
    file.lenient = lenient;
    Ok(file)
}

fn by_place(row: &Row<'_>) -> DataResult<Columns> {
    row.expect_columns(COLUMNS).map_err(|e| e.hint("a relative motion is `t0 t1 tx ty tz qx qy qz qw`"))?;
    if row.len() > COLUMNS {
        return Err(row
            .error(format!("{} columns, where a relative motion has {COLUMNS}", row.len()))
            .hint("name the columns in a first line, `t0 t1 tx ty tz qx qy qz qw`"));
    }
    let seconds = |column| TimeColumn::new(column, Some(TimeUnit::Seconds));
    Ok(Columns {
        from: seconds(0),
        to: seconds(1),
        position: [2, 3, 4],
        rotation: [8, 5, 6, 7],
        metres: 1.0,
        width: COLUMNS,
    })
}

/// `None` where the heading does not name a whole motion.
fn by_names(heading: &Heading, row: &Row<'_>) -> DataResult<Option<Columns>> {
    let certain = !heading.is_commented() || heading.names().len() == row.len();
    let names_pose = heading.has(Quantity::Position) || heading.has(Quantity::Rotation);
    if !names_pose {
        return Ok(None);
    }
    let (position, rotation) = match (heading.vector(Quantity::Position), heading.quaternion()) {
        (Ok(Some(position)), Ok(Some(rotation))) => (position, rotation),
        (Err(error), _) | (_, Err(error)) if certain => return Err(error),
        _ if !certain => return Ok(None),
        _ => {
            return Err(heading
                .error(format!("the heading names no whole motion: {}", heading.shown()))
                .hint("a relative motion is `t0 t1 tx ty tz qx qy qz qw`"));
        }
    };
    let names = heading.names();
    let stamps = stamps(heading);
    let [a, b] = stamps[..] else {
        return Err(heading
            .error(format!(
                "{} columns are named as stamps, a relative motion has 2: {}",
                stamps.len(),
                heading.shown()
            ))
            .hint("a relative motion is `t0 t1 tx ty tz qx qy qz qw`"));
    };
    let (from, to) = if is_end(&names[a]) && !is_end(&names[b]) { (b, a) } else { (a, b) };
    heading.check_width(row.len(), [from, to].into_iter().chain(position).chain(rotation))?;
    let metres = names[position[0]].metres().ok_or_else(|| {
        heading.error(format!(
            "`{}` is in {}, which is no length",
            names[position[0]].text, names[position[0]].unit
        ))
    })?;
    let time = |column: usize| TimeColumn::new(column, names[column].time_unit());
    Ok(Some(Columns { from: time(from), to: time(to), position, rotation, metres, width: row.len() }))
}

/// Words of the stamp at which a motion starts, and of the one at which it ends.
const STARTS: [&str; 9] =
    ["t0", "time0", "stamp0", "timestamp0", "from", "start", "begin", "prev", "previous"];
const ENDS: [&str; 8] = ["t1", "time1", "stamp1", "timestamp1", "to", "end", "next", "later"];

fn is_end(name: &ColumnName) -> bool {
    ENDS.iter().any(|word| name.has_word(word)) || (name.text.trim_end().ends_with('1') && is_time(name))
}

fn is_time(name: &ColumnName) -> bool {
    name.meaning.is_some_and(|(quantity, _)| quantity == Quantity::Time)
}

/// The columns that are stamps of a motion by their names.
fn stamps(heading: &Heading) -> Vec<usize> {
    let names = heading.names();
    let of_motion = |name: &ColumnName| {
        name.meaning.is_none() && STARTS.iter().chain(&ENDS).any(|word| name.has_word(word))
    };
    (0..names.len()).filter(|i| is_time(&names[*i]) || of_motion(&names[*i])).collect()
}

/// Whether a heading names the two stamps of a relative motion.
pub(super) fn names_motion(heading: &Heading) -> bool {
    let names = heading.names();
    let has =
        |words: &[&str]| names.iter().any(|n| n.meaning.is_none() && words.iter().any(|w| n.has_word(w)));
    has(&STARTS) && has(&ENDS)
}
