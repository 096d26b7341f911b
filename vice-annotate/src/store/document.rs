//! The labels in memory, and the one way they change: cells.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelRow, LabelSet, Observation, ObservationSource, Provenance};
use vice_core::time::Stamp;

/// One observation before and after a change; `None` where there was or is none.
///
/// Every change of labels is a list of cells, so that its inverse is the same list with the sides swapped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Name of the point.
    #[serde(rename = "p")]
    pub point: String,
    /// The frame's stamp.
    #[serde(rename = "t")]
    pub stamp: Stamp,
    /// What was there.
    #[serde(rename = "b", default, skip_serializing_if = "Option::is_none", with = "cell_observation")]
    pub before: Option<Observation>,
    /// What is there now.
    #[serde(rename = "a", default, skip_serializing_if = "Option::is_none", with = "cell_observation")]
    pub after: Option<Observation>,
}

impl Cell {
    fn inverse(&self) -> Self {
        Self { point: self.point.clone(), stamp: self.stamp, before: self.after, after: self.before }
    }
}

/// The same cells with their sides swapped, last first.
pub(super) fn inverse(cells: &[Cell]) -> Vec<Cell> {
    cells.iter().rev().map(Cell::inverse).collect()
}

/// Names of the points that cells touch, each once.
pub(super) fn touched(cells: &[Cell]) -> BTreeSet<&str> {
    cells.iter().map(|c| c.point.as_str()).collect()
}

/// The labels of one camera while they are edited: observations by point and stamp. A point is there as long as it has
/// an observation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// Name of the data set they belong to.
    pub dataset: Option<String>,
    /// Camera they belong to.
    pub camera: Option<String>,
    points: BTreeMap<String, BTreeMap<Stamp, Observation>>,
}

impl Document {
    /// A document of labels as a file has them.
    pub fn from_labels(labels: &LabelSet) -> Self {
        let points = labels.points().iter().map(|p| {
            let observations = p.observations.iter().map(|o| (o.stamp, Observation { line: 0, ..o }));
            (p.name.clone(), observations.collect())
        });
        Self { dataset: labels.dataset.clone(), camera: labels.camera.clone(), points: points.collect() }
    }

    /// The labels as the evaluation takes them and a file stores them; points in natural order.
    ///
    /// # Errors
    /// [`DataError`] as [`LabelSet::from_rows`], which a document that was only changed by checked edits never gives.
    pub fn labels(&self) -> DataResult<LabelSet> {
        let rows = self.points.iter().flat_map(|(name, observations)| {
            observations.values().map(|o| LabelRow { point: name.clone(), observation: *o })
        });
        let mut labels = LabelSet::from_rows(rows).map_err(DataError::of)?;
        labels.dataset.clone_from(&self.dataset);
        labels.camera.clone_from(&self.camera);
        Ok(labels)
    }

    /// Observations of a point by stamp; `None` where there is no such point.
    pub fn point(&self, name: &str) -> Option<&BTreeMap<Stamp, Observation>> {
        self.points.get(name)
    }

    /// The points and their observations, by name.
    pub fn points(&self) -> impl ExactSizeIterator<Item = (&str, &BTreeMap<Stamp, Observation>)> {
        self.points.iter().map(|(name, observations)| (name.as_str(), observations))
    }

    /// One observation.
    pub fn get(&self, point: &str, stamp: Stamp) -> Option<&Observation> {
        self.points.get(point)?.get(&stamp)
    }

    /// The cell that puts `after` in its place; `None` where that changes nothing.
    pub fn cell(&self, point: &str, stamp: Stamp, after: Option<Observation>) -> Option<Cell> {
        let before = self.get(point, stamp).copied();
        (before != after).then(|| Cell { point: point.to_string(), stamp, before, after })
    }

    /// Carries out cells in their order, all or none.
    ///
    /// # Errors
    /// The first cell whose `before` is not what is there: the cells belong to other labels.
    pub fn apply(&mut self, cells: &[Cell]) -> Result<(), Box<Cell>> {
        for (done, cell) in cells.iter().enumerate() {
            if self.get(&cell.point, cell.stamp) != cell.before.as_ref() {
                for undone in cells[..done].iter().rev() {
                    self.put(&undone.point, undone.stamp, undone.before);
                }
                return Err(Box::new(cell.clone()));
            }
            self.put(&cell.point, cell.stamp, cell.after);
        }
        Ok(())
    }

    /// Carries out cells whatever was there before.
    pub(super) fn put_all(&mut self, cells: &[Cell]) {
        for cell in cells {
            self.put(&cell.point, cell.stamp, cell.after);
        }
    }

    fn put(&mut self, point: &str, stamp: Stamp, observation: Option<Observation>) {
        match observation {
            Some(observation) => {
                self.points.entry(point.to_string()).or_default().insert(stamp, observation);
            }
            None => {
                if let Some(observations) = self.points.get_mut(point) {
                    observations.remove(&stamp);
                    if observations.is_empty() {
                        self.points.remove(point);
                    }
                }
            }
        }
    }
}

/// An observation in a journal: short names, since there are many, and nothing where a default says it.
mod cell_observation {
    use serde::{Deserializer, Serializer};

    use super::{Deserialize, Observation, ObservationSource, Pixel, Provenance, Serialize, Stamp};

    #[derive(Serialize, Deserialize)]
    struct Line {
        px: Pixel,
        #[serde(rename = "t")]
        stamp: Stamp,
        #[serde(rename = "s", default, skip_serializing_if = "is_default")]
        source: ObservationSource,
        #[serde(rename = "k", default, skip_serializing_if = "is_default")]
        keyframe: bool,
        #[serde(rename = "o", default, skip_serializing_if = "is_default")]
        occluded: bool,
        #[serde(rename = "u", default, skip_serializing_if = "is_default")]
        uncertain: bool,
        #[serde(rename = "c", default, skip_serializing_if = "Option::is_none")]
        confidence: Option<f64>,
        #[serde(rename = "v", default, skip_serializing_if = "Option::is_none")]
        tracker_version: Option<u32>,
        #[serde(rename = "e", default, skip_serializing_if = "is_default")]
        seeded: bool,
    }

    fn is_default<T: Default + PartialEq>(value: &T) -> bool {
        *value == T::default()
    }

    pub(super) fn serialize<S: Serializer>(
        o: &Option<Observation>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let line = o.map(|o| Line {
            px: o.px,
            stamp: o.stamp,
            source: o.source,
            keyframe: o.keyframe,
            occluded: o.occluded,
            uncertain: o.uncertain,
            confidence: o.provenance.confidence,
            tracker_version: o.provenance.tracker_version,
            seeded: o.provenance.seeded,
        });
        line.serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Observation>, D::Error> {
        let line = Option::<Line>::deserialize(deserializer)?;
        Ok(line.map(|line| Observation {
            stamp: line.stamp,
            px: line.px,
            source: line.source,
            keyframe: line.keyframe,
            occluded: line.occluded,
            uncertain: line.uncertain,
            provenance: Provenance {
                confidence: line.confidence,
                tracker_version: line.tracker_version,
                seeded: line.seeded,
            },
            line: 0,
        }))
    }
}
