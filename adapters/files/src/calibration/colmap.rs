//! The cameras of COLMAP: `cameras.txt` and `cameras.bin`.
//!
//! COLMAP's (0, 0) is the corner of the top left pixel, half a pixel from its centre.

use vice_core::error::{DataError, DataResult, ErrorKind};

use super::entry::in_camera_kind;
use super::{CalibrationFile, CameraOverride};

/// A model of COLMAP: name, how many parameters it has, and where each goes.
#[derive(Debug, PartialEq, Eq)]
pub struct ColmapModel {
    /// As COLMAP writes it.
    pub name: &'static str,
    /// How many parameters it has.
    pub parameters: usize,
    /// The core's name; `None` for those that it has not.
    ours: Option<&'static str>,
    /// Whether there is one focal length for both axes.
    one_focal: bool,
}

const fn model(
    name: &'static str,
    parameters: usize,
    ours: Option<&'static str>,
    one_focal: bool,
) -> ColmapModel {
    ColmapModel { name, parameters, ours, one_focal }
}

/// In the order of their numbers in binary files.
const MODELS: [ColmapModel; 18] = [
    model("SIMPLE_PINHOLE", 3, Some("pinhole"), true),
    model("PINHOLE", 4, Some("pinhole"), false),
    model("SIMPLE_RADIAL", 4, Some("radtan"), true),
    model("RADIAL", 5, Some("radtan"), true),
    model("OPENCV", 8, Some("radtan"), false),
    model("OPENCV_FISHEYE", 8, Some("equidistant"), false),
    model("FULL_OPENCV", 12, Some("rational"), false),
    model("FOV", 5, Some("fov"), false),
    model("SIMPLE_RADIAL_FISHEYE", 4, Some("equidistant"), true),
    model("RADIAL_FISHEYE", 5, Some("equidistant"), true),
    model("THIN_PRISM_FISHEYE", 12, None, false),
    model("RAD_TAN_THIN_PRISM_FISHEYE", 16, None, false),
    model("SIMPLE_DIVISION", 4, None, true),
    model("DIVISION", 5, None, false),
    model("SIMPLE_FISHEYE", 3, Some("equidistant"), true),
    model("FISHEYE", 4, Some("equidistant"), false),
    model("EUCM", 6, Some("eucm"), false),
    model("EQUIRECTANGULAR", 2, None, false),
];

/// Bytes of a camera in a binary file before its parameters.
const HEAD_BYTES: usize = 24;

/// Whether the text is COLMAP's: a number, a model and whole numbers in its first row.
pub(super) fn is_text(text: &str) -> bool {
    let mut rows = text.lines().map(str::trim).filter(|row| !row.is_empty() && !row.starts_with('#'));
    let Some(row) = rows.next() else {
        return text.contains("# Camera list with one line of data per camera");
    };
    let words: Vec<&str> = row.split_whitespace().collect();
    let whole = |at: usize| words.get(at).is_some_and(|word| word.parse::<u64>().is_ok());
    let name = words.get(1).is_some_and(|w| w.chars().all(|c| c.is_ascii_uppercase() || c == '_'));
    words.len() > 4 && name && whole(0) && whole(2) && whole(3)
}

/// Reads `cameras.txt`.
pub(super) fn from_text(text: &str) -> DataResult<CalibrationFile> {
    let mut file = CalibrationFile::new();
    for (number, row) in text.lines().enumerate() {
        let row = row.trim();
        if row.is_empty() || row.starts_with('#') {
            continue;
        }
        let words: Vec<&str> = row.split_whitespace().collect();
        let camera = camera_of_row(&words).map_err(|e| e.line(number as u64 + 1))?;
        insert(&mut file, words[0], camera).map_err(|e| e.line(number as u64 + 1))?;
    }
    finished(file)
}

fn camera_of_row(words: &[&str]) -> DataResult<CameraOverride> {
    let [_, name, width, height, parameters @ ..] = words else {
        return Err(DataError::new("is not the row expected: CAMERA_ID MODEL WIDTH HEIGHT PARAMS"));
    };
    let side = |word: &str| {
        word.parse::<u32>().map_err(|_| DataError::new(format!("`{word}` is no number of pixels")))
    };
    let number = |word: &&str| {
        word.parse::<f64>().map_err(|_| DataError::new(format!("the parameter `{word}` is no number")))
    };
    let parameters = parameters.iter().map(number).collect::<DataResult<Vec<f64>>>()?;
    ColmapModel::by_name(name)?.camera([side(width)?, side(height)?], &parameters)
}

/// Reads `cameras.bin`.
pub(super) fn from_bytes(bytes: &[u8]) -> DataResult<CalibrationFile> {
    let mut file = CalibrationFile::new();
    let ends = |at: usize| DataError::new("the file ends within a camera").byte(at as u64);
    let take = |at: usize, count: usize| {
        at.checked_add(count).and_then(|end| bytes.get(at..end)).ok_or_else(|| ends(bytes.len()))
    };
    let u64_at =
        |at: usize| take(at, 8).map(|b| b.iter().rev().fold(0_u64, |n, byte| n << 8 | u64::from(*byte)));
    let u32_at =
        |at: usize| take(at, 4).map(|b| b.iter().rev().fold(0_u32, |n, byte| n << 8 | u32::from(*byte)));
    let count = u64_at(0)?;
    if count > (bytes.len() / HEAD_BYTES) as u64 {
        return Err(
            DataError::new(format!("{count} cameras are announced, more than the file can hold")).byte(0)
        );
    }
    let mut at = 8;
    for _ in 0..count {
        let (id, kind) = (u32_at(at)?, u32_at(at + 4)?);
        let side = |at: usize| {
            let value = u64_at(at)?;
            u32::try_from(value)
                .map_err(|_| DataError::new(format!("{value} is no number of pixels")).byte(at as u64))
        };
        let size = [side(at + 8)?, side(at + 16)?];
        let model = ColmapModel::by_number(kind).map_err(|e| e.byte(at as u64 + 4))?;
        let first = at + HEAD_BYTES;
        let parameters = (0..model.parameters)
            .map(|i| u64_at(first + 8 * i).map(f64::from_bits))
            .collect::<DataResult<Vec<f64>>>()?;
        let camera = model.camera(size, &parameters).map_err(|e| in_camera_kind(&id.to_string(), &e))?;
        insert(&mut file, &id.to_string(), camera)?;
        at = first + 8 * model.parameters;
    }
    if at != bytes.len() {
        return Err(DataError::new("bytes are left behind the last camera").byte(at as u64));
    }
    finished(file)
}

fn insert(file: &mut CalibrationFile, name: &str, camera: CameraOverride) -> DataResult<()> {
    match file.cameras.insert(name.to_string(), camera) {
        None => Ok(()),
        Some(_) => {
            Err(DataError::of_kind(ErrorKind::Contradictory, format!("camera {name} is in the file twice")))
        }
    }
}

fn finished(mut file: CalibrationFile) -> DataResult<CalibrationFile> {
    if file.cameras.is_empty() {
        return Err(DataError::new("the list of cameras is empty"));
    }
    file.nameless = file.cameras.len() == 1;
    Ok(file)
}

fn unknown(name: &str) -> DataError {
    let known: Vec<&str> = MODELS.iter().filter(|m| m.ours.is_some()).map(|m| m.name).collect();
    DataError::of_kind(
        ErrorKind::Unsupported,
        format!("the camera model {name} of COLMAP is not read; read are {}", known.join(", ")),
    )
}

impl ColmapModel {
    /// A model by its number in binary files.
    ///
    /// # Errors
    /// [`DataError`] if COLMAP has none of that number.
    pub fn by_number(number: u32) -> DataResult<&'static Self> {
        let found = usize::try_from(number).ok().and_then(|n| MODELS.get(n));
        found.ok_or_else(|| unknown(&number.to_string()))
    }

    /// A model by its name.
    ///
    /// # Errors
    /// [`DataError`] if COLMAP has none of that name.
    pub fn by_name(name: &str) -> DataResult<&'static Self> {
        MODELS.iter().find(|m| m.name == name).ok_or_else(|| unknown(name))
    }

    /// A camera of the model: its principal point counts from the centre of the first pixel, as all here do.
    ///
    /// # Errors
    /// [`DataError`] for another number of parameters, and for a model that is not projected here.
    pub fn camera(&self, size: [u32; 2], parameters: &[f64]) -> DataResult<CameraOverride> {
        let ours = self.ours.ok_or_else(|| unknown(self.name))?;
        if parameters.len() != self.parameters {
            return Err(DataError::new(format!(
                "{} has {} parameters, not {}",
                self.name,
                self.parameters,
                parameters.len()
            )));
        }
        let (focals, rest) = parameters.split_at(if self.one_focal { 1 } else { 2 });
        let (centre, lens) = rest.split_at(2);
        let padded = |length: usize| {
            let mut all = lens.to_vec();
            all.resize(length, 0.0);
            all
        };
        let distortion = match ours {
            "radtan" | "equidistant" => padded(4),
            _ => lens.to_vec(),
        };
        Ok(CameraOverride {
            model: Some(ours.to_string()),
            resolution: Some(size),
            intrinsics: Some([focals[0], focals[focals.len() - 1], centre[0] - 0.5, centre[1] - 0.5]),
            distortion: Some(distortion),
            body_from_camera: None,
        })
    }
}
