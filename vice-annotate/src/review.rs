//! A second person looks again: sampled observations, each placed anew by someone who does not see where it was.
//!
//! The distances lie beside the labels file (`FILE.review.json`); the labels stay as they are.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult};
use vice_core::label::ObservationSource;
use vice_core::random::SplitMix;
use vice_core::statistics::quantile;
use vice_core::time::Stamp;
use vice_files::atomic::{self, Overwrite};

use crate::desk::Desk;
use crate::notes::beside;

/// Name and version of the shape.
const SCHEMA: &str = "vice.review/1";
/// Bytes of a file that is read.
const MOST_BYTES: u64 = 64 << 20;

/// An observation that is looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The point.
    pub point: String,
    /// Index of the frame.
    pub frame: usize,
    /// Its stamp.
    pub stamp: Stamp,
    /// Where the labels have it.
    pub stored: Pixel,
    /// Who says so.
    pub source: ObservationSource,
    /// Index of the frame, and the place, that says what the point is.
    pub keyframe: (usize, Pixel),
}

/// What a reviewer said of an observation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Verdict {
    /// The point.
    pub point: String,
    /// The frame's stamp.
    #[serde(rename = "timestamp_ns")]
    pub stamp: Stamp,
    /// Who had made the label.
    pub source: ObservationSource,
    /// Where the labels have it, pixels.
    pub stored_px: Pixel,
    /// Where the reviewer has it, pixels; `None`: it cannot be told.
    pub reviewed_px: Option<Pixel>,
    /// How far that is apart, pixels.
    pub distance_px: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    dataset: String,
    camera: String,
    reviews: Vec<Verdict>,
}

/// What all verdicts say together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Observations that are to be looked at.
    pub samples: usize,
    /// Those of which the reviewer placed the point.
    pub placed: usize,
    /// Those of which it could not be told.
    pub untold: usize,
    /// Median distance, pixels.
    pub median_px: Option<f64>,
    /// 95 % are nearer, pixels.
    pub p95_px: Option<f64>,
    /// The largest, pixels.
    pub largest_px: Option<f64>,
}

/// A review under way.
#[derive(Debug)]
pub struct Review {
    path: PathBuf,
    dataset: String,
    camera: String,
    samples: Vec<Sample>,
    verdicts: BTreeMap<(String, Stamp), Verdict>,
    /// Verdicts of an earlier day on observations that have moved or gone since.
    outdated: usize,
}

impl Review {
    /// Chooses the observations, and takes up what was said of them before.
    ///
    /// Which ones does not depend on the order of anything, so that a review goes on where it ended.
    ///
    /// # Errors
    /// [`DataError`] if there is nothing to review, or the file beside the labels is something else.
    pub fn open(desk: &Desk, count: usize) -> DataResult<Self> {
        let samples = sample(desk, count);
        let labels = desk.labels_file();
        if samples.is_empty() {
            return Err(DataError::new("there is nothing to review: no observation follows a key frame")
                .at(&labels)
                .hint("see `fps`, `start` and `duration`"));
        }
        let path = beside(&labels, "review");
        let dataset = desk.dataset.name().to_string();
        let camera = desk.camera_name.clone();
        let said = read(&path, &dataset, &camera)?;
        let document_has =
            |v: &Verdict| desk.store().document().get(&v.point, v.stamp).is_some_and(|o| o.px == v.stored_px);
        let (current, outdated): (Vec<_>, Vec<_>) = said.into_iter().partition(document_has);
        let verdicts = current.into_iter().map(|v| ((v.point.clone(), v.stamp), v)).collect();
        Ok(Self { path, dataset, camera, samples, verdicts, outdated: outdated.len() })
    }

    /// The observations, in the order in which they are looked at.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// What was said of an observation.
    pub fn verdict(&self, sample: &Sample) -> Option<&Verdict> {
        self.verdicts.get(&(sample.point.clone(), sample.stamp))
    }

    /// How many verdicts of earlier days no longer count, since their labels have changed.
    pub const fn outdated(&self) -> usize {
        self.outdated
    }

    /// The file that holds the verdicts.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Notes a verdict, on the disk before it returns.
    ///
    /// # Errors
    /// [`DataError`] if there is no such sample, it has been seen already, or the file cannot be written.
    pub fn say(&mut self, index: usize, reviewed: Option<Pixel>) -> DataResult<Verdict> {
        let sample = self.samples.get(index).cloned().ok_or_else(|| {
            DataError::new(format!("there is no sample {index}: there are {}", self.samples.len()))
        })?;
        if self.verdict(&sample).is_some() {
            return Err(DataError::new(format!(
                "point {} in frame {} has been reviewed: who has seen the label is no longer blind",
                sample.point, sample.frame
            )));
        }
        let verdict = Verdict {
            point: sample.point.clone(),
            stamp: sample.stamp,
            source: sample.source,
            stored_px: sample.stored,
            reviewed_px: reviewed,
            distance_px: reviewed.map(|px| px.distance_px(sample.stored)),
        };
        let mut all = self.verdicts.clone();
        all.insert((sample.point, sample.stamp), verdict.clone());
        let file = File {
            schema: SCHEMA.to_string(),
            dataset: self.dataset.clone(),
            camera: self.camera.clone(),
            reviews: all.values().cloned().collect(),
        };
        let text = serde_json::to_string_pretty(&file)
            .map_err(|e| DataError::new("the review cannot be written").at(&self.path).because(e))?;
        atomic::write(&self.path, Overwrite::Replace, |w| w.write_all(text.as_bytes()))?;
        self.verdicts = all;
        Ok(verdict)
    }

    /// How far apart labels and reviewer are so far.
    pub fn summary(&self) -> Summary {
        let said: Vec<&Verdict> = self.samples.iter().filter_map(|s| self.verdict(s)).collect();
        let mut distances: Vec<f64> = said.iter().filter_map(|v| v.distance_px).collect();
        distances.sort_by(f64::total_cmp);
        Summary {
            samples: self.samples.len(),
            placed: distances.len(),
            untold: said.len() - distances.len(),
            median_px: quantile(&distances, 0.5),
            p95_px: quantile(&distances, 0.95),
            largest_px: distances.last().copied(),
        }
    }
}

impl Summary {
    /// One line.
    pub fn text(&self) -> String {
        let mut text = format!("reviewed {} of {}", self.placed + self.untold, self.samples);
        if let (Some(median), Some(p95), Some(most)) = (self.median_px, self.p95_px, self.largest_px) {
            text += &format!(": median {median:.2} px, 95 % within {p95:.2} px, largest {most:.2} px");
        }
        if self.untold > 0 {
            text += &format!("; {} could not be told", self.untold);
        }
        text
    }
}

fn read(path: &Path, dataset: &str, camera: &str) -> DataResult<Vec<Verdict>> {
    let wrong = |e: DataError| {
        e.at(path).hint("move it away to begin a new review: it holds the distances of an earlier one")
    };
    match std::fs::metadata(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(vec![]),
        Err(e) => return Err(wrong(DataError::new("cannot be read").because(e))),
        Ok(meta) if meta.len() > MOST_BYTES => {
            return Err(wrong(DataError::new("is too large for a review")));
        }
        Ok(_) => {}
    }
    let bytes = std::fs::read(path).map_err(|e| wrong(DataError::new("cannot be read").because(e)))?;
    let file: File =
        serde_json::from_slice(&bytes).map_err(|e| wrong(DataError::new(format!("is no {SCHEMA}: {e}"))))?;
    if file.schema != SCHEMA {
        return Err(wrong(DataError::new(format!("is `{}`, not {SCHEMA}", file.schema))));
    }
    if (file.dataset.as_str(), file.camera.as_str()) != (dataset, camera) {
        return Err(wrong(DataError::new(format!(
            "is a review of {} of {}, not of {camera} of {dataset}",
            file.camera, file.dataset
        ))));
    }
    Ok(file.reviews)
}

/// Observations that follow a key frame and are not hidden, drawn by a hash of point and time.
fn sample(desk: &Desk, count: usize) -> Vec<Sample> {
    let store = desk.store();
    let mut drawn: Vec<(u64, Sample)> = Vec::new();
    for (point, observations) in store.document().points() {
        let mut keyframe = None;
        for (stamp, o) in observations {
            let Ok(frame) = desk.frames.binary_search(stamp) else { continue };
            if o.keyframe {
                keyframe = (!o.occluded).then_some((frame, o.px));
                continue;
            }
            let Some(keyframe) = keyframe.filter(|_| !o.occluded && desk.is_chosen(frame)) else { continue };
            let sample = Sample {
                point: point.to_string(),
                frame,
                stamp: *stamp,
                stored: o.px,
                source: o.source,
                keyframe,
            };
            drawn.push((lot(point, *stamp), sample));
        }
    }
    drawn.sort_by(|(a, x), (b, y)| a.cmp(b).then_with(|| (&x.point, x.stamp).cmp(&(&y.point, y.stamp))));
    drawn.into_iter().take(count).map(|(_, sample)| sample).collect()
}

fn lot(point: &str, stamp: Stamp) -> u64 {
    let start = SplitMix::new(stamp.as_nanos().cast_unsigned()).bits();
    point.bytes().fold(start, |lot, byte| SplitMix::new(lot ^ u64::from(byte)).bits())
}
