//! `vice.toml`: what a user says of a data set once for all, beside it. It is honoured by every format and every command.
//!
//! ```
//! # let text = r#"
//! calibration = "camchain.yaml"      # as --calibration takes it
//! cloud = "scan.ply"                 # the scan of the scene
//! mesh = "faces.ply"                 # its faces, for the depth source mesh; each of the two stands in for the other
//! world_from_cloud = [1, 0, 0, 0,  0, 1, 0, 0,  0, 0, 1, 0,  0, 0, 0, 1]   # or x, y, z, qx, qy, qz, qw
//! floor = [0.0, 0.0, 1.0, 0.0]       # nx, ny, nz, d of n·p + d = 0 in the world, metres
//! time_offset_s = 0.02               # added to the stamps of estimates
//! up = "-y"                          # the axis of the poses' world that points up, where that is not z
//!
//! [streams]                          # pose streams beside the data set's own; `ground-truth` is the reference
//! ground-truth = "groundtruth.txt"
//! orb = { file = "orb.txt", frame = "camera", times = "times.txt" }
//!
//! [labels]                           # taken where no labels are named
//! file = "labels.csv"
//! points = ["corner", "chair"]
//! # "#;
//! # vice_files::vice_toml::ViceToml::parse(text).unwrap();
//! ```
//!
//! A table with the name of a format, such as `[images]` or `[locobot]`, is of that format. Paths start at the file's
//! folder. A key that is not known is refused with its line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{Cloud, Rigid, World};
use vice_core::time::Span;

use crate::elsewhere;
use crate::rigid_file::from_toml;
use crate::yaml::read_text;

/// Name of the file.
pub const FILE: &str = "vice.toml";

/// Keys that every format knows; a format that has keys outside of a table of its own leaves these alone.
pub const COMMON: [&str; 9] =
    ["calibration", "cloud", "mesh", "world_from_cloud", "floor", "time_offset_s", "up", "streams", "labels"];

/// What a `vice.toml` says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViceToml {
    /// The file.
    pub path: PathBuf,
    /// A calibration file.
    pub calibration: Option<PathBuf>,
    /// A scan of the scene: what `mesh` names where there is no other.
    pub cloud: Option<PathBuf>,
    /// Faces of the scene: what `cloud` names where there are no others.
    pub mesh: Option<PathBuf>,
    /// Place of the scan in the world.
    pub world_from_cloud: Option<Rigid<World, Cloud>>,
    /// nx, ny, nz, d of the floor.
    pub floor: Option<[f64; 4]>,
    /// Added to the stamps of estimates.
    pub time_offset: Option<Span>,
    /// The axis of the world that points up.
    pub up: Option<Up>,
    /// Pose streams by name.
    pub streams: BTreeMap<String, StreamEntry>,
    /// Labels that are taken where none are named.
    pub labels: LabelsEntry,
    /// Other keys and tables with their lines: those of formats.
    others: Vec<(String, bool, u64)>,
}

/// A pose stream in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StreamEntry {
    /// The file.
    pub file: PathBuf,
    /// Whether its poses are of the first camera, not of the body.
    pub of_camera: bool,
    /// Times of a KITTI file.
    pub times: Option<PathBuf>,
}

/// Labels that are taken where none are named.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelsEntry {
    /// The file.
    pub file: Option<PathBuf>,
    /// Only these points; empty: all.
    #[serde(default)]
    pub points: Vec<String>,
}

/// An axis that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Up {
    axis: usize,
    negative: bool,
}

impl Up {
    /// `x`, `-x` and so on.
    pub fn parse(text: &str) -> Option<Self> {
        let (negative, axis) = match text.strip_prefix('-') {
            Some(rest) => (true, rest),
            None => (false, text.strip_prefix('+').unwrap_or(text)),
        };
        let axis = ["x", "y", "z"].iter().position(|a| *a == axis)?;
        Some(Self { axis, negative })
    }

    /// The text that is read as this.
    pub fn text(self) -> String {
        format!("{}{}", if self.negative { "-" } else { "" }, ["x", "y", "z"][self.axis])
    }

    /// Turns a world in which this axis points up so that z does.
    pub fn turn(self) -> Rigid<World, World> {
        let mut up = Vector3::zeros();
        up[self.axis] = if self.negative { -1.0 } else { 1.0 };
        // The axis after it becomes x: whole numbers, so that nothing is rounded.
        let mut ahead = Vector3::zeros();
        ahead[(self.axis + 1) % 3] = 1.0;
        let left = up.cross(&ahead);
        let rows = Matrix3::from_rows(&[ahead.transpose(), left.transpose(), up.transpose()]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows));
        Rigid::from_parts(Vector3::zeros(), rotation)
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Seconds {
    Whole(i64),
    Number(f64),
    Text(String),
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Stream {
    File(PathBuf),
    More(StreamTable),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StreamTable {
    file: PathBuf,
    #[serde(default)]
    frame: Option<String>,
    times: Option<PathBuf>,
}

#[derive(Deserialize)]
struct File {
    calibration: Option<PathBuf>,
    cloud: Option<PathBuf>,
    mesh: Option<PathBuf>,
    world_from_cloud: Option<Vec<f64>>,
    floor: Option<[f64; 4]>,
    time_offset_s: Option<Seconds>,
    up: Option<String>,
    #[serde(default)]
    streams: BTreeMap<String, Stream>,
    #[serde(default)]
    labels: LabelsEntry,
}

impl ViceToml {
    /// The file of a data set: for `run.bag` it is `run.bag.vice.toml`, else `vice.toml` in its folder; for a folder it is
    /// `vice.toml` in it, else `FOLDER.vice.toml` beside it. `None` where there is none.
    pub fn place(data_set: &Path) -> Option<PathBuf> {
        // What is no path of this machine has nothing beside it.
        if !data_set.exists() {
            return None;
        }
        let beside = beside(data_set);
        let inside = match data_set.is_dir() {
            true => data_set.join(FILE),
            false => data_set.parent().unwrap_or(Path::new("")).join(FILE),
        };
        let order = if data_set.is_dir() { [Some(inside), beside] } else { [beside, Some(inside)] };
        order.into_iter().flatten().find(|path| path.is_file())
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`DataError`] with path and line for what is not TOML or not what a key wants.
    pub fn read(path: &Path) -> DataResult<Self> {
        let text = match elsewhere::read(path)? {
            Some(bytes) => String::from_utf8(bytes).map_err(|_| DataError::new("is not text").at(path))?,
            None => read_text(path)?,
        };
        let mut read = Self::parse(&text).map_err(|e| e.at(path))?;
        read.path = path.to_path_buf();
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let of_streams =
            read.streams.values_mut().flat_map(|s| std::iter::once(&mut s.file).chain(&mut s.times));
        let own = [&mut read.calibration, &mut read.cloud, &mut read.mesh, &mut read.labels.file];
        for file in own.into_iter().flatten().chain(of_streams) {
            if *file != Path::new("auto") {
                *file = folder.join(&*file);
            }
        }
        Ok(read)
    }

    /// Reads the text of a file; its paths are as they stand in it.
    ///
    /// # Errors
    /// [`DataError`] with the line.
    pub fn parse(text: &str) -> DataResult<Self> {
        let file: File = from_toml(text)?;
        let wrong = |key: &str, problem: String| {
            let error = DataError::of_kind(ErrorKind::Corrupt, format!("{key}: {problem}"));
            match line_of(text, key) {
                Some(line) => error.line(line),
                None => error,
            }
        };
        let cloud = file.cloud.clone().or(file.mesh.clone());
        let mesh = file.mesh.or(file.cloud);
        let world_from_cloud =
            file.world_from_cloud.map(|n| place_of(&n).map_err(|e| wrong("world_from_cloud", e)));
        let world_from_cloud = world_from_cloud.transpose()?;
        if world_from_cloud.is_some() && cloud.is_none() {
            return Err(wrong("world_from_cloud", "places a cloud, and none is named".into()));
        }
        let seconds = match file.time_offset_s {
            None => None,
            Some(Seconds::Whole(v)) => Some(Span::parse_seconds(&v.to_string())),
            Some(Seconds::Number(v)) => Some(Span::from_secs_f64(v)),
            Some(Seconds::Text(text)) => Some(Span::parse_seconds(&text)),
        };
        let time_offset = seconds.transpose().map_err(|e| wrong("time_offset_s", e.to_string()))?;
        let up = match file.up.as_deref() {
            None => None,
            Some(word) => Some(
                Up::parse(word)
                    .ok_or_else(|| wrong("up", format!("`{word}` is none of x, y, z, -x, -y, -z")))?,
            ),
        };
        let mut streams = BTreeMap::new();
        for (name, stream) in file.streams {
            let entry = match stream {
                Stream::File(file) => StreamEntry { file, of_camera: false, times: None },
                Stream::More(table) => {
                    let of_camera = match table.frame.as_deref() {
                        None | Some("body") => false,
                        Some("camera") => true,
                        Some(other) => {
                            return Err(wrong(
                                &name,
                                format!("frame = `{other}` is neither body nor camera"),
                            ));
                        }
                    };
                    StreamEntry { file: table.file, of_camera, times: table.times }
                }
            };
            streams.insert(name, entry);
        }
        Ok(Self {
            path: PathBuf::new(),
            calibration: file.calibration,
            cloud,
            mesh,
            world_from_cloud,
            floor: file.floor,
            time_offset,
            up,
            streams,
            labels: file.labels,
            others: others(text)?,
        })
    }

    /// Refuses keys that neither every format knows nor this one: a table has the name of a format, and only the format
    /// itself knows plain keys.
    ///
    /// # Errors
    /// [`DataError`] with path and line.
    pub fn check_keys(&self, formats: &[String], settings_of_format: &[String]) -> DataResult<()> {
        let known = |key: &str, table: bool| match table {
            true => formats.iter().any(|f| f == key),
            false => settings_of_format.iter().any(|s| s == key),
        };
        match self.others.iter().find(|(key, table, _)| !known(key, *table)) {
            None => Ok(()),
            Some((key, table, line)) => {
                let what = if *table { format!("the table [{key}]") } else { format!("`{key}`") };
                Err(DataError::of_kind(ErrorKind::Corrupt, format!("{what} is not known"))
                    .at(&self.path)
                    .line(*line)
                    .hint(format!(
                        "known: {}, and tables of formats: {}",
                        COMMON.join(", "),
                        formats.join(", ")
                    )))
            }
        }
    }
}

/// `FILE.vice.toml` beside a file or folder.
pub fn beside(data_set: &Path) -> Option<PathBuf> {
    let real = data_set.file_name().map(|n| n.to_os_string())?;
    let mut name = real;
    name.push(".");
    name.push(FILE);
    Some(data_set.with_file_name(name))
}

fn place_of(numbers: &[f64]) -> Result<Rigid<World, Cloud>, String> {
    match *numbers {
        [x, y, z, qx, qy, qz, qw] => {
            Rigid::try_from_parts([x, y, z], [qw, qx, qy, qz]).map_err(|e| e.to_string())
        }
        _ => match <[f64; 16]>::try_from(numbers.to_vec()) {
            Ok(matrix) => Rigid::try_from_row_major(&matrix).map_err(|e| e.to_string()),
            Err(other) => {
                Err(format!("{} numbers, where 16 (4x4, row by row) or 7 are expected", other.len()))
            }
        },
    }
}

/// Keys at the top that are not common: whether each is a table, and its line.
fn others(text: &str) -> DataResult<Vec<(String, bool, u64)>> {
    let table: toml::Table = from_toml(text)?;
    let other = table.iter().filter(|(key, _)| !COMMON.contains(&key.as_str()));
    let mut found: Vec<(String, bool, u64)> =
        other.map(|(key, value)| (key.clone(), value.is_table(), line_of(text, key).unwrap_or(1))).collect();
    found.sort_by_key(|(_, _, line)| *line);
    Ok(found)
}

/// The first line that says something under a key.
fn line_of(text: &str, key: &str) -> Option<u64> {
    let says = |line: &str| {
        let line = line.trim_start().trim_start_matches('[').trim_start().trim_start_matches(['"', '\'']);
        let rest = line.strip_prefix(key)?;
        let rest = rest.trim_start_matches(['"', '\'']).trim_start();
        rest.starts_with(['=', ']', '.']).then_some(())
    };
    text.lines().position(|line| says(line).is_some()).map(|at| at as u64 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn what_a_file_says_is_read_from_its_folder() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        std::fs::write(
            &path,
            "calibration = \"c.yaml\"\nup = \"-y\"\nfloor = [0, 0, 1, 1.5]\ntime_offset_s = 0.02\ncloud = \"s.ply\"\n\
             world_from_cloud = [1, 2, 3, 0, 0, 0, 1]\n[streams]\na = \"a.txt\"\nb = { file = \"b.txt\", frame = \"camera\" }\n\
             [labels]\nfile = \"auto\"\n[images]\nfps = 3\n",
        )
        .unwrap();
        let read = ViceToml::read(&path).unwrap();
        assert_eq!(read.calibration, Some(folder.path().join("c.yaml")));
        assert_eq!(read.time_offset, Some(Span::from_millis(20)));
        assert_eq!(read.world_from_cloud.unwrap().translation(), Vector3::new(1.0, 2.0, 3.0));
        assert!(read.streams["b"].of_camera && !read.streams["a"].of_camera);
        assert_eq!(read.labels.file, Some(PathBuf::from("auto")), "no file");
        assert!(read.check_keys(&["images".into()], &[]).is_ok());
        let error = read.check_keys(&["locobot".into()], &[]).unwrap_err().to_string();
        assert!(error.contains("vice.toml:12: the table [images] is not known"), "{error}");
        assert_eq!(ViceToml::place(folder.path()), Some(path.clone()));
        let bag = folder.path().join("run.bag");
        assert_eq!(ViceToml::place(&bag), None, "no such recording");
        std::fs::write(&bag, "bag").unwrap();
        assert_eq!(ViceToml::place(&bag), Some(path));
        let own = folder.path().join("run.bag.vice.toml");
        std::fs::write(&own, "").unwrap();
        assert_eq!(ViceToml::place(&bag), Some(own));
    }

    #[test]
    fn mistakes_are_told_with_their_line() {
        let error = |text: &str| ViceToml::parse(text).unwrap_err().to_string();
        assert!(
            error("\nup = \"w\"\n").starts_with("line 2: up: `w` is none"),
            "{}",
            error("\nup = \"w\"\n")
        );
        assert!(error("[labels]\nfyle = \"x\"\n").contains("line 2"));
        assert!(error("world_from_cloud = [1, 2]\ncloud = \"a\"\n").contains("2 numbers"));
        assert!(error("floor = [1]\n").starts_with("line 1"));
        let read = ViceToml::parse("calibraton = \"x\"\n").unwrap();
        assert!(read.check_keys(&[], &[]).unwrap_err().to_string().contains("`calibraton` is not known"));
        assert!(read.check_keys(&[], &["calibraton".into()]).is_ok(), "a setting of the format");
    }

    #[test]
    fn up_becomes_z_without_a_mirror() {
        for text in ["x", "y", "z", "-x", "-y", "-z"] {
            let up = Up::parse(text).unwrap();
            assert_eq!(up.text(), text);
            let mut axis = Point3::origin();
            axis[up.axis] = if up.negative { -1.0 } else { 1.0 };
            let turned = up.turn().transform_point(&axis);
            assert!((turned - Point3::new(0.0, 0.0, 1.0)).norm() < 1e-12, "{text}");
            let (rotation, _) = up.turn().to_matrix_and_translation();
            assert!((rotation.determinant() - 1.0).abs() < 1e-12, "{text}");
        }
        assert_eq!(Up::parse("up"), None);
    }

    #[test]
    fn a_scan_and_its_faces_may_be_two_files() {
        let read = |text: &str| ViceToml::parse(text).unwrap();
        let path = |name: &str| Some(PathBuf::from(name));
        for (text, cloud, mesh) in [
            ("cloud = \"a.laz\"\nmesh = \"b.ply\"\n", path("a.laz"), path("b.ply")),
            ("cloud = \"a.ply\"\n", path("a.ply"), path("a.ply")),
            ("mesh = \"a.ply\"\n", path("a.ply"), path("a.ply")),
            ("up = \"z\"\n", None, None),
        ] {
            assert_eq!((read(text).cloud, read(text).mesh), (cloud, mesh), "{text}");
        }
    }
}
