//! Labels in files.
//!
//! | format | what |
//! | --- | --- |
//! | CSV | `point,timestamp_ns,u_px,v_px,keyframe` and optionally `source,flags,camera`: the interchange form |
//! | JSON | schema `vice.labels/1`, which also names the data set and the camera |
//! | Parquet | the same in columns, with all that JSON has: for labels by the million |
//! | CVAT | "CVAT for video 1.1", tracks of points, of the annotation tool CVAT; counts frames, as the pickle does |
//! | npy, npz | arrays of tracks, (frames, points, 2), as trackers of points write them; read by [`read_tracks`] only |
//! | pickle | `{point: {frame index: (array([x, y]), is_keyframe)}}`, as the paper's authors stored them; read only |

mod by_camera;
mod chosen;
mod csv_blocks;
mod csv_columns;
mod csv_file;
mod cvat;
mod cvat_task;
mod cvat_write;
mod json_file;
mod ndarray;
mod npy;
mod parquet;
mod pickle;
mod pickle_machine;
mod pickle_text;
mod pickle_values;
mod rounded;
mod tracks;

use std::io::{self, Write};
use std::path::Path;

use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::label::{LabelError, LabelRow, LabelSet};
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::Stamp;

pub use csv_file::{read_csv, read_csv_file, write_csv};
pub use cvat::{read_cvat, read_cvat_file};
pub use cvat_write::write_cvat;
use json_file::read_json_file;
pub use json_file::{LABELS_SCHEMA, read_json, read_json_or_none, write_json};
pub use pickle::read_pickle;
pub use tracks::{TracksOptions, is_tracks, is_tracks_file, read_tracks};

use crate::atomic::{self, Overwrite};
use crate::image_file::read_bytes;

/// A format of labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LabelFormat {
    /// The interchange form.
    Csv,
    /// Schema `vice.labels/1`.
    Json,
    /// The authors' pickle.
    Pickle,
    /// "CVAT for video 1.1".
    Cvat,
    /// In columns.
    Parquet,
}

impl LabelFormat {
    /// The format of bytes, by what they start with.
    pub fn of_content(bytes: &[u8]) -> Self {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
        match text {
            [b'P', b'A', b'R', b'1', ..] => Self::Parquet,
            // A dictionary in the protocols from 2 on, 1 and 0 of Python's pickle.
            [0x80, ..] | [b'}', ..] | [b'(', b'd', ..] => Self::Pickle,
            [b'{', ..] => Self::Json,
            [b'<', ..] => Self::Cvat,
            _ => Self::Csv,
        }
    }

    /// The format that a file to be written is meant to have.
    ///
    /// # Errors
    /// [`DataError`] if the extension is none of `csv`, `json`, `parquet` and `xml`.
    pub fn for_writing(path: &Path) -> DataResult<Self> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "csv" => Ok(Self::Csv),
            "json" => Ok(Self::Json),
            "parquet" => Ok(Self::Parquet),
            "xml" => Ok(Self::Cvat),
            _ => {
                let problem = "labels are written as .csv, .json or .parquet, or .xml for CVAT, by the name's extension";
                Err(DataError::new(problem).at(path))
            }
        }
    }
}

/// Labels as a file has them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelFile {
    /// The labels; of a file with several cameras those of the first by name.
    pub labels: LabelSet,
    /// The labels of the other cameras.
    pub of_other_cameras: Vec<LabelSet>,
    /// What was left out, and what looks wrong.
    pub suspicions: Suspicions,
    /// Columns and rows of the images that were labelled, where the file says so.
    pub image_size_px: Option<[u32; 2]>,
}

impl LabelFile {
    fn of(labels: LabelSet) -> Self {
        Self { labels, ..Self::default() }
    }

    /// Checks that the images that were labelled have the size that the camera is calibrated for.
    ///
    /// # Errors
    /// [`DataError`] with both sizes.
    pub fn check_image_size(&self, width: u32, height: u32) -> DataResult<()> {
        match self.image_size_px {
            Some([w, h]) if (w, h) != (width, height) => Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!("the images that were labelled have {w}x{h} pixels, the camera's calibration is of {width}x{height}"),
            )
            .hint("labels of images that were made smaller are pixels of those images")),
            _ => Ok(()),
        }
    }
}

/// Reads a file of labels in the format its content shows. What looks wrong is logged: see [`read_file`].
///
/// `frame_stamps` are the stamps of the camera's frames; only the authors' pickle and CVAT, which count frames, need
/// them.
///
/// # Errors
/// [`DataError`] with path and line if the file cannot be read or a row cannot be used, and if it holds labels of several
/// cameras.
pub fn read(path: impl AsRef<Path>, frame_stamps: Option<&[Stamp]>) -> DataResult<LabelSet> {
    let path = path.as_ref();
    let file = read_file(path, frame_stamps)?;
    crate::leniency::log(&file.suspicions);
    file.of_one_camera().map_err(|e| e.at(path))
}

/// As [`read`], with what was left out and what looks wrong.
///
/// # Errors
/// As [`read`], and where stamps were rounded, so that they no longer tell frames apart.
pub fn read_file(path: impl AsRef<Path>, frame_stamps: Option<&[Stamp]>) -> DataResult<LabelFile> {
    let path = path.as_ref();
    let file = if parquet::is_parquet(path)? {
        parquet::read_parquet(path, None).map_err(|e| e.at(path))?
    } else if let Some(file) = csv_blocks::read(path) {
        file
    } else {
        let bytes = read_bytes(path)?;
        if is_tracks(&bytes) {
            return Err(DataError::of_kind(
                ErrorKind::Unsupported,
                "are tracks in an array of NumPy, not labels",
            )
            .at(path)
            .hint("vice labels convert TRACKS OUT --dataset DATASET makes labels of them"));
        }
        if let Some(what) = crate::not_text::what(&bytes) {
            return Err(crate::not_text::error(what).at(path));
        }
        parsed(&bytes, frame_stamps).map_err(|e| e.at(path))?
    };
    if let Some(frames) = frame_stamps {
        for labels in std::iter::once(&file.labels).chain(&file.of_other_cameras) {
            rounded::check(labels, frames).map_err(|e| e.at(path))?;
        }
    }
    Ok(about(path, file))
}

/// As [`read_file`], of some points: memory and most of the time are those of these points where the file is a CSV without
/// quotes, each point in time order, or Parquet. What looks wrong is said of the whole file; of Parquet of these points.
///
/// # Errors
/// As [`read_file`]. A name that is no point of the file is none: all its labels are returned then.
pub fn read_points(
    path: impl AsRef<Path>,
    frame_stamps: Option<&[Stamp]>,
    points: &[String],
) -> DataResult<LabelFile> {
    let path = path.as_ref();
    if parquet::is_parquet(path)? {
        let file = parquet::read_parquet(path, Some(points)).map_err(|e| e.at(path))?;
        let stamps = || file.labels.points().iter().flat_map(|p| p.observations.stamps()).copied();
        let at_a_frame = frame_stamps.is_none_or(|f| stamps().any(|s| f.binary_search(&s).is_ok()));
        if at_a_frame && let (file, true) = of_points(file, points) {
            return Ok(about(path, file));
        }
    } else if let Some(sifted) = chosen::sift(path, points, frame_stamps) {
        let file = csv_file::read_sifted(&sifted.bytes, sifted.passed).map_err(|e| e.at(path))?;
        let frames = frame_stamps.unwrap_or_default();
        let stamps = || file.labels.points().iter().flat_map(|p| p.observations.stamps()).copied();
        // Whether stamps were rounded is asked of all of them where none is at a frame.
        if (sifted.at_a_frame || stamps().any(|s| frames.binary_search(&s).is_ok()))
            && let (file, true) = of_points(file, points)
        {
            return Ok(about(path, file));
        }
    }
    let file = read_file(path, frame_stamps)?;
    Ok(of_points(file, points).0)
}

/// The labels of some points, and whether all of these are there; as they were where one is missing.
fn of_points(file: LabelFile, points: &[String]) -> (LabelFile, bool) {
    let all = file.labels.points();
    let are_there = points.iter().all(|name| all.iter().any(|p| p.name == *name));
    if are_there && all.iter().all(|p| points.contains(&p.name)) {
        return (file, true);
    }
    match file.labels.select(points) {
        Ok(labels) => (LabelFile { labels, ..file }, true),
        Err(_) => (file, false),
    }
}

fn parsed(bytes: &[u8], frame_stamps: Option<&[Stamp]>) -> DataResult<LabelFile> {
    match LabelFormat::of_content(bytes) {
        LabelFormat::Csv => read_csv_file(bytes),
        LabelFormat::Json => read_json_file(bytes),
        LabelFormat::Pickle => frame_stamps
            .ok_or_else(|| counts_frames("a pickle"))
            .and_then(|s| read_pickle(bytes, s))
            .map(LabelFile::of),
        LabelFormat::Parquet => parquet::read_parquet_bytes(bytes),
        LabelFormat::Cvat => {
            frame_stamps.ok_or_else(|| counts_frames("CVAT")).and_then(|s| read_cvat_file(bytes, s))
        }
    }
}

/// With the file named by what looks wrong.
fn about(path: &Path, mut file: LabelFile) -> LabelFile {
    let about = path.display().to_string();
    let named = |s: Suspicion| if s.about.is_empty() { Suspicion { about: about.clone(), ..s } } else { s };
    file.suspicions = file.suspicions.into_iter().map(named).collect();
    file
}

fn counts_frames(what: &str) -> DataError {
    let problem = format!("{what} counts frames, so their stamps are needed");
    DataError::new(problem).hint("name the data set that it labels")
}

/// Writes labels as CSV, JSON or Parquet, by the extension, all or nothing. Sources and flags are kept.
///
/// # Errors
/// [`DataError`] if the extension is another one, or the file cannot be written or may not be replaced.
pub fn write(path: impl AsRef<Path>, labels: &LabelSet, overwrite: Overwrite) -> DataResult<()> {
    write_with_frames(path, labels, None, overwrite)
}

/// The same, and as CVAT's XML for the extension `xml`, which needs the stamps of the camera's frames.
///
/// # Errors
/// As [`write()`], and as [`write_cvat`].
pub fn write_with_frames(
    path: impl AsRef<Path>,
    labels: &LabelSet,
    frame_stamps: Option<&[Stamp]>,
    overwrite: Overwrite,
) -> DataResult<()> {
    let path = path.as_ref();
    let format = LabelFormat::for_writing(path)?;
    if format == LabelFormat::Cvat && frame_stamps.is_none() {
        return Err(counts_frames("CVAT").at(path));
    }
    if format == LabelFormat::Parquet {
        return parquet::write_parquet(path, labels, overwrite);
    }
    atomic::write(path, overwrite, |w: &mut (dyn Write + Send)| -> io::Result<()> {
        match format {
            LabelFormat::Json => write_json(w, labels),
            LabelFormat::Cvat => write_cvat(w, labels, frame_stamps.unwrap_or_default()),
            _ => write_csv(w, labels),
        }
    })
}

/// Rows as a validated set, with the line of the one at fault.
fn labels_from(rows: Vec<LabelRow>) -> DataResult<LabelSet> {
    if rows.is_empty() {
        return Err(no_labels());
    }
    LabelSet::from_rows(rows).map_err(label_error)
}

fn no_labels() -> DataError {
    DataError::new("the file holds no labels")
}

/// With the line of the row at fault.
fn label_error(e: LabelError) -> DataError {
    let line = e.line();
    let error = DataError::of(e);
    match line {
        Some(line) => error.line(line),
        None => error,
    }
}

#[cfg(test)]
mod tests;
