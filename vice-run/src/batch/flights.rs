//! The results of a batch by flight: which estimators have it, in which runs, and how their errors went over time.

use std::collections::BTreeMap;

use vice_core::fleet::FlightErrors;
use vice_core::result::Sample;
use vice_core::time::Stamp;

use super::results::ResultRow;
use super::samples::{PartSamples, Samples};

/// Points of a curve at most: what a small plot can show.
const CURVE_POINTS: usize = 60;

/// A flight with a depth source.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Flight {
    pub(super) group: String,
    pub(super) flight: String,
    pub(super) depth: String,
    /// In the order of the results.
    pub(super) estimators: Vec<Estimator>,
}

/// The runs of an estimator on a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Estimator {
    pub(super) name: String,
    pub(super) runs: Vec<Run>,
}

/// A run of an estimator.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Run {
    pub(super) key: String,
    pub(super) stream: String,
    /// RMSE_2D of all labels, pixels.
    pub(super) rmse_px: f64,
}

/// An error over time: seconds since the first label, and mean error in pixels.
pub(super) type Curve = Vec<(f64, f64)>;

/// What was read of a flight's samples.
pub(super) struct Read {
    by_key: BTreeMap<String, Vec<PartSamples>>,
}

/// The flights of some results that an estimate was scored on, in their order.
pub(super) fn flights(rows: &[ResultRow]) -> Vec<Flight> {
    let mut flights: Vec<Flight> = Vec::new();
    let mut places: BTreeMap<(&str, &str, &str), usize> = BTreeMap::new();
    for row in rows.iter().filter(|r| r.status == "done" && r.role == "estimate") {
        let Some(rmse_px) = row.pooled_px else { continue };
        let place = *places.entry((&row.group, &row.flight, &row.depth)).or_insert_with(|| {
            let (group, flight, depth) = (row.group.clone(), row.flight.clone(), row.depth.clone());
            flights.push(Flight { group, flight, depth, estimators: vec![] });
            flights.len() - 1
        });
        let estimators = &mut flights[place].estimators;
        let run = Run { key: row.key.clone(), stream: row.stream.clone(), rmse_px };
        match estimators.iter_mut().find(|e| e.name == row.estimator) {
            Some(estimator) => estimator.runs.push(run),
            None => estimators.push(Estimator { name: row.estimator.clone(), runs: vec![run] }),
        }
    }
    flights
}

impl Flight {
    /// Reads the samples of its runs; nothing where one of them has none.
    pub(super) fn read(&self, samples: &Samples<'_>) -> Option<Read> {
        let mut by_key = BTreeMap::new();
        for run in self.estimators.iter().flat_map(|e| &e.runs) {
            if !by_key.contains_key(&run.key) {
                by_key.insert(run.key.clone(), samples.of(&run.key)?);
            }
        }
        Some(Read { by_key })
    }

    /// Names of its estimators.
    pub(super) fn names(&self) -> Vec<&str> {
        self.estimators.iter().map(|e| e.name.as_str()).collect()
    }

    /// The errors of some estimators at the labels that all of them scored, and true; `None` where one has not flown it.
    /// Where there are no samples, or no label in common, it is their RMSE_2D, each at its own labels, and false.
    pub(super) fn errors(&self, names: &[&str], read: Option<&Read>) -> Option<(FlightErrors, bool)> {
        let chosen: Vec<&Estimator> = names
            .iter()
            .map(|name| self.estimators.iter().find(|e| e.name == *name))
            .collect::<Option<_>>()?;
        let at_common_labels = read.and_then(|read| {
            let of = |e: &&Estimator| e.runs.iter().map(|run| read.samples(run, &self.depth)).collect();
            FlightErrors::of_samples(&chosen.iter().map(of).collect::<Vec<_>>())
        });
        if let Some(errors) = at_common_labels {
            return Some((errors, true));
        }
        let rmse = |e: &&Estimator| e.runs.iter().map(|run| run.rmse_px).collect();
        Some((FlightErrors::of_rmse_px(&chosen.iter().map(rmse).collect::<Vec<_>>())?, false))
    }

    /// The mean error over time of each estimator's first run.
    pub(super) fn curves(&self, read: &Read) -> Vec<(String, Curve)> {
        let samples = |e: &Estimator| e.runs.first().map_or(&[][..], |run| read.samples(run, &self.depth));
        let stamps = self.estimators.iter().flat_map(samples).map(|s| s.timestamp_ns);
        let Some((first, last)) = stamps.fold(None, |range: Option<(Stamp, Stamp)>, t| {
            Some(range.map_or((t, t), |(first, last)| (first.min(t), last.max(t))))
        }) else {
            return vec![];
        };
        self.estimators.iter().map(|e| (e.name.clone(), curve(samples(e), first, last))).collect()
    }
}

impl Read {
    fn samples(&self, run: &Run, depth: &str) -> &[Sample] {
        let parts = self.by_key.get(&run.key).map_or(&[][..], Vec::as_slice);
        let part = parts.iter().find(|p| *p.stream == *run.stream && *p.depth == *depth);
        part.map_or(&[], |part| &part.samples)
    }
}

/// Means over equal stretches of time.
fn curve(samples: &[Sample], first: Stamp, last: Stamp) -> Curve {
    let span_s = last.since(first).as_secs_f64().max(1e-9);
    let mut bins = vec![(0.0, 0.0, 0.0); CURVE_POINTS];
    for sample in samples {
        let at_s = sample.timestamp_ns.since(first).as_secs_f64();
        let bin = ((at_s / span_s * CURVE_POINTS as f64) as usize).min(CURVE_POINTS - 1);
        bins[bin].0 += 1.0;
        bins[bin].1 += at_s;
        bins[bin].2 += sample.error_px;
    }
    bins.into_iter().filter(|b| b.0 > 0.0).map(|(n, at_s, error)| (at_s / n, error / n)).collect()
}
