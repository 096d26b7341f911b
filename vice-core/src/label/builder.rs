//! Labels from observations in any order, without a copy of each point's name for each of them.

use std::collections::HashMap;

use super::{LabelError, LabelSet, NaturalName, Observation, PointLabels};

/// Takes observations one by one.
#[derive(Clone, Debug, Default)]
pub struct LabelSetBuilder {
    points: Vec<PointLabels>,
    by_name: HashMap<String, usize>,
    /// Files list points one after the other or frame by frame: the next one is mostly the same or the next.
    last: usize,
}

impl LabelSetBuilder {
    /// Adds an observation of a point.
    ///
    /// # Errors
    /// [`LabelError`] for a pixel that is not finite, an empty name or a confidence that is none.
    pub fn push(&mut self, point: &str, observation: Observation) -> Result<(), LabelError> {
        let (stamp, line) = (observation.stamp, observation.line);
        if point.is_empty() {
            return Err(LabelError::NoName { stamp, line });
        }
        if !(observation.px.u.is_finite() && observation.px.v.is_finite()) {
            return Err(LabelError::NotFinite { point: point.to_string(), stamp, line });
        }
        if let Some(confidence) = observation.provenance.confidence.filter(|c| !(0.0..=1.0).contains(c)) {
            return Err(LabelError::Confidence { point: point.to_string(), stamp, confidence, line });
        }
        let is_at = |index: usize| self.points.get(index).is_some_and(|p| p.name == point);
        let near = [self.last, self.last + 1, 0].into_iter().find(|i| is_at(*i));
        self.last = match near.or_else(|| self.by_name.get(point).copied()) {
            Some(index) => index,
            None => {
                self.by_name.insert(point.to_string(), self.points.len());
                self.points.push(PointLabels { name: point.to_string(), observations: Vec::new() });
                self.points.len() - 1
            }
        };
        self.points[self.last].observations.push(observation);
        Ok(())
    }

    /// The labels: points in natural order of their names (2 before 10), observations by stamp.
    ///
    /// # Errors
    /// [`LabelError`] for a point that is labelled twice in a frame.
    pub fn finish(self) -> Result<LabelSet, LabelError> {
        let mut points = self.points;
        points.sort_by_cached_key(|p| NaturalName::new(p.name.clone()));
        for point in &mut points {
            if !point.observations.is_sorted_by_key(|o| (o.stamp, o.line)) {
                point.observations.sort_by_key(|o| (o.stamp, o.line));
            }
            if let Some(pair) = point.observations.windows(2).find(|w| w[0].stamp == w[1].stamp) {
                let (point, stamp, line) = (point.name.clone(), pair[1].stamp, pair[1].line);
                return Err(LabelError::Duplicate { point, stamp, line });
            }
        }
        Ok(LabelSet { points, ..LabelSet::default() })
    }
}
