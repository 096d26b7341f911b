//! Labels as JSON, schema `vice.labels/1`.
//!
//! ```json
//! {"schema": "vice.labels/1", "dataset": "V1_01_easy", "camera": "cam0", "points": [
//!   {"name": "0", "observations": [
//!     {"timestamp_ns": 1403715280562142976, "px": [657.0, 383.0], "keyframe": true, "source": "manual",
//!      "occluded": false, "uncertain": false}]}]}
//! ```
//!
//! A point may have a `camera` of its own, which goes before that of the document: so one file holds the labels of several
//! cameras. `dataset`, `camera` and `tool`, which made the automatic ones where it is not VICE, may be missing; so may everything of an observation but its stamp and pixel. An observation that
//! a machine made may also carry `confidence` (0 to 1), `tracker_version` and `seeded`. Fields that are not known are
//! passed over, so that a file may carry more.

use std::io::{self, Write};

use serde::{Deserialize, Serialize};
use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelSet, Observation, ObservationSource, Provenance};
use vice_core::time::Stamp;

use super::by_camera::ByCamera;
use super::{LabelFile, label_error, no_labels};

/// Name and version of the schema written, the newest that is read.
pub const LABELS_SCHEMA: &str = "vice.labels/1";
const SCHEMA_NAME: &str = "vice.labels/";
const NEWEST_VERSION: u32 = 1;

#[derive(Deserialize)]
struct Head {
    schema: Option<String>,
}

#[derive(Serialize, Deserialize)]
struct Document {
    schema: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dataset: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    camera: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tool: Option<String>,
    points: Vec<PointDocument>,
}

#[derive(Serialize, Deserialize)]
struct PointDocument {
    name: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    camera: Option<String>,
    observations: Vec<ObservationDocument>,
}

#[derive(Serialize, Deserialize)]
struct ObservationDocument {
    timestamp_ns: Stamp,
    px: Pixel,
    #[serde(default)]
    keyframe: bool,
    #[serde(default)]
    source: ObservationSource,
    #[serde(default)]
    occluded: bool,
    #[serde(default)]
    uncertain: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    confidence: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tracker_version: Option<u32>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    seeded: bool,
}

/// Reads a document of schema `vice.labels/1`.
///
/// # Errors
/// [`DataError`] with the line if it is no such JSON, of another or a newer schema, and as [`LabelSet::from_rows`].
pub fn read_json(bytes: &[u8]) -> DataResult<LabelSet> {
    read_json_file(bytes)?.of_one_camera()
}

/// The same, of any number of cameras.
pub(super) fn read_json_file(bytes: &[u8]) -> DataResult<LabelFile> {
    let file = read_document(bytes)?;
    if file.labels.points().is_empty() { Err(no_labels()) } else { Ok(file) }
}

/// As [`read_json`], but a document may hold no points: that is how an annotator begins.
///
/// # Errors
/// As [`read_json`], except for a document without labels.
pub fn read_json_or_none(bytes: &[u8]) -> DataResult<LabelSet> {
    read_document(bytes)?.of_one_camera()
}

fn read_document(bytes: &[u8]) -> DataResult<LabelFile> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let head: Head = serde_json::from_slice(bytes).map_err(|e| json_error(&e))?;
    check_schema(head.schema.as_deref())?;
    let document: Document = serde_json::from_slice(bytes).map_err(|e| json_error(&e))?;
    let mut by_camera = ByCamera::default();
    if document.points.is_empty() {
        by_camera.of(document.camera.as_deref().unwrap_or_default());
    }
    for PointDocument { name, camera, observations } in document.points {
        let labels = by_camera.of(camera.or(document.camera.clone()).unwrap_or_default().trim());
        for o in observations {
            let provenance =
                Provenance { confidence: o.confidence, tracker_version: o.tracker_version, seeded: o.seeded };
            let observation = Observation {
                stamp: o.timestamp_ns,
                px: o.px,
                source: o.source,
                keyframe: o.keyframe,
                occluded: o.occluded,
                uncertain: o.uncertain,
                provenance,
                line: 0,
            };
            labels.push(&name, observation).map_err(label_error)?;
        }
    }
    let mut file = by_camera.finish(label_error)?;
    for labels in std::iter::once(&mut file.labels).chain(&mut file.of_other_cameras) {
        (labels.dataset, labels.tool) = (document.dataset.clone(), document.tool.clone());
    }
    Ok(file)
}

/// Writes a document of schema [`LABELS_SCHEMA`], indented.
///
/// # Errors
/// [`io::Error`] of the writer.
pub fn write_json(writer: &mut dyn Write, labels: &LabelSet) -> io::Result<()> {
    let points = labels.points().iter().map(|point| PointDocument {
        name: point.name.clone(),
        camera: None,
        observations: point
            .observations
            .iter()
            .map(|o| ObservationDocument {
                timestamp_ns: o.stamp,
                px: o.px,
                keyframe: o.keyframe,
                source: o.source,
                occluded: o.occluded,
                uncertain: o.uncertain,
                confidence: o.provenance.confidence,
                tracker_version: o.provenance.tracker_version,
                seeded: o.provenance.seeded,
            })
            .collect(),
    });
    let document = Document {
        schema: LABELS_SCHEMA.to_string(),
        dataset: labels.dataset.clone(),
        camera: labels.camera.clone(),
        tool: labels.tool.clone(),
        points: points.collect(),
    };
    serde_json::to_writer_pretty(&mut *writer, &document)?;
    writeln!(writer)
}

/// Checks the name and version of a schema.
pub(super) fn check_schema(schema: Option<&str>) -> DataResult<()> {
    let Some(schema) = schema else {
        return Err(DataError::new("no `schema` is named").hint(format!("labels are `{LABELS_SCHEMA}`")));
    };
    match schema.strip_prefix(SCHEMA_NAME).and_then(|version| version.parse::<u32>().ok()) {
        Some(1..=NEWEST_VERSION) => Ok(()),
        Some(version) if version > NEWEST_VERSION => Err(DataError::new(format!(
            "the schema {schema} is newer than this program, which reads {LABELS_SCHEMA}"
        ))
        .hint("update vice, or convert the labels to CSV with the program that wrote them")),
        _ => Err(DataError::new(format!("the schema is `{schema}`, not `{LABELS_SCHEMA}`"))),
    }
}

fn json_error(error: &serde_json::Error) -> DataError {
    let text = error.to_string();
    // The position stands in front of the message already.
    let problem = text.rsplit_once(" at line ").map_or(text.as_str(), |(problem, _)| problem);
    let named = DataError::new(format!("is not the JSON expected: {problem}"));
    if error.line() > 0 { named.line(error.line() as u64) } else { named }
}
