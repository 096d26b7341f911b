//! Labels in files.
//!
//! | format | what |
//! | --- | --- |
//! | CSV | `point,timestamp_ns,u_px,v_px,keyframe` and optionally `source,flags`: the interchange form |
//! | JSON | schema `vice.labels/1`, which also names the data set and the camera |
//! | CVAT | XML of the annotation tool CVAT, tracks of points; where the annotator imports and exports |
//! | pickle | `{point: {frame index: (array([x, y]), is_keyframe)}}`, as the paper's authors stored them; read only |

mod csv_file;
mod cvat;
mod json_file;
mod ndarray;
mod pickle;
mod pickle_machine;
mod pickle_text;
mod pickle_values;

use std::io::{self, Write};
use std::path::Path;

use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelError, LabelRow, LabelSet};
use vice_core::time::Stamp;

pub use csv_file::{read_csv, write_csv};
pub use cvat::{read_cvat, write_cvat};
pub use json_file::{LABELS_SCHEMA, read_json, read_json_or_none, write_json};
pub use pickle::read_pickle;

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
}

impl LabelFormat {
    /// The format of bytes, by what they start with.
    pub fn of_content(bytes: &[u8]) -> Self {
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
        match text {
            // A dictionary in the protocols from 2 on, 1 and 0 of Python's pickle.
            [0x80, ..] | [b'}', ..] | [b'(', b'd', ..] => Self::Pickle,
            [b'{', ..] => Self::Json,
            _ => Self::Csv,
        }
    }

    /// The format that a file to be written is meant to have.
    ///
    /// # Errors
    /// [`DataError`] if the extension is neither `csv` nor `json`.
    pub fn for_writing(path: &Path) -> DataResult<Self> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        match extension.to_ascii_lowercase().as_str() {
            "csv" => Ok(Self::Csv),
            "json" => Ok(Self::Json),
            _ => Err(DataError::new("labels are written as .csv or .json, by the name's extension").at(path)),
        }
    }
}

/// Reads a file of labels in the format its content shows.
///
/// `frame_stamps` are the stamps of the camera's frames; only the authors' pickle, which counts frames, needs them.
///
/// # Errors
/// [`DataError`] with path and line if the file cannot be read or a row cannot be used.
pub fn read(path: impl AsRef<Path>, frame_stamps: Option<&[Stamp]>) -> DataResult<LabelSet> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    let labels = match LabelFormat::of_content(&bytes) {
        LabelFormat::Csv => read_csv(&bytes),
        LabelFormat::Json => read_json(&bytes),
        LabelFormat::Pickle => match frame_stamps {
            Some(stamps) => read_pickle(&bytes, stamps),
            None => Err(DataError::new("a pickle counts frames, so their stamps are needed")
                .hint("name the data set that it labels")),
        },
    };
    labels.map_err(|e| e.at(path))
}

/// Writes labels as CSV or JSON, by the extension, all or nothing. Sources and flags are kept.
///
/// # Errors
/// [`DataError`] if the extension is another one, or the file cannot be written or may not be replaced.
pub fn write(path: impl AsRef<Path>, labels: &LabelSet, overwrite: Overwrite) -> DataResult<()> {
    let path = path.as_ref();
    let format = LabelFormat::for_writing(path)?;
    atomic::write(path, overwrite, |w: &mut dyn Write| -> io::Result<()> {
        match format {
            LabelFormat::Json => write_json(w, labels),
            _ => write_csv(w, labels),
        }
    })
}

/// Rows as a validated set, with the line of the one at fault.
fn labels_from(rows: Vec<LabelRow>) -> DataResult<LabelSet> {
    if rows.is_empty() { Err(no_labels()) } else { validated(rows) }
}

fn no_labels() -> DataError {
    DataError::new("the file holds no labels")
}

/// Rows, if there are any, as a validated set.
fn validated(rows: Vec<LabelRow>) -> DataResult<LabelSet> {
    LabelSet::from_rows(rows).map_err(|e| label_error(&e))
}

/// With the line of the row at fault.
fn label_error(e: &LabelError) -> DataError {
    let error = DataError::new(e.to_string());
    match e.line() {
        Some(line) => error.line(line),
        None => error,
    }
}

#[cfg(test)]
mod tests;
