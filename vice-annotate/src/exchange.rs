//! Labels out to files of other tools, and in from them.

use std::collections::BTreeSet;

use vice_core::error::{DataError, DataResult};
use vice_core::label::LabelSet;
use vice_core::time::Stamp;
use vice_files::labels::{read_csv, read_cvat, read_json, read_pickle, write_csv, write_cvat, write_json};

use crate::desk::Desk;
use crate::store::{Cell, Document};

/// A file format of labels that go out or come in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Exchange {
    /// `vice.labels/1`, with everything.
    Json,
    /// The interchange form.
    Csv,
    /// CVAT's XML, tracks of points.
    Cvat,
    /// The pickle of the paper's authors; in only.
    Pickle,
}

impl Exchange {
    /// By its name.
    ///
    /// # Errors
    /// [`DataError`] that lists the names.
    pub fn from_name(name: &str) -> DataResult<Self> {
        match name {
            "json" => Ok(Self::Json),
            "csv" => Ok(Self::Csv),
            "cvat" => Ok(Self::Cvat),
            "pickle" => Ok(Self::Pickle),
            _ => Err(DataError::new(format!("unknown format `{name}`: json, csv, cvat or pickle are known"))),
        }
    }

    /// Extension and content type of a file.
    pub const fn kind(self) -> (&'static str, &'static str) {
        match self {
            Self::Json => ("json", "application/json"),
            Self::Csv => ("csv", "text/csv; charset=utf-8"),
            Self::Cvat => ("xml", "application/xml"),
            Self::Pickle => ("pickle", "application/octet-stream"),
        }
    }

    /// Labels as bytes of this format.
    ///
    /// # Errors
    /// [`DataError`] for the pickle, which is only read.
    pub fn write(self, labels: &LabelSet, desk: &Desk) -> DataResult<Vec<u8>> {
        let mut bytes = Vec::new();
        let written = match self {
            Self::Json => write_json(&mut bytes, labels),
            Self::Csv => write_csv(&mut bytes, labels),
            Self::Cvat => write_cvat(&mut bytes, labels, &desk.frames),
            Self::Pickle => return Err(DataError::new("a pickle is only read: choose json, csv or cvat")),
        };
        written.map_err(|e| DataError::new("the labels cannot be written").because(e))?;
        Ok(bytes)
    }

    /// Labels from bytes of this format.
    ///
    /// # Errors
    /// [`DataError`] with the line, as the format's reader.
    pub fn read(self, bytes: &[u8], frames: &[Stamp]) -> DataResult<LabelSet> {
        match self {
            Self::Json => read_json(bytes),
            Self::Csv => read_csv(bytes),
            Self::Cvat => read_cvat(bytes, frames),
            Self::Pickle => read_pickle(bytes, frames),
        }
    }
}

/// Why labels are not taken in.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// Points of the same names are there.
    #[error("there are points of the same names already: {0}")]
    Clash(String),
    /// They do not belong here.
    #[error(transparent)]
    Refused(#[from] DataError),
}

/// The cells that add labels to a document. Points of the same name are a clash, or are replaced as a whole.
///
/// # Errors
/// [`ImportError`] for a clash, labels of another camera or data set, or labels outside the image.
pub fn import(
    labels: &LabelSet,
    document: &Document,
    desk: &Desk,
    replace: bool,
) -> Result<Vec<Cell>, ImportError> {
    if let Some(camera) = labels.camera.as_deref().filter(|c| *c != desk.camera_name) {
        let here = &desk.camera_name;
        return Err(DataError::new(format!("these are labels of the camera {camera}, not of {here}")).into());
    }
    let clashes: Vec<&str> =
        labels.points().iter().map(|p| p.name.as_str()).filter(|n| document.point(n).is_some()).collect();
    if !(clashes.is_empty() || replace) {
        return Err(ImportError::Clash(clashes.join(", ")));
    }
    let mut cells = Vec::new();
    for point in labels.points() {
        for o in &point.observations {
            let problem = if desk.frames.binary_search(&o.stamp).is_err() {
                "is at no frame of this camera"
            } else if !desk.camera.contains(o.px) {
                "lies outside the image"
            } else {
                continue;
            };
            let error = DataError::new(format!("point {} at {} ns {problem}", point.name, o.stamp));
            return Err(if o.line > 0 { error.line(o.line) } else { error }.into());
        }
        let kept: BTreeSet<Stamp> = point.observations.iter().map(|o| o.stamp).collect();
        let old = document.point(&point.name).into_iter().flat_map(|p| p.keys());
        cells.extend(old.filter(|s| !kept.contains(s)).filter_map(|s| document.cell(&point.name, *s, None)));
        cells.extend(point.observations.iter().filter_map(|o| {
            document.cell(&point.name, o.stamp, Some(vice_core::label::Observation { line: 0, ..o }))
        }));
    }
    Ok(cells)
}
