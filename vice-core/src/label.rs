//! Labels: where a human, helped by a tracker, says a scene point is.
//!
//! A point has observations in time order. An observation marked as a key frame starts a new *segment*: its pixel
//! is lifted to 3D and carried along by each pose stream until the next key frame (a respawn). The observations after
//! it are what the streams are scored against.

mod builder;
mod list;

pub use builder::LabelSetBuilder;
pub use list::{Iter, Marks, ObservationList};

use crate::camera::Pixel;
use crate::time::Stamp;

/// Who made an observation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum ObservationSource {
    /// A human placed it.
    #[default]
    Manual,
    /// An image tracker placed it.
    Auto,
    /// A detector of calibration targets placed it.
    Detected,
    /// Interpolated between two others.
    Interpolated,
}

impl ObservationSource {
    /// The name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Manual => "manual",
            Self::Auto => "auto",
            Self::Detected => "detected",
            Self::Interpolated => "interpolated",
        }
    }

    /// By its name in files.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Manual, Self::Auto, Self::Detected, Self::Interpolated].into_iter().find(|s| s.name() == name)
    }
}

/// What a machine that made an observation says of its work; empty where a human made it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Provenance {
    /// How sure it is, 0 to 1.
    pub confidence: Option<f64>,
    /// Version of the image tracker.
    pub tracker_version: Option<u32>,
    /// A pose stream said where to start looking. The image decided where the point is.
    pub seeded: bool,
}

/// One point in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The frame's stamp.
    pub stamp: Stamp,
    /// Where the point is.
    pub px: Pixel,
    /// Who says so.
    pub source: ObservationSource,
    /// Starts a segment.
    pub keyframe: bool,
    /// The point is hidden here: not scored.
    pub occluded: bool,
    /// The annotator is not sure: scored only where all labels are asked for, and shown as such.
    pub uncertain: bool,
    /// What the machine that made it says.
    pub provenance: Provenance,
    /// The line of the file it came from, counted from 1; 0 where there is none.
    pub line: u64,
}

/// A scene point and its observations, strictly ordered in time.
#[derive(Clone, Debug, PartialEq)]
pub struct PointLabels {
    /// Its name.
    pub name: String,
    /// Its observations.
    pub observations: ObservationList,
}

/// A key frame and what follows until the next one.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// The key frame.
    pub keyframe: Observation,
    /// Place of the key frame among the point's observations.
    pub at: usize,
    /// Places of the observations after it.
    pub rest: std::ops::Range<usize>,
}

/// All labels of one camera of one run.
///
/// ```
/// use vice_core::camera::Pixel;
/// use vice_core::label::{LabelRow, LabelSet, Observation};
/// use vice_core::time::Stamp;
///
/// let row = |millis: i64, u_px: f64, keyframe: bool| LabelRow {
///     point: "corner".to_string(),
///     observation: Observation {
///         keyframe,
///         ..Observation::manual(Stamp::from_nanos(millis * 1_000_000), Pixel::new(u_px, 240.0))
///     },
/// };
/// let labels = LabelSet::from_rows([row(0, 320.0, true), row(50, 322.5, false), row(100, 325.0, false)])?;
/// // What follows a key frame is scored against it.
/// let segment = labels.points()[0].segments().next().unwrap();
/// assert_eq!((segment.keyframe.px.u, segment.rest.len()), (320.0, 2));
/// # Ok::<(), vice_core::label::LabelError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelSet {
    points: Vec<PointLabels>,
    /// Name of the data set they belong to, where the file says so.
    pub dataset: Option<String>,
    /// Camera they belong to, where the file says so.
    pub camera: Option<String>,
    /// Tool that made those that are `auto`, where it is not the tracker of VICE.
    pub tool: Option<String>,
}

/// A row as a file has it: not checked yet.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelRow {
    /// Name of the point.
    pub point: String,
    /// The observation.
    pub observation: Observation,
}

/// Why rows are no labels.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LabelError {
    /// A pixel is NaN or infinite.
    #[error("point {point} at {stamp} ns has a pixel that is not finite")]
    NotFinite {
        /// The point.
        point: String,
        /// The frame.
        stamp: Stamp,
        /// Line of the file, 0 where there is none.
        line: u64,
    },
    /// A point is labelled twice in a frame.
    #[error("point {point} is labelled twice at {stamp} ns")]
    Duplicate {
        /// The point.
        point: String,
        /// The frame.
        stamp: Stamp,
        /// Line of the second one, 0 where there is none.
        line: u64,
    },
    /// A confidence is no number from 0 to 1.
    #[error("point {point} at {stamp} ns has the confidence {confidence}, which is not between 0 and 1")]
    Confidence {
        /// The point.
        point: String,
        /// The frame.
        stamp: Stamp,
        /// The value.
        confidence: f64,
        /// Line of the file, 0 where there is none.
        line: u64,
    },
    /// A point has no name.
    #[error("a point at {stamp} ns has an empty name")]
    NoName {
        /// The frame.
        stamp: Stamp,
        /// Line of the file, 0 where there is none.
        line: u64,
    },
}

impl LabelError {
    /// Line of the file at fault, where known.
    pub const fn line(&self) -> Option<u64> {
        match self {
            Self::NotFinite { line, .. }
            | Self::Duplicate { line, .. }
            | Self::Confidence { line, .. }
            | Self::NoName { line, .. } => {
                if *line == 0 {
                    None
                } else {
                    Some(*line)
                }
            }
        }
    }
}

impl Observation {
    /// A manual observation that carries no marks.
    pub const fn manual(stamp: Stamp, px: Pixel) -> Self {
        Self {
            stamp,
            px,
            source: ObservationSource::Manual,
            keyframe: false,
            occluded: false,
            uncertain: false,
            provenance: Provenance { confidence: None, tracker_version: None, seeded: false },
            line: 0,
        }
    }

    /// The same observation as a key frame.
    #[must_use]
    pub const fn as_keyframe(mut self) -> Self {
        self.keyframe = true;
        self
    }
}

impl PointLabels {
    /// The segments in time order. Observations before the first key frame belong to none: see [`PointLabels::before_first_keyframe`].
    pub fn segments(&self) -> impl Iterator<Item = Segment> + '_ {
        let marks = self.observations.marks();
        let next = move |from: usize| marks[from..].iter().position(|m| m.keyframe()).map(|i| from + i);
        let mut start = next(0);
        std::iter::from_fn(move || {
            let at = start?;
            start = next(at + 1);
            let rest = at + 1..start.unwrap_or(marks.len());
            Some(Segment { keyframe: self.observations.get(at)?, at, rest })
        })
    }

    /// Number of observations that no key frame precedes: there is nothing to carry along.
    pub fn before_first_keyframe(&self) -> usize {
        let marks = self.observations.marks();
        marks.iter().position(|m| m.keyframe()).unwrap_or(marks.len())
    }
}

impl LabelSet {
    /// Labels from rows in any order; points are sorted by name in natural order (2 before 10), observations by stamp.
    ///
    /// # Errors
    /// [`LabelError`] for a pixel that is not finite, a confidence that is none, an empty name, or a point labelled twice
    /// in a frame.
    pub fn from_rows(rows: impl IntoIterator<Item = LabelRow>) -> Result<Self, LabelError> {
        let mut builder = LabelSetBuilder::default();
        for LabelRow { point, observation } in rows {
            builder.push(&point, observation)?;
        }
        builder.finish()
    }

    /// The points, in natural order of their names.
    pub fn points(&self) -> &[PointLabels] {
        &self.points
    }

    /// Keeps only the named points, in the set's order.
    ///
    /// # Errors
    /// The first name that is no point of the set.
    pub fn select(&self, names: &[String]) -> Result<Self, String> {
        if let Some(unknown) = names.iter().find(|n| self.points.iter().all(|p| p.name != **n)) {
            return Err(unknown.clone());
        }
        let points = self.points.iter().filter(|p| names.contains(&p.name)).cloned().collect();
        let (dataset, camera, tool) = (self.dataset.clone(), self.camera.clone(), self.tool.clone());
        Ok(Self { points, dataset, camera, tool })
    }

    /// Number of observations of all points.
    pub fn observation_count(&self) -> usize {
        self.points.iter().map(|p| p.observations.len()).sum()
    }
}

/// A name that sorts as people count: digits by value.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct NaturalName {
    key: Vec<(String, u128)>,
    text: String,
}

impl NaturalName {
    fn new(text: String) -> Self {
        let mut key = Vec::new();
        let mut rest = text.as_str();
        while !rest.is_empty() {
            let word_end = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
            let (word, tail) = rest.split_at(word_end);
            let digits_end = tail.find(|c: char| !c.is_ascii_digit()).unwrap_or(tail.len());
            let (digits, tail) = tail.split_at(digits_end);
            key.push((word.to_string(), digits.parse().unwrap_or(u128::MAX)));
            rest = tail;
        }
        Self { key, text }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(point: &str, nanos: i64, keyframe: bool) -> LabelRow {
        let mut observation = Observation::manual(Stamp::from_nanos(nanos), Pixel::new(1.0, 2.0));
        observation.keyframe = keyframe;
        LabelRow { point: point.to_string(), observation }
    }

    #[test]
    fn segments_start_at_key_frames() {
        let rows = [
            row("a", 0, false),
            row("a", 1, true),
            row("a", 2, false),
            row("a", 3, true),
            row("a", 4, false),
        ];
        let set = LabelSet::from_rows(rows).unwrap();
        let point = &set.points()[0];
        assert_eq!(point.before_first_keyframe(), 1);
        let segments: Vec<(i64, usize)> =
            point.segments().map(|s| (s.keyframe.stamp.as_nanos(), s.rest.len())).collect();
        assert_eq!(segments, [(1, 1), (3, 1)]);
    }

    #[test]
    fn names_sort_as_people_count_and_rows_may_come_in_any_order() {
        let rows = ["10", "2", "tag12.c0", "tag3.c1", "tag3.c0"].map(|n| row(n, 0, true));
        let set = LabelSet::from_rows(rows).unwrap();
        let names: Vec<_> = set.points().iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names, ["2", "10", "tag3.c0", "tag3.c1", "tag12.c0"]);
        let set = LabelSet::from_rows([row("a", 5, false), row("a", 1, true)]).unwrap();
        assert_eq!(set.points()[0].segments().next().unwrap().rest.len(), 1);
        assert_eq!(set.select(&["b".to_string()]), Err("b".to_string()));
    }

    #[test]
    fn a_point_is_labelled_once_a_frame() {
        let twice = LabelSet::from_rows([row("a", 5, true), row("a", 5, false)]);
        assert!(matches!(twice, Err(LabelError::Duplicate { .. })));
        assert!(matches!(LabelSet::from_rows([row("", 5, true)]), Err(LabelError::NoName { .. })));
        let mut nan = row("a", 1, true);
        nan.observation.px.u = f64::NAN;
        assert!(matches!(LabelSet::from_rows([nan]), Err(LabelError::NotFinite { .. })));
    }
}
