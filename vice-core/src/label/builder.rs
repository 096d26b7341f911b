//! Labels from observations in any order, without a copy of each point's name for each of them.

use std::collections::HashMap;

use super::{LabelError, LabelSet, NaturalName, Observation, ObservationList, PointLabels};

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
        self.find(point).push(observation);
        Ok(())
    }

    /// Adds observations of a point.
    ///
    /// # Errors
    /// As [`LabelSetBuilder::push`], for the first that is none.
    pub fn append(&mut self, point: &str, observations: ObservationList) -> Result<(), LabelError> {
        let is_finite = |all: &[f64]| all.iter().all(|v| v.is_finite());
        let plain = observations.says_nothing() && !point.is_empty();
        if plain && is_finite(observations.u_px()) && is_finite(observations.v_px()) {
            self.find(point).append(observations);
            return Ok(());
        }
        observations.iter().try_for_each(|observation| self.push(point, observation))
    }

    /// The observations of a point so far.
    fn find(&mut self, point: &str) -> &mut ObservationList {
        let is_at = |index: usize| self.points.get(index).is_some_and(|p| p.name == point);
        let near = [self.last, self.last + 1, 0].into_iter().find(|i| is_at(*i));
        self.last = match near.or_else(|| self.by_name.get(point).copied()) {
            Some(index) => index,
            None => {
                self.by_name.insert(point.to_string(), self.points.len());
                let observations = ObservationList::default();
                self.points.push(PointLabels { name: point.to_string(), observations });
                self.points.len() - 1
            }
        };
        &mut self.points[self.last].observations
    }

    /// The labels: points in natural order of their names (2 before 10), observations by stamp.
    ///
    /// # Errors
    /// [`LabelError`] for a point that is labelled twice in a frame.
    pub fn finish(self) -> Result<LabelSet, LabelError> {
        let mut points = self.points;
        points.sort_by_cached_key(|p| NaturalName::new(p.name.clone()));
        for point in &mut points {
            point.observations.sort();
            let stamps = point.observations.stamps();
            if let Some(i) = stamps.windows(2).position(|w| w[0] == w[1]) {
                let line = point.observations.get(i + 1).map_or(0, |o| o.line);
                return Err(LabelError::Duplicate { point: point.name.clone(), stamp: stamps[i + 1], line });
            }
        }
        Ok(LabelSet { points, ..LabelSet::default() })
    }
}
