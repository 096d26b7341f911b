//! GPS and IMU of KITTI's raw data: a file of 30 numbers for each stamp, and `timestamps.txt`.
//!
//! Latitude, longitude and altitude become metres by Mercator's projection at the first packet's latitude, as the
//! authors' development kit does it; roll, pitch and yaw are of the IMU: x forward, y left, z up, yaw from east.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};

use nalgebra::{UnitQuaternion, Vector3};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::WorldFromBody;
use vice_core::imu::ImuSample;
use vice_core::time::Stamp;

use crate::files::entries;
use crate::list::List;
use crate::parts::{Poses, Samples};
use crate::poses::collected;

/// The earth's radius of the projection, metres.
const EARTH_RADIUS_M: f64 = 6_378_137.0;

/// One packet.
struct Packet {
    stamp: Stamp,
    path: PathBuf,
    v: Vec<f64>,
}

fn packets(folder: &Path) -> DataResult<Vec<Packet>> {
    let list = List::read(&folder.join("timestamps.txt"))?;
    let data = folder.join("data");
    let files: Vec<PathBuf> =
        entries(&data)?.into_iter().filter(|p| p.extension().is_some_and(|e| e == "txt")).collect();
    if files.len() != list.rows.len() {
        return Err(DataError::of_kind(
            ErrorKind::Contradictory,
            format!("{} stamps for {} packets in {}", list.rows.len(), files.len(), data.display()),
        )
        .at(&list.path)
        .hint("one line for each file is expected"));
    }
    let mut packets = Vec::with_capacity(files.len());
    for (row, path) in list.rows.iter().zip(files) {
        let text = std::fs::read_to_string(&path)
            .map_err(|e| DataError::new("cannot be read").at(&path).because(e))?;
        let v: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse::<f64>).collect();
        let v = v.map_err(|e| DataError::new("holds what is no number").at(&path).because(e))?;
        if v.len() < 25 || v[..25].iter().any(|n| !n.is_finite()) {
            return Err(DataError::new(format!("{} numbers, where a packet has 30", v.len())).at(&path));
        }
        if v[0].abs() >= 90.0 || v[1].abs() > 180.0 {
            return Err(
                DataError::new(format!("latitude {} and longitude {} are no place", v[0], v[1])).at(&path)
            );
        }
        packets.push(Packet { stamp: row.stamp, path, v });
    }
    Ok(packets)
}

/// Poses of the IMU: x to the east, y to the north, z up, from where it started.
pub(crate) fn poses(folder: &Path) -> DataResult<Poses> {
    let packets = packets(folder)?;
    let scale = packets.first().map_or(1.0, |p| (p.v[0] * PI / 180.0).cos());
    // In the order of operations of the development kit: so far from the equator a rounding is a nanometre.
    let place = |v: &[f64]| {
        let east = scale * v[1] * PI * EARTH_RADIUS_M / 180.0;
        let north = scale * EARTH_RADIUS_M * ((90.0 + v[0]) * PI / 360.0).tan().ln();
        Vector3::new(east, north, v[2])
    };
    let origin = packets.first().map_or_else(Vector3::zeros, |p| place(&p.v));
    let mut poses = Vec::with_capacity(packets.len());
    let mut previous: Option<Stamp> = None;
    for packet in &packets {
        if previous.is_some_and(|p| p >= packet.stamp) {
            return Err(DataError::new(format!(
                "its stamp, {} ns, is not later than the one before",
                packet.stamp
            ))
            .at(&packet.path));
        }
        previous = Some(packet.stamp);
        let rotation = UnitQuaternion::from_euler_angles(packet.v[3], packet.v[4], packet.v[5]);
        poses.push((packet.stamp, WorldFromBody::from_parts(place(&packet.v) - origin, rotation)));
    }
    collected(folder, poses, Vec::new())
}

/// Rates of turn and accelerations of the IMU, rad/s and m/s².
pub(crate) fn samples(folder: &Path) -> DataResult<Samples> {
    let sample = |p: &Packet| ImuSample {
        stamp: p.stamp,
        gyro_rad_s: Vector3::new(p.v[17], p.v[18], p.v[19]),
        accel_m_s2: Vector3::new(p.v[11], p.v[12], p.v[13]),
    };
    Ok(Samples { samples: packets(folder)?.iter().map(sample).collect(), suspicions: Vec::new() })
}
