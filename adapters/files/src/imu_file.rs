//! Inertial samples in a table: by the names of the columns, else `ns, gyro x y z (rad/s), accel x y z (m/s²)`.

use std::io::BufRead;
use std::path::Path;

use nalgebra::Vector3;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::imu::ImuSample;
use vice_core::statistics::middle;
use vice_core::suspicion::{Suspicion, Suspicions};

use crate::columns::{Quantity, TimeUnit};
use crate::heading::{Heading, TimeColumn};
use crate::leniency::{Leniency, Order};
use crate::rows::{self, Beginning, Row, Rows};

/// Columns where nothing names them.
const COLUMNS: usize = 7;

/// Samples as a file has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImuFile {
    /// In the frame of the sensor, strictly ordered in time.
    pub samples: Vec<ImuSample>,
    /// What was left out, and what looks wrong.
    pub suspicions: Suspicions,
}

struct Columns {
    time: TimeColumn,
    gyro: [usize; 3],
    accel: [usize; 3],
    /// Radians a second and metres a second squared in one of the file's units.
    worth: [f64; 2],
    width: usize,
}

/// Reads a table of inertial samples.
///
/// # Errors
/// [`DataError`] with path and line for names that contradict, a row of another width, an infinite number, or stamps
/// that do not increase. NaN rows are left out, and samples of one stamp but the first, as [`crate::leniency`] says.
pub fn read(path: impl AsRef<Path>) -> DataResult<ImuFile> {
    let path = path.as_ref();
    read_rows(rows::open(path)?, &path.display().to_string()).map_err(|e| e.at(path))
}

fn read_rows<R: BufRead>(mut rows: Rows<R>, about: &str) -> DataResult<ImuFile> {
    let beginning = rows.begin()?;
    let mut lenient = Leniency::new();
    let mut columns: Option<Columns> = None;
    let mut file = ImuFile::default();
    while let Some(row) = rows.next_row()? {
        let columns = match &mut columns {
            Some(columns) => columns,
            None => columns.insert(find(&beginning, &row)?),
        };
        row.expect_width(columns.width)?;
        if row.len() > columns.width {
            return Err(row.error(format!("expected {} columns, found {}", columns.width, row.len())));
        }
        lenient.row();
        let parts = || columns.gyro.into_iter().chain(columns.accel);
        let stamp = columns.time.stamp(&row)?;
        let previous = file.samples.last().map(|s: &ImuSample| s.stamp);
        if lenient.order(previous, stamp, row.line())? == Order::Again {
            continue;
        }
        if parts().any(|c| row.is_nan(c)) || parts().all(|c| row.is_missing(c)) {
            lenient.gap(row.line());
            continue;
        }
        let vector = |at: [usize; 3], worth: f64| -> DataResult<Vector3<f64>> {
            let v = Vector3::new(row.number(at[0])?, row.number(at[1])?, row.number(at[2])?);
            // Exactly as written where the unit is ours.
            Ok(if worth == 1.0 { v } else { v * worth })
        };
        let gyro_rad_s = vector(columns.gyro, columns.worth[0])?;
        let accel_m_s2 = vector(columns.accel, columns.worth[1])?;
        file.samples.push(ImuSample { stamp, gyro_rad_s, accel_m_s2 });
    }
    lenient.check(file.samples.len(), "sample")?;
    file.suspicions = lenient.suspicions(about);
    file.suspicions.extend(implausible(&file.samples, about));
    Ok(file)
}

fn find(beginning: &Beginning, row: &Row<'_>) -> DataResult<Columns> {
    for heading in beginning.heading.iter().chain(&beginning.comments) {
        if let Some(columns) = by_names(heading, row)? {
            return Ok(columns);
        }
    }
    if let Some(heading) = beginning.heading.as_ref().filter(|h| h.times().is_empty()) {
        // Not a heading, then: a first row that is broken.
        let first = heading.names().first().map_or("", |n| n.text.as_str());
        return Err(DataError::new(format!("column 1: `{first}` is no time stamp")).line(heading.line()));
    }
    row.expect_columns(COLUMNS)?;
    if row.len() > COLUMNS {
        return Err(DataError::of_kind(
            ErrorKind::Unsupported,
            format!("{} columns, where ns, gyro x y z and accel x y z are {COLUMNS}", row.len()),
        )
        .line(row.line())
        .hint("name the columns in a first line, such as `timestamp [ns],gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z`"));
    }
    Ok(Columns {
        time: TimeColumn::new(0, Some(TimeUnit::Nanos)),
        gyro: [1, 2, 3],
        accel: [4, 5, 6],
        worth: [1.0, 1.0],
        width: COLUMNS,
    })
}

/// `None` where the heading names no inertial sample.
fn by_names(heading: &Heading, row: &Row<'_>) -> DataResult<Option<Columns>> {
    if !(heading.has(Quantity::AngularRate) || heading.has(Quantity::Acceleration)) {
        return Ok(None);
    }
    let certain = !heading.is_commented() || heading.names().len() == row.len();
    let found =
        (heading.vector(Quantity::AngularRate)?, heading.vector(Quantity::Acceleration)?, heading.time()?);
    let (Some(gyro), Some(accel), Some(time)) = found else {
        if !certain {
            return Ok(None);
        }
        let lacks = match found {
            (None, _, _) => "gyro_x, gyro_y and gyro_z",
            (_, None, _) => "accel_x, accel_y and accel_z",
            _ => "a stamp",
        };
        return Err(heading.error(format!("the heading does not name {lacks}: {}", heading.shown())));
    };
    heading.check_width(row.len(), time.columns().chain(gyro).chain(accel))?;
    let names = heading.names();
    let unit = |column: usize, what: &str| {
        heading.error(format!(
            "`{}` is in {}, which is no {what} that is read",
            names[column].text, names[column].unit
        ))
    };
    let rate = names[gyro[0]].radians_per_second().ok_or_else(|| unit(gyro[0], "rate of turn"))?;
    let acceleration = names[accel[0]].metres_per_second2().ok_or_else(|| unit(accel[0], "acceleration"))?;
    let same = |columns: [usize; 3]| columns.iter().all(|c| names[*c].unit == names[columns[0]].unit);
    if !same(gyro) || !same(accel) {
        return Err(heading.error(format!("the axes of a sensor have different units: {}", heading.shown())));
    }
    let time = time.small_in(TimeUnit::Nanos);
    Ok(Some(Columns { time, gyro, accel, worth: [rate, acceleration], width: row.len() }))
}

/// Gravity tells the unit of accelerations, and which of the two sensors they are.
fn implausible(samples: &[ImuSample], about: &str) -> Option<Suspicion> {
    if samples.len() < 20 {
        return None;
    }
    let median = |length: &dyn Fn(&ImuSample) -> f64| {
        let mut lengths: Vec<f64> = samples.iter().map(length).collect();
        middle(&mut lengths, f64::total_cmp).unwrap_or(0.0)
    };
    let (gyro, accel) = (median(&|s| s.gyro_rad_s.norm()), median(&|s| s.accel_m_s2.norm()));
    let gravity = |v: f64| (8.5..11.5).contains(&v);
    let evidence = format!("half of the time more than {gyro:.2} rad/s and {accel:.2} m/s²");
    let say = |message: &str, advice: &str| {
        Some(Suspicion::new("implausible-imu", about, message).evidence(&evidence).advice(advice))
    };
    if gravity(gyro) && accel < 5.0 {
        say(
            "the rates of turn look like accelerations",
            "are the accelerations first? Name the columns in a first line",
        )
    } else if (0.85..1.15).contains(&accel) {
        say(
            "the accelerations look like multiples of gravity",
            "name their unit in a first line, such as accel_x [g]",
        )
    } else if gyro > 15.0 {
        say(
            "the rates of turn look like degrees a second",
            "name their unit in a first line, such as gyro_x [deg/s]",
        )
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> DataResult<ImuFile> {
        read_rows(Rows::new(text.as_bytes()), "imu.csv")
    }

    #[test]
    fn columns_are_found_by_their_names() {
        for text in [
            "1000000000,1,2,3,4,5,6\n",
            "timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n1000000000,1,2,3,4,5,6\n",
            "# ax,ay,az,gx,gy,gz,t_s\n4,5,6,1,2,3,1\n",
            "time,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,temperature\n1.0,4,5,6,1,2,3,20\n",
            "#timestamp [us] omega_x omega_y omega_z acc_x acc_y acc_z\n1000000 1 2 3 4 5 6\n",
            "linear_acceleration.x;linear_acceleration.y;linear_acceleration.z;angular_velocity.x;angular_velocity.y;angular_velocity.z;header.stamp.secs;header.stamp.nsecs\n4;5;6;1;2;3;1;0\n",
        ] {
            let file = read(text).unwrap_or_else(|e| panic!("{e}: {text}"));
            let sample = file.samples[0];
            assert_eq!(sample.stamp.as_nanos(), 1_000_000_000, "{text}");
            assert_eq!(
                (sample.gyro_rad_s, sample.accel_m_s2),
                (Vector3::new(1., 2., 3.), Vector3::new(4., 5., 6.)),
                "{text}"
            );
        }
        let g =
            read("t_ns,gx (deg/s),gy (deg/s),gz (deg/s),ax [g],ay [g],az [g]\n1,180,0,0,0,0,1\n").unwrap();
        assert!((g.samples[0].gyro_rad_s.x - std::f64::consts::PI).abs() < 1e-12);
        assert_eq!(g.samples[0].accel_m_s2.z, 9.806_65);
    }

    #[test]
    fn what_is_no_sample_is_named_or_left_out() {
        let says = |text: &str, expected: &str| {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        };
        says("0,1,1,2,3,4,5,6\n", "8 columns, where ns, gyro x y z and accel x y z are 7");
        says("1,1,2,3,4,5,6\n2,1,2,3,4,5,6,7\n", "line 2: expected 7 columns, found 8");
        says("t,gx,gy,gz\n1,1,2,3\n", "does not name accel_x");
        says("t,gx,gyro_x,gy,gz,ax,ay,az\n1,1,1,2,3,4,5,6\n", "`gx` and `gyro_x`");
        says("t_ns,gx [rpm],gy [rpm],gz [rpm],ax,ay,az\n1,1,2,3,4,5,6\n", "in rpm, which is no rate");
        says("1,0,0,0,0,0,inf\n", "line 1: column 7: inf is not finite");
        let file =
            read("1,0,0,0,0,0,9\n2,0,0,0,0,0,nan\n3,,,,,,\n3,0,0,0,0,0,9\n3,0,0,0,0,0,8\n4,0,0,0,0,0,9\n")
                .unwrap();
        assert_eq!(file.samples.len(), 3);
        let codes: Vec<(String, u64)> = file.suspicions.into_iter().map(|s| (s.code, s.count)).collect();
        assert_eq!(codes, [("rows-left-out".to_string(), 2), ("duplicate-stamps".to_string(), 1)]);
    }

    #[test]
    fn sensors_that_cannot_be_are_suspected() {
        let rows = |gyro: f64, accel: f64| {
            let text: String = (0..30).map(|i| format!("{i},{gyro},0,0,0,0,{accel}\n")).collect();
            read(&text).unwrap().suspicions.into_iter().map(|s| s.message).collect::<Vec<_>>()
        };
        assert!(rows(0.3, 9.81).is_empty() && rows(0.0, 0.0).is_empty());
        assert!(rows(9.81, 0.3)[0].contains("look like accelerations"));
        assert!(rows(0.3, 1.0)[0].contains("multiples of gravity"));
        assert!(rows(20.0, 9.81)[0].contains("degrees a second"));
    }
}
