//! What a person does to labels, turned into cells.

use serde::Deserialize;
use vice_core::camera::{Camera, Pixel};
use vice_core::error::{DataError, DataResult};
use vice_core::label::{Observation, ObservationSource, Provenance};
use vice_core::time::Stamp;

use super::document::{Cell, Document};
use super::segments;
use vice_track::tracker_version;

/// Characters a point's name may have.
const MAX_NAME: usize = 64;
/// Points beyond which no new one is taken.
const MAX_POINTS: usize = 10_000;

/// One edit. Frames are indices of the data set.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "op", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Edit {
    /// Adds an observation by hand, or moves one. The first of a point is a key frame.
    Place {
        /// The point, new or not.
        point: String,
        /// The frame.
        frame: usize,
        /// To the right, pixels.
        u: f64,
        /// Downwards, pixels.
        v: f64,
    },
    /// Begins a segment: of a new point, or of one that goes on elsewhere in the scene. `segments` says what becomes of the labels behind it.
    Spawn {
        /// The point, new or not.
        point: String,
        /// The frame.
        frame: usize,
        /// To the right, pixels.
        u: f64,
        /// Downwards, pixels.
        v: f64,
        /// The place is the tracker's suggestion, taken as one of many: nobody has looked at it by itself.
        #[serde(default)]
        suggested: bool,
    },
    /// Sets marks of an observation; those that are not given stay.
    Mark {
        /// The point.
        point: String,
        /// The frame.
        frame: usize,
        /// Hidden here: not scored.
        occluded: Option<bool>,
        /// The annotator is not sure.
        uncertain: Option<bool>,
        /// Starts a segment.
        keyframe: Option<bool>,
    },
    /// Deletes one observation.
    Delete {
        /// The point.
        point: String,
        /// The frame.
        frame: usize,
    },
    /// Deletes the observations after a frame; the one there stays.
    DeleteAfter {
        /// The point.
        point: String,
        /// The frame.
        frame: usize,
    },
    /// Deletes the observations from one frame to another, both among them.
    DeleteRange {
        /// The point.
        point: String,
        /// The first frame.
        frame: usize,
        /// The last frame.
        to: usize,
    },
    /// Deletes a point.
    RemovePoint {
        /// The point.
        point: String,
    },
    /// Gives a point another name.
    Rename {
        /// The point.
        point: String,
        /// The new name, which no other point has.
        to: String,
    },
}

/// What edits are checked against.
pub struct Checks<'a> {
    /// The camera: a label must lie in its image.
    pub camera: &'a Camera,
    /// Its frames.
    pub frames: &'a [Stamp],
}

impl Edit {
    /// What the step is, for an undo menu.
    pub fn label(&self) -> String {
        match self {
            Self::Place { point, frame, .. } => format!("place {point} in frame {frame}"),
            Self::Spawn { point, frame, .. } => format!("begin {point} in frame {frame}"),
            Self::Mark { point, frame, .. } => format!("mark {point} in frame {frame}"),
            Self::Delete { point, frame } => format!("delete {point} in frame {frame}"),
            Self::DeleteAfter { point, frame } => format!("delete {point} after frame {frame}"),
            Self::DeleteRange { point, frame, to } => format!("delete {point} from frame {frame} to {to}"),
            Self::RemovePoint { point } => format!("remove point {point}"),
            Self::Rename { point, to } => format!("rename {point} to {to}"),
        }
    }

    /// The cells of this edit on a document; none where it changes nothing.
    ///
    /// # Errors
    /// [`DataError`] for a point, frame or pixel that is not there, or a name that cannot be.
    pub fn cells(&self, document: &Document, checks: &Checks<'_>) -> DataResult<Vec<Cell>> {
        match self {
            Self::Place { point, frame, u, v } => {
                let stamp = checks.stamp(*frame)?;
                let px = checks.pixel(*u, *v)?;
                let placed = match document.get(point, stamp) {
                    // A tracker's doubt is answered by the hand that moves it; a person's own mark stays.
                    Some(o) => Observation {
                        px,
                        source: ObservationSource::Manual,
                        uncertain: o.uncertain && o.source == ObservationSource::Manual,
                        provenance: Provenance::default(),
                        ..*o
                    },
                    None => {
                        let first = check_new(document, point)?;
                        Observation { keyframe: first, ..Observation::manual(stamp, px) }
                    }
                };
                Ok(document.cell(point, stamp, Some(placed)).into_iter().collect())
            }
            Self::Spawn { point, frame, u, v, suggested } => {
                let stamp = checks.stamp(*frame)?;
                let placed = Observation::manual(stamp, checks.pixel(*u, *v)?);
                check_new(document, point)?;
                let placed = match suggested {
                    true => Observation {
                        source: ObservationSource::Auto,
                        provenance: Provenance {
                            tracker_version: tracker_version(),
                            ..Provenance::default()
                        },
                        ..placed
                    },
                    false => placed,
                };
                Ok(segments::begin(document, point, placed))
            }
            Self::Mark { point, frame, occluded, uncertain, keyframe } => {
                let stamp = checks.stamp(*frame)?;
                let o = observation(document, point, stamp, *frame)?;
                let marked = Observation {
                    occluded: occluded.unwrap_or(o.occluded),
                    uncertain: uncertain.unwrap_or(o.uncertain),
                    keyframe: keyframe.unwrap_or(o.keyframe),
                    ..*o
                };
                Ok(document.cell(point, stamp, Some(marked)).into_iter().collect())
            }
            Self::Delete { point, frame } => {
                let stamp = checks.stamp(*frame)?;
                observation(document, point, stamp, *frame)?;
                Ok(segments::delete(document, point, |s| s == stamp))
            }
            Self::DeleteAfter { point, frame } => {
                let stamp = checks.stamp(*frame)?;
                existing(document, point)?;
                Ok(segments::delete(document, point, |s| s > stamp))
            }
            Self::DeleteRange { point, frame, to } => {
                let (first, last) = (checks.stamp(*frame)?, checks.stamp(*to)?);
                if first > last {
                    return Err(DataError::new(format!("frame {frame} is after frame {to}")));
                }
                existing(document, point)?;
                Ok(segments::delete(document, point, |s| (first..=last).contains(&s)))
            }
            Self::RemovePoint { point } => {
                let all = existing(document, point)?.keys();
                Ok(all.filter_map(|s| document.cell(point, *s, None)).collect())
            }
            Self::Rename { point, to } => {
                check_name(to)?;
                let all = existing(document, point)?;
                if document.point(to).is_some() {
                    return Err(DataError::new(format!("there is a point {to} already")));
                }
                let removed = all.keys().filter_map(|s| document.cell(point, *s, None));
                let added = all.iter().filter_map(|(s, o)| document.cell(to, *s, Some(*o)));
                Ok(removed.chain(added).collect())
            }
        }
    }
}

impl Checks<'_> {
    /// The stamp of a frame.
    ///
    /// # Errors
    /// [`DataError`] if there is no such frame.
    pub fn stamp(&self, frame: usize) -> DataResult<Stamp> {
        self.frames.get(frame).copied().ok_or_else(|| {
            DataError::new(format!("frame {frame} does not exist: there are {}", self.frames.len()))
        })
    }

    /// A pixel of the image.
    ///
    /// # Errors
    /// [`DataError`] if it lies outside.
    pub(crate) fn pixel(&self, u: f64, v: f64) -> DataResult<Pixel> {
        let px = Pixel::new(u, v);
        if u.is_finite() && v.is_finite() && self.camera.contains(px) {
            return Ok(px);
        }
        let (width, height) = (self.camera.width(), self.camera.height());
        Err(DataError::new(format!("({u}, {v}) px lies outside the {width}x{height} image")))
    }
}

/// Whether a point would be a new one, which then has to have a name that can be and room.
fn check_new(document: &Document, point: &str) -> DataResult<bool> {
    let new = document.point(point).is_none();
    if new {
        check_name(point)?;
        if document.points().len() >= MAX_POINTS {
            return Err(DataError::new(format!("there are {MAX_POINTS} points already")));
        }
    }
    Ok(new)
}

/// Refuses names that files, commands or people could not tell apart.
fn check_name(name: &str) -> DataResult<()> {
    let problem = if name.is_empty() {
        "a point needs a name"
    } else if name.chars().count() > MAX_NAME {
        "the point's name is too long"
    } else if name.trim() != name || name.chars().any(char::is_control) || name.contains(',') {
        "a point's name has no comma, no control characters and no spaces around it"
    } else if name.starts_with('#') {
        "a point's name does not start with #, which is a comment in CSV"
    } else {
        return Ok(());
    };
    Err(DataError::new(problem))
}

fn existing<'d>(
    document: &'d Document,
    point: &str,
) -> DataResult<&'d std::collections::BTreeMap<Stamp, Observation>> {
    document.point(point).ok_or_else(|| DataError::new(format!("there is no point {point}")))
}

fn observation<'d>(
    document: &'d Document,
    point: &str,
    stamp: Stamp,
    frame: usize,
) -> DataResult<&'d Observation> {
    existing(document, point)?
        .get(&stamp)
        .ok_or_else(|| DataError::new(format!("point {point} is not labelled in frame {frame}")))
}
