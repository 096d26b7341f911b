//! A rigid transform in a file: the place of an estimate's frame in the body.
//!
//! TOML or YAML with a row-major 4x4 matrix that takes coordinates in the estimate's frame to the body, metres:
//! ```toml
//! body_from_estimate = [0, -1, 0, 0.02,  1, 0, 0, -0.06,  0, 0, 1, 0.01,  0, 0, 0, 1]
//! ```
//! or `T_BS` as the `sensor.yaml` of an EuRoC sensor has it.

use std::path::Path;

use serde::Deserialize;
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Body, Cloud, Rigid, Sensor, World};

use crate::yaml;

/// A 4x4 matrix as files have it: 16 numbers row by row, four rows of four, or OpenCV's `{rows, cols, data}`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Matrix4 {
    /// Row by row.
    Flat(Vec<f64>),
    /// Rows of numbers.
    Rows(Vec<Vec<f64>>),
    /// With its size.
    OpenCv {
        /// Number of rows.
        #[serde(default = "four")]
        rows: usize,
        /// Number of columns.
        #[serde(default = "four")]
        cols: usize,
        /// Row by row.
        data: Vec<f64>,
    },
}

const fn four() -> usize {
    4
}

impl Matrix4 {
    /// The transform that the matrix is, from the frame `Src` to the frame `Dst`.
    ///
    /// # Errors
    /// [`DataError`] that starts with `name` if it is not 4x4 or its upper left part is no rotation.
    pub fn to_rigid<Dst, Src>(&self, name: &str) -> DataResult<Rigid<Dst, Src>> {
        let (rows, numbers): (usize, Vec<f64>) = match self {
            Self::Flat(data) => (4, data.clone()),
            Self::Rows(rows) => (rows.len(), rows.concat()),
            Self::OpenCv { rows, cols, data } if *cols == 4 => (*rows, data.clone()),
            Self::OpenCv { data, .. } => (0, data.clone()),
        };
        let ragged = matches!(self, Self::Rows(rows) if rows.iter().any(|r| r.len() != 4));
        match <[f64; 16]>::try_from(numbers) {
            Ok(m) if rows == 4 && !ragged => {
                Rigid::try_from_row_major(&m).map_err(|e| DataError::new(format!("{name}: {e}")))
            }
            Ok(_) => Err(DataError::new(format!("{name} is not 4x4"))),
            Err(other) => Err(DataError::new(format!("{name} has {} numbers, not 4x4", other.len()))),
        }
    }
}

/// Nothing but numbers, as NumPy writes a matrix.
fn plain(text: &str) -> Option<Matrix4> {
    let numbers = text.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
    let numbers: Result<Vec<f64>, _> = numbers.map(str::parse).collect();
    Some(Matrix4::Flat(numbers.ok().filter(|n| !n.is_empty())?))
}

#[derive(Deserialize)]
struct File {
    body_from_estimate: Option<Matrix4>,
    #[serde(rename = "T_BS")]
    t_bs: Option<Matrix4>,
}

/// Reads `body_from_estimate`: takes coordinates in the frame whose poses an estimate gives to the body.
///
/// # Errors
/// [`DataError`] with the path if the file cannot be read, has no such matrix, or it is no rigid transform.
pub fn read(path: impl AsRef<Path>) -> DataResult<Rigid<Body, Sensor>> {
    let path = path.as_ref();
    let text = yaml::read_text(path)?;
    if let Some(matrix) = plain(&text) {
        return matrix.to_rigid("the matrix").map_err(|e| e.at(path));
    }
    let file: File =
        if is_toml(path) { from_toml(&text) } else { yaml::parse(&text) }.map_err(|e| e.at(path))?;
    let rigid = match (file.body_from_estimate, file.t_bs) {
        (Some(matrix), None) => matrix.to_rigid("body_from_estimate"),
        (None, Some(matrix)) => matrix.to_rigid("T_BS"),
        (Some(_), Some(_)) => Err(DataError::new("both body_from_estimate and T_BS are given")),
        (None, None) => Err(DataError::new("no transform is given")
            .hint("body_from_estimate = [16 numbers, row by row], or T_BS as EuRoC's sensor.yaml has it")),
    };
    rigid.map_err(|e| e.at(path))
}

#[derive(Deserialize)]
struct CloudFile {
    #[serde(alias = "T_world_cloud")]
    world_from_cloud: Option<Matrix4>,
    #[serde(rename = "T_WR")]
    t_wr: Option<Matrix4>,
}

/// Reads `world_from_cloud`, which takes coordinates of a scan to the world: 4x4 numbers row by row (three rows do as
/// well), a pose as a TUM file has it (x y z qx qy qz qw, a stamp before it is passed over), or TOML or YAML with that key.
///
/// # Errors
/// [`DataError`] with the path if the file cannot be read, has no such transform, or it is not rigid.
pub fn read_world_from_cloud(path: impl AsRef<Path>) -> DataResult<Rigid<World, Cloud>> {
    let path = path.as_ref();
    let text = yaml::read_text(path)?;
    let rows = text.lines().map(str::trim).filter(|row| !row.is_empty() && !row.starts_with('#'));
    let bare = rows.collect::<Vec<_>>().join("\n");
    let rigid = match plain(&bare) {
        Some(Matrix4::Flat(numbers)) => of_numbers(&numbers),
        _ => {
            let file: CloudFile =
                if is_toml(path) { from_toml(&text) } else { yaml::parse(&text) }.map_err(|e| e.at(path))?;
            match (file.world_from_cloud, file.t_wr) {
                (Some(matrix), None) => matrix.to_rigid("world_from_cloud"),
                (None, Some(matrix)) => matrix.to_rigid("T_WR"),
                (Some(_), Some(_)) => Err(DataError::new("both world_from_cloud and T_WR are given")),
                (None, None) => Err(DataError::new("no transform is given")
                    .hint("world_from_cloud = [16 numbers, row by row], or x y z qx qy qz qw")),
            }
        }
    };
    rigid.map_err(|e| e.at(path))
}

/// A pose or a matrix as nothing but numbers.
fn of_numbers(numbers: &[f64]) -> DataResult<Rigid<World, Cloud>> {
    let pose = |n: &[f64]| {
        Rigid::try_from_parts([n[0], n[1], n[2]], [n[6], n[3], n[4], n[5]])
            .map_err(|e| DataError::new(format!("the pose: {e}")))
    };
    match numbers.len() {
        7 => pose(numbers),
        8 => pose(&numbers[1..]),
        12 => {
            let mut matrix = numbers.to_vec();
            matrix.extend([0.0, 0.0, 0.0, 1.0]);
            Matrix4::Flat(matrix).to_rigid("the matrix")
        }
        16 => Matrix4::Flat(numbers.to_vec()).to_rigid("the matrix"),
        n => Err(DataError::new(format!(
            "{n} numbers are neither a pose (x y z qx qy qz qw) nor a matrix of 3x4 or 4x4"
        ))),
    }
}

pub(crate) fn is_toml(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// TOML as `T`, with the line of what is wrong.
///
/// # Errors
/// [`DataError`] with the line.
pub fn from_toml<T: serde::de::DeserializeOwned>(text: &str) -> DataResult<T> {
    toml::from_str(text).map_err(|e| {
        let error = DataError::new(format!("is not the TOML expected: {}", e.message().replace('\n', " ")));
        match e.span() {
            Some(span) => {
                let before = text.as_bytes().get(..span.start).unwrap_or_default();
                error.line(before.iter().filter(|b| **b == b'\n').count() as u64 + 1)
            }
            None => error,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_as(name: &str, text: &str) -> DataResult<Rigid<Body, Sensor>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        read(&path)
    }

    #[test]
    fn every_form_of_a_matrix_is_read() {
        let flat = "[0, -1, 0, 0.5, 1, 0, 0, -2, 0, 0, 1, 3e-1, 0, 0, 0, 1]";
        let nested = "[[0, -1, 0, 0.5], [1.0, 0, 0, -2], [0, 0, 1, 3e-1], [0, 0, 0, 1]]";
        let forms = [
            read_as("a.toml", &format!("body_from_estimate = {flat}")),
            read_as("a.toml", &format!("body_from_estimate = {nested}")),
            read_as("a.yaml", &format!("body_from_estimate: {flat}\n")),
            read_as(
                "a.yaml",
                &format!("%YAML:1.0\nrate_hz: 20\nT_BS:\n  cols: 4\n  rows: 4\n  data: {flat}\n"),
            ),
            read_as(
                "a.yml",
                &format!("T_BS: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: d\n  data: {flat}\n"),
            ),
        ];
        for form in forms {
            let rigid = form.unwrap();
            assert_eq!(rigid.translation(), nalgebra::Vector3::new(0.5, -2.0, 0.3));
            let x = rigid.rotate(&[1.0, 0.0, 0.0].into());
            assert!((x.y - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_place_of_a_cloud_is_a_pose_or_a_matrix() {
        let folder = tempfile::tempdir().unwrap();
        let read = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            read_world_from_cloud(&path)
        };
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let pose = format!("461000.5 5428000 3 0 0 {half} {half}");
        let rows = "0 -1 0 461000.5\n1 0 0 5428000\n0 0 1 3\n";
        for text in [
            format!("# x y z qx qy qz qw\n{pose}\n"),
            format!("1403636579.5 {pose}\n"),
            rows.to_string(),
            format!("{rows}0 0 0 1\n"),
            "world_from_cloud: [0, -1, 0, 461000.5, 1, 0, 0, 5428000, 0, 0, 1, 3, 0, 0, 0, 1]\n".to_string(),
        ] {
            let rigid = read("place.txt", &text).unwrap();
            assert_eq!(rigid.translation(), nalgebra::Vector3::new(461_000.5, 5_428_000.0, 3.0), "{text}");
            assert!((rigid.rotate(&[1.0, 0.0, 0.0].into()).y - 1.0).abs() < 1e-12, "{text}");
        }
        for (text, expected) in [
            ("1 2 3\n", "3 numbers are neither a pose"),
            ("1 2 3 0 0 0 0\n", "place.txt: the pose"),
            ("x: 1\n", "no transform is given"),
            ("2 0 0 0 0 1 0 0 0 0 1 0\n", "place.txt: the matrix"),
        ] {
            let error = read("place.txt", text).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn what_is_no_transform_is_refused() {
        let says = |name, text: &str, expected: &str| {
            let error = read_as(name, text).unwrap_err().to_string();
            assert!(error.contains(expected) && error.contains(name), "{error}");
        };
        says("a.toml", "x = 1", "no transform is given");
        says("a.toml", "body_from_estimate = [1, 2]", "has 2 numbers, not 4x4");
        says("a.toml", "body_from_estimate = [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]", "orthonormal");
        says("a.toml", "body_from_estimate = [1,0,0,0, 0,1,0,nan, 0,0,1,0, 0,0,0,1]", "not finite");
        says("a.toml", "\n\nbody_from_estimate = [", "a.toml:3: is not the TOML expected");
        says("a.yaml", "T_BS: {rows: 2, cols: 8, data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}", "not 4x4");
    }
}
