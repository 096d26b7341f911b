//! What KITTI's calibration files say: lines `NAME: numbers` (cvlibs.net/datasets/kitti).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Vector3};
use vice_core::dataset::{Floor, Plane};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::{Body, Camera, Rigid};

use crate::parts::Intrinsics;

/// Height of the cameras over the road, metres, by the authors' drawing of the car.
pub(crate) const CAMERA_HEIGHT_M: f64 = 1.65;

/// The rectified cameras' own frame: that of `image_0`, in which all of them are placed without rotation.
pub(crate) type FirstCamera = Camera;

/// The lines of a calibration file.
#[derive(Debug)]
pub(crate) struct Lines {
    path: PathBuf,
    /// By name: the line, and its numbers or the first word that is none.
    entries: BTreeMap<String, (u64, Result<Vec<f64>, String>)>,
}

impl Lines {
    /// Reads a file; lines whose values are no numbers, such as dates, are an error only where they are asked for.
    ///
    /// # Errors
    /// [`DataError`] if it cannot be read.
    pub(crate) fn read(path: &Path) -> DataResult<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file").at(path),
            _ => DataError::new("cannot be read").at(path).because(e),
        })?;
        let mut entries = BTreeMap::new();
        for (line, row) in (1_u64..).zip(text.lines()) {
            let Some((key, values)) = row.split_once(':') else { continue };
            let number = |word: &str| word.parse::<f64>().map_err(|_| word.to_string());
            entries.insert(key.trim().to_string(), (line, values.split_whitespace().map(number).collect()));
        }
        Ok(Self { path: path.to_path_buf(), entries })
    }

    /// The numbers of an entry.
    ///
    /// # Errors
    /// [`DataError`] with path and line if it is not there, is not so long, or has a number that is none.
    pub(crate) fn numbers<const N: usize>(&self, key: &str) -> DataResult<[f64; N]> {
        let (line, values) = self.entries.get(key).ok_or_else(|| {
            DataError::of_kind(ErrorKind::Missing, format!("has no line `{key}:`")).at(&self.path)
        })?;
        let wrong = |problem: String| DataError::new(problem).at(&self.path).line(*line);
        let values = values.clone().map_err(|word| wrong(format!("`{key}`: `{word}` is no number")))?;
        let found = <[f64; N]>::try_from(values)
            .map_err(|v| wrong(format!("`{key}` has {} numbers, where {N} are expected", v.len())))?;
        match found.iter().all(|v| v.is_finite()) {
            true => Ok(found),
            false => Err(wrong(format!("`{key}` has a number that is not finite"))),
        }
    }

    fn error(&self, key: &str, problem: impl Into<String>) -> DataError {
        let error = DataError::new(problem).at(&self.path);
        match self.entries.get(key) {
            Some((line, _)) => error.line(*line),
            None => error,
        }
    }

    /// A rotation and a translation on two lines, or the same on one.
    pub(crate) fn rigid<A, B>(&self, rotation: &str, translation: &str) -> DataResult<Rigid<A, B>> {
        let r = self.numbers::<9>(rotation)?;
        let t = if translation.is_empty() { [0.0; 3] } else { self.numbers::<3>(translation)? };
        let m = [r[0], r[1], r[2], t[0], r[3], r[4], r[5], t[1], r[6], r[7], r[8], t[2], 0.0, 0.0, 0.0, 1.0];
        Rigid::try_from_row_major(&m).map_err(|e| self.error(rotation, format!("`{rotation}`: {e}")))
    }

    /// A camera by its projection matrix `K [I | t]`: its intrinsics, and its place in the frame of the first camera.
    ///
    /// # Errors
    /// [`DataError`] with the line if the matrix is no rectified camera's.
    pub(crate) fn projection(&self, key: &str) -> DataResult<(Intrinsics, Rigid<FirstCamera, Camera>)> {
        let p = self.numbers::<12>(key)?;
        let k = Matrix3::new(p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]);
        if p[1] != 0.0 || p[4] != 0.0 || p[8] != 0.0 || p[9] != 0.0 || (p[10] - 1.0).abs() > 1e-9 {
            return Err(self.error(key, format!("`{key}` is no projection of a rectified camera")));
        }
        let (fx, fy) = (p[0], p[5]);
        if !(fx > 0.0 && fy > 0.0) {
            return Err(self.error(key, format!("`{key}`: the focal lengths {fx} and {fy} are not positive")));
        }
        let inverse = k.try_inverse().ok_or_else(|| self.error(key, format!("`{key}` is singular")))?;
        // A point of the first camera in this one: X + K^-1 p4.
        let offset = inverse * Vector3::new(p[3], p[7], p[11]);
        let place = Rigid::from_parts(-offset, nalgebra::UnitQuaternion::identity());
        let from = self.path.display().to_string();
        Ok((Intrinsics::pinhole([fx, fy, p[2], p[6]], from), place))
    }
}

/// The road below the cameras' frame, in the body at each key frame.
pub(crate) fn road(body_from_first: &Rigid<Body, FirstCamera>) -> DataResult<Floor> {
    // y points down in the camera: 1.65 - y = 0 on the road.
    let plane = Plane::<FirstCamera>::new([0.0, -1.0, 0.0], CAMERA_HEIGHT_M)?;
    Ok(Floor::Body(plane.transformed(body_from_first)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistakes_are_named_with_their_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("calib.txt");
        std::fs::write(&path, "calib_time: 09-Jan-2012 13:57:47\nP0: 1 2 x\nP1: 1 2\nP2: 1 nan 3\n").unwrap();
        let lines = Lines::read(&path).unwrap();
        let error = |key: &str| lines.numbers::<3>(key).unwrap_err().to_string();
        assert!(error("P0").contains("calib.txt:2: `P0`: `x` is no number"), "{}", error("P0"));
        assert!(
            error("P1").contains("calib.txt:3: `P1` has 2 numbers, where 3 are expected"),
            "{}",
            error("P1")
        );
        assert!(error("P2").contains("calib.txt:4: `P2` has a number that is not finite"), "{}", error("P2"));
        assert!(error("P3").contains("has no line `P3:`"), "{}", error("P3"));
        assert!(error("calib_time").contains("calib.txt:1: "), "{}", error("calib_time"));
    }
}
