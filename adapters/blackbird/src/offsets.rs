//! How high the floor is: `z_scene = z_mocap - flightNormalizationOffset.z + offset.z`, all of them in NED.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use vice_core::dataset::Plane;
use vice_core::error::{DataError, DataResult};
use vice_core::frames::World;
use vice_files::{rows, yaml};

use crate::ned::{Ned, world_from_ned};

const OFFSETS: &str = "trajectoryOffsets.yaml";
const NORMALIZATION: &str = "flightNormalizationOffset.csv";
/// Folders above a flight in which the offsets may lie.
const LEVELS_UP: usize = 4;

#[derive(Debug, Deserialize)]
struct Offsets {
    #[serde(rename = "unitySettings")]
    trajectories: BTreeMap<String, Vec<Setting>>,
}

/// A trajectory in an environment.
#[derive(Debug, Deserialize)]
struct Setting {
    name: String,
    /// x, y, z in metres, yaw in degrees.
    offset: [f64; 4],
    /// Part of the path of the flights that it is for; for all of them where there is none.
    #[serde(rename = "yawDirectionConstraint")]
    only: Option<String>,
}

/// The floor of an environment in the world of a flight's ground truth.
///
/// # Errors
/// [`DataError`] if one of the two files is missing or has no number for this flight and environment.
pub(crate) fn floor(flight: &Path, environment: &str) -> DataResult<Plane<World>> {
    let floor_z_mocap_m = normalization_z_m(flight)? - environment_z_m(flight, environment)?;
    // Its normal points up: -z + z_floor = 0.
    Ok(Plane::<Ned>::new([0.0, 0.0, -1.0], floor_z_mocap_m)?.transformed(&world_from_ned()))
}

/// The z of `flightNormalizationOffset.csv`: x, y, z in one row.
fn normalization_z_m(flight: &Path) -> DataResult<f64> {
    let path = flight.join(NORMALIZATION);
    let mut rows = rows::open(&path).map_err(|e| e.hint("the height of the floor needs it"))?;
    let row = rows.next_row().map_err(|e| e.at(&path))?;
    let row = row.ok_or_else(|| DataError::new("holds no offset").at(&path))?;
    row.expect_columns(3).and_then(|()| row.number(2)).map_err(|e| e.at(&path))
}

fn environment_z_m(flight: &Path, environment: &str) -> DataResult<f64> {
    let (path, below) = find(flight)?;
    let offsets: Offsets = yaml::read(&path)?;
    let trajectory = below.iter().next().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let settings = offsets.trajectories.get(&trajectory).ok_or_else(|| {
        let known: Vec<&str> = offsets.trajectories.keys().map(String::as_str).collect();
        DataError::new(format!("has no trajectory `{trajectory}`"))
            .at(&path)
            .hint(format!("it has: {}", known.join(", ")))
    })?;
    let place = below.to_string_lossy();
    let fits = |s: &&Setting| {
        s.name == environment && s.only.as_ref().is_none_or(|only| place.contains(only.as_str()))
    };
    let setting = settings.iter().find(fits).ok_or_else(|| {
        let known: Vec<&str> = settings.iter().map(|s| s.name.as_str()).collect();
        DataError::new(format!("has no environment `{environment}` for the flight {place}"))
            .at(&path)
            .hint(format!("for `{trajectory}` it has: {}", known.join(", ")))
    })?;
    let z_m = setting.offset[2];
    if z_m.is_finite() {
        Ok(z_m)
    } else {
        Err(DataError::new(format!("the offset of `{environment}` for `{trajectory}` is not finite"))
            .at(&path))
    }
}

/// The offsets file above a flight, and the flight's path below its folder.
fn find(flight: &Path) -> DataResult<(PathBuf, PathBuf)> {
    let real = flight.canonicalize().map_err(|e| DataError::new("cannot be read").at(flight).because(e))?;
    for root in real.ancestors().skip(1).take(LEVELS_UP) {
        let path = root.join(OFFSETS);
        if let (true, Ok(below)) = (path.is_file(), real.strip_prefix(root)) {
            return Ok((path, below.to_path_buf()));
        }
    }
    Err(DataError::new(format!("no {OFFSETS} in the folders above"))
        .at(flight)
        .hint("the height of the floor needs it; the data set has it at its root"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// As the data set's own file is laid out: other settings beside the offset, and two of one name for the two yaws.
    const FILE: &str = "\
unitySettings:
    picasso:
        - name: NYC_Subway_Station
          environment: NYC_Subway
          offset: [ -13,    0.15,    -0.35,          180]
          ros_offset: [ 1.15,  1.,   -0.9,   0.,    0.,    1.,    0.  ] # x,y,z,qx,qy,qz,qw

    # comment
    bentDice:
        - name: Ancient_Asia_Museum_Room
          yawDirectionConstraint: yawConstant
          offset: [0.0, 0.0, -0.2, 0.0]

        - name: Ancient_Asia_Museum_Room
          yawDirectionConstraint: yawForward
          offset: [ 0.19,  -0.41,    -0.48,  90.34]
";

    fn flight(root: &Path, name: &str, normalization: &str) -> PathBuf {
        let flight = root.join(name);
        fs::create_dir_all(&flight).unwrap();
        fs::write(flight.join(NORMALIZATION), normalization).unwrap();
        flight
    }

    #[test]
    fn the_lowest_point_of_a_flight_is_as_high_as_its_offset_says() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join(OFFSETS), FILE).unwrap();
        // The data set's tool takes the largest z of a flight, its lowest point, for the normalization offset. So at
        // z_mocap = -0.6 this flight is lowest, and -0.35 lifts that to 0.35 m above the floor.
        let picasso = flight(root.path(), "picasso/yawForward/maxSpeed1p0", "0.1,0.2,-0.6\n");
        let floor_of = |flight: &Path, environment| floor(flight, environment).map_err(|e| e.to_string());
        let plane = floor_of(&picasso, "NYC_Subway_Station").unwrap();
        assert_eq!(plane.normal().into_inner(), nalgebra::Vector3::z());
        let lowest = crate::ned::pose([0.0, 0.0, -0.6], [1.0, 0.0, 0.0, 0.0]).unwrap().translation();
        assert!((plane.normal().dot(&lowest) + plane.d_m() - 0.35).abs() < 1e-12);
        // The same by the formula: z_scene = z_mocap - normalization + offset, up is -z_scene.
        for z_mocap_m in [-2.0, -0.6, -0.25, 0.0] {
            let z_scene_m: f64 = z_mocap_m - -0.6 + -0.35;
            let p = crate::ned::pose([3.0, 1.0, z_mocap_m], [1.0, 0.0, 0.0, 0.0]).unwrap().translation();
            assert!((plane.normal().dot(&p) + plane.d_m() + z_scene_m).abs() < 1e-12);
        }
        let constant = flight(root.path(), "bentDice/yawConstant/maxSpeed2p0", "0,0,0");
        let forward = flight(root.path(), "bentDice/yawForward/maxSpeed2p0", "0,0,0");
        assert!((floor_of(&constant, "Ancient_Asia_Museum_Room").unwrap().d_m() - 0.2).abs() < 1e-12);
        assert!((floor_of(&forward, "Ancient_Asia_Museum_Room").unwrap().d_m() - 0.48).abs() < 1e-12);
        let unknown = floor_of(&picasso, "Attic").unwrap_err();
        assert!(
            unknown.contains("no environment `Attic`") && unknown.contains("it has: NYC_Subway_Station"),
            "{unknown}"
        );
        let star = flight(root.path(), "star/yawForward/maxSpeed2p0", "0,0,0");
        assert!(
            floor_of(&star, "x").unwrap_err().contains("no trajectory `star` (it has: bentDice, picasso)")
        );
    }

    #[test]
    fn what_the_floor_needs_is_named() {
        let root = tempfile::tempdir().unwrap();
        let picasso = flight(root.path(), "picasso/yawForward/maxSpeed1p0", "0,0\n");
        let error = |flight: &Path| floor(flight, "NYC_Subway_Station").unwrap_err().to_string();
        assert!(error(&picasso).contains("flightNormalizationOffset.csv:1: expected 3 columns, found 2"));
        fs::write(picasso.join(NORMALIZATION), "0,0,0").unwrap();
        assert!(error(&picasso).contains("no trajectoryOffsets.yaml in the folders above"));
        fs::write(root.path().join(OFFSETS), FILE.replace("-0.35", "low")).unwrap();
        assert!(
            error(&picasso).contains("trajectoryOffsets.yaml:5: is not the YAML expected"),
            "{}",
            error(&picasso)
        );
        fs::write(root.path().join(OFFSETS), FILE.replace("-0.35", ".nan")).unwrap();
        assert!(error(&picasso).contains("is not finite"));
        fs::remove_file(picasso.join(NORMALIZATION)).unwrap();
        assert!(
            error(&picasso).contains("flightNormalizationOffset.csv: no such file (the height of the floor")
        );
    }
}
