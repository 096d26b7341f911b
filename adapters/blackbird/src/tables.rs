//! Ground truth and inertial samples, read by column position: the data set's tables have no header, or one with
//! repeated names.

use std::path::Path;

use csv::{Reader, ReaderBuilder, StringRecord};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::WorldFromBody;
use vice_core::imu::ImuSample;
use vice_core::suspicion::Suspicions;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_files::columns::TimeUnit;
use vice_files::heading::TimeColumn;
use vice_files::rows;
use vice_files::trajectory::read_micros_rows;

use crate::ned;

/// Reads `groundTruthPoses.csv`: µs, x, y, z, qw, qx, qy, qz, or what a heading names; and what was left out.
///
/// # Errors
/// [`DataError`] with path and line for a row that is no pose, is too short, or is earlier than the one before.
pub(crate) fn read_poses(path: &Path) -> DataResult<(Trajectory, Suspicions)> {
    let found = read_micros_rows(path).map_err(|e| match e.problem().contains("does not fit") {
        true => e.hint("microseconds are expected; nanoseconds of today do not fit"),
        false => e,
    })?;
    let mut poses: Vec<(Stamp, WorldFromBody)> = Vec::with_capacity(found.rows.len());
    for (row, line) in found.rows.iter().zip(&found.lines) {
        let pose = ned::pose(row.position_m, row.rotation_wxyz)
            .map_err(|e| DataError::of(e).line(*line).at(path))?;
        poses.push((row.stamp, pose));
    }
    let trajectory = Trajectory::from_poses(poses).map_err(|e| DataError::of(e).at(path))?;
    Ok((trajectory, found.suspicions))
}

/// The stamp of the first pose only, to see which clock a flight is on without reading it all.
pub(crate) fn first_pose_stamp(path: &Path) -> Option<Stamp> {
    let mut rows = rows::open(path).ok()?;
    let beginning = rows.begin().ok()?;
    let heading = beginning.heading.as_ref().or(beginning.comments.first());
    let named = heading.and_then(|h| h.time().ok().flatten()).map(|t| t.small_in(TimeUnit::Micros));
    let mut time = named.unwrap_or_else(|| TimeColumn::new(0, Some(TimeUnit::Micros)));
    time.stamp(&rows.next_row().ok()??).ok()
}

/// Columns of `blackbird_slash_imu.csv` that are read, counted from 0.
mod column {
    pub(super) const SECS: usize = 4;
    pub(super) const NSECS: usize = 5;
    pub(super) const GYRO: usize = 14;
    pub(super) const ACCEL: usize = 19;
    pub(super) const COUNT: usize = 22;
}

/// Reads `blackbird_slash_imu.csv` into the body frame. Times are those of the header (columns 4 and 5): column 0 is
/// when the message was recorded, which is later.
///
/// # Errors
/// [`DataError`] with path and line for a row that is too short, has no numbers where they belong, or is not later than
/// the one before.
pub(crate) fn read_imu(path: &Path) -> DataResult<Vec<ImuSample>> {
    let mut reader = ReaderBuilder::new()
        .has_headers(true)
        .flexible(true)
        .from_path(path)
        .map_err(|e| unreadable(&e, path))?;
    read_samples(&mut reader).map_err(|e| e.at(path))
}

fn read_samples<R: std::io::Read>(reader: &mut Reader<R>) -> DataResult<Vec<ImuSample>> {
    let mut samples: Vec<ImuSample> = Vec::new();
    let mut record = StringRecord::new();
    loop {
        let line = reader.position().line();
        match reader.read_record(&mut record) {
            Ok(true) => {}
            Ok(false) => return Ok(samples),
            Err(e) => return Err(DataError::new(format!("is no CSV: {e}")).line(line)),
        }
        let line = record.position().map_or(line, csv::Position::line);
        let sample = sample(&record).map_err(|e| e.line(line))?;
        if let Some(previous) = samples.last().filter(|previous| previous.stamp >= sample.stamp) {
            let problem =
                format!("stamp {} ns is not later than the one before, {} ns", sample.stamp, previous.stamp);
            return Err(DataError::new(problem).line(line));
        }
        samples.push(sample);
    }
}

fn sample(record: &StringRecord) -> DataResult<ImuSample> {
    if record.len() < column::COUNT {
        return Err(DataError::new(format!("expected {} columns, found {}", column::COUNT, record.len())));
    }
    // A row that was cut inside a quoted list would take the rest of the file with it.
    if record.iter().any(|field| field.contains('\n')) {
        return Err(DataError::new("a quote is not closed on its line").hint("is the row cut off?"));
    }
    let whole = |at: usize, below: i64| {
        let text = record[at].trim();
        text.parse::<i64>().ok().filter(|v| (0..below).contains(v)).ok_or_else(|| {
            DataError::new(format!("column {}: `{text}` is no part of a time stamp", at + 1))
                .hint("whole seconds and the nanoseconds after them are expected")
        })
    };
    let nanos = 1_000_000_000;
    let secs = Span::from_nanos(whole(column::SECS, i64::MAX / nanos)? * nanos);
    let stamp = Stamp::from_nanos(whole(column::NSECS, nanos)?) + secs;
    let vector = |from: usize| -> DataResult<[f64; 3]> {
        let mut values = [0.0; 3];
        for (i, value) in values.iter_mut().enumerate() {
            let text = record[from + i].trim();
            *value = text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| {
                DataError::new(format!("column {}: `{text}` is no finite number", from + i + 1))
            })?;
        }
        Ok(values)
    };
    Ok(ImuSample {
        stamp,
        gyro_rad_s: ned::body_from_imu(vector(column::GYRO)?),
        accel_m_s2: ned::body_from_imu(vector(column::ACCEL)?),
    })
}

fn unreadable(error: &csv::Error, path: &Path) -> DataError {
    match error.kind() {
        csv::ErrorKind::Io(e) if e.kind() == std::io::ErrorKind::NotFound => {
            DataError::new("no such file").at(path)
        }
        _ => DataError::new(format!("cannot be read: {error}")).at(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn poses(text: &str) -> DataResult<Trajectory> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.csv");
        std::fs::write(&path, text).unwrap();
        read_poses(&path).map(|(poses, _)| poses)
    }

    fn read_with_gaps() -> (Trajectory, Suspicions) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.csv");
        std::fs::write(&path, "1,0,0,0,1,0,0,0\n2,nan,0,0,1,0,0,0\n3,0,0,0,1,0,0,0\n3,0,0,0,1,0,0,0\n")
            .unwrap();
        read_poses(&path).unwrap()
    }

    #[test]
    fn poses_are_microseconds_and_ned() {
        let t = poses("1526182346200000,1,2,-3,1,0,0,0\n1526182346205556,1,2,-3,1,0,0,0\n").unwrap();
        assert_eq!(t.start().as_nanos(), 1_526_182_346_200_000_000);
        assert_eq!(t.poses()[0].translation(), Vector3::new(1.0, -2.0, 3.0));
        for named in [
            "timestamp [us],x,y,z,qw,qx,qy,qz\n1526182346200000,1,2,-3,1,0,0,0\n",
            "# qx qy qz qw px py pz t_s\n0 0 0 1 1 2 -3 1526182346.2\n",
            "seq;time;pos_x;pos_y;pos_z;q_x;q_y;q_z;q_w\n7;1526182346200000000;1;2;-3;0;0;0;1\n",
        ] {
            let found = poses(named).unwrap();
            assert_eq!((found.start(), found.poses()[0]), (t.start(), t.poses()[0]), "{named}");
        }
        let (_, said) = read_with_gaps();
        assert_eq!(
            said.into_iter().map(|s| s.code).collect::<Vec<_>>(),
            ["rows-left-out", "duplicate-stamps"]
        );
        for (text, says) in [
            ("1,0,0,0,1,0,0,0,9\n", "p.csv:1: 9 columns, where the table has 8"),
            ("1,0,0,0,1,0,0\n", "p.csv:1: expected 8 columns, found 7"),
            ("1,0,0,0,1,0,0,0\n1,0,0,0,1,0,0,0\n", "p.csv:2: stamp 1000 ns appears twice"),
            ("1,0,0,0,2,0,0,0\n", "p.csv:1: the quaternion has length 2"),
            ("1,nan,0,0,1,0,0,0\n", "p.csv:1: none of the 1 rows has a pose"),
            ("1526182346200000000,0,0,0,1,0,0,0\n", "microseconds are expected"),
            ("", "no poses"),
        ] {
            let error = poses(text).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
        assert!(
            read_poses(Path::new("none.csv")).unwrap_err().to_string().contains("none.csv: no such file")
        );
    }

    const HEAD: &str = "t,header,seq,stamp,secs,nsecs,id,o,x,y,z,w,oc,av,x,y,z,avc,la,x,y,z,lac\n";

    fn imu(rows: &str) -> DataResult<Vec<ImuSample>> {
        read_samples(&mut ReaderBuilder::new().flexible(true).from_reader(format!("{HEAD}{rows}").as_bytes()))
    }

    fn row(secs: &str, nsecs: &str) -> String {
        let zeros = "\"[0.0, 0.0, 0.0]\"";
        format!("99,,0,,{secs},{nsecs},uav/imu,,0,0,0,1,{zeros},,0.1,0.2,0.3,{zeros},,1,2,-9.8,{zeros}\n")
    }

    #[test]
    fn samples_are_read_by_position_with_the_time_of_the_header() {
        let samples = imu(&(row("1526182346", "246347174") + &row("1526182346", "256416166"))).unwrap();
        assert_eq!(samples.len(), 2);
        assert_eq!(samples[0].stamp.as_nanos(), 1_526_182_346_246_347_174);
        assert_eq!(samples[0].gyro_rad_s, Vector3::new(-0.2, 0.1, 0.3));
        assert_eq!(samples[0].accel_m_s2, Vector3::new(-2.0, 1.0, -9.8));
        assert!(imu("").unwrap().is_empty());
    }

    #[test]
    fn rows_that_are_no_samples_are_named() {
        let good = row("1", "5");
        for (bad, says) in [
            ("1,2,3\n".to_string(), "line 3: expected 22 columns, found 3"),
            (row("1", "5"), "line 3: stamp 1000000005 ns is not later"),
            (row("1", "1000000000"), "line 3: column 6: `1000000000` is no part of a time stamp"),
            (row("1526182346246347174", "0"), "line 3: column 5"),
            (row("-1", "0"), "line 3: column 5"),
            (row("1", "6").replace("0.0]\"\n", "\n") + &row("1", "7"), "line 3: a quote is not closed"),
            (row("2", "0").replace("0.2", "inf"), "line 3: column 16: `inf` is no finite number"),
        ] {
            let error = imu(&(good.clone() + &bad)).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
        let missing = read_imu(Path::new("none.csv")).unwrap_err().to_string();
        assert!(missing.contains("none.csv: no such file"), "{missing}");
    }
}
