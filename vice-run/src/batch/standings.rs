//! Which estimator is better over many flights, and how certain that is.

use std::collections::{BTreeMap, BTreeSet};

use vice_core::fleet::{FEWEST_TO_RANK, FleetDifference, FlightErrors, Standing, difference, ranking};
use vice_core::statistics::WithInterval;

use super::flights::{Curve, Flight, flights};
use super::results::ResultRow;
use super::samples::Samples;
use crate::report::difference::{interval, verdict};
use crate::report::table::align;
use crate::text::printable;

/// More estimators than this are ranked but not held against each other in pairs.
const MOST_IN_PAIRS: usize = 10;
/// The same draws each time.
const SEED: u64 = 1;

/// What the results say over flights.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Standings {
    pub(super) rankings: Vec<Ranking>,
    pub(super) pairs: Vec<Pair>,
    /// The error over time on each flight, where the samples are there.
    pub(super) multiples: Vec<(Flight, Vec<(String, Curve)>)>,
    /// Whether all was compared at the same labels: without samples RMSE_2D of whole runs is.
    pub(super) same_labels: bool,
}

/// Estimators ranked over the flights that all of them have.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ranking {
    pub(super) depth: String,
    pub(super) flights: usize,
    /// The best first.
    pub(super) standings: Vec<(String, Standing)>,
}

/// Two estimators over the flights that both have.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pair {
    pub(super) depth: String,
    pub(super) a: String,
    pub(super) b: String,
    pub(super) difference: FleetDifference,
}

/// Those who are compared, and the depth source.
type Compared = (String, Vec<String>);

impl Standings {
    /// Goes through the flights, the samples of one at a time in memory.
    pub(super) fn of(rows: &[ResultRow], samples: &Samples<'_>) -> Self {
        let flights = flights(rows);
        let compared = compared(&flights);
        let mut errors: BTreeMap<&Compared, Vec<FlightErrors>> = BTreeMap::new();
        let mut found = Self { same_labels: true, ..Self::default() };
        for flight in &flights {
            let read = flight.read(samples);
            for one in compared.iter().filter(|(depth, _)| *depth == flight.depth) {
                let names: Vec<&str> = one.1.iter().map(String::as_str).collect();
                if let Some((of_flight, same_labels)) = flight.errors(&names, read.as_ref()) {
                    found.same_labels &= same_labels;
                    errors.entry(one).or_default().push(of_flight);
                }
            }
            if let Some(read) = &read {
                found.multiples.push((flight.clone(), flight.curves(read)));
            }
        }
        for ((depth, names), errors) in errors.into_iter().filter(|(_, errors)| errors.len() > 1) {
            if let Some(pair) = found.pair(depth, names, &errors) {
                found.pairs.push(pair);
            }
            if names.len() > 2 || compared.iter().filter(|c| c.0 == *depth).count() == 1 {
                let mut standings: Vec<(String, Standing)> =
                    names.iter().cloned().zip(ranking(&errors, SEED)).collect();
                standings.sort_by_key(|(_, standing)| standing.rank);
                found.rankings.push(Ranking { depth: depth.clone(), flights: errors.len(), standings });
            }
        }
        found
    }

    fn pair(&self, depth: &str, names: &[String], errors: &[FlightErrors]) -> Option<Pair> {
        let [a, b] = names else { return None };
        let (depth, a, b) = (depth.to_string(), a.clone(), b.clone());
        Some(Pair { depth, a, b, difference: difference(errors, SEED)? })
    }

    /// The standings in words, or nothing where there is nothing to compare.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        for ranking in &self.rankings {
            text.push_str(&format!("\n{}\n", ranking.head()));
            text.push_str(&align(&ranking.cells()));
        }
        if !self.pairs.is_empty() {
            text.push_str(&format!("\n{}\n", self.pairs_head()));
            text.push_str(&align(&self.pair_cells()));
        }
        text
    }

    /// What the pairs are of.
    pub(super) fn pairs_head(&self) -> &'static str {
        match self.same_labels {
            true => "paired differences: mean RMSE_2D over the flights, at the labels that both scored",
            false => {
                "paired differences: mean RMSE_2D over the flights; on some each at its own labels, for want of samples or of common labels"
            }
        }
    }

    /// The pairs as a table with a heading.
    pub(super) fn pair_cells(&self) -> Vec<Vec<String>> {
        let head = ["depth", "A", "B", "flights", "A px", "B px", "B - A px [95 %]", "B nearer on", ""];
        let mut cells = vec![head.map(String::from).to_vec()];
        for Pair { depth, a, b, difference: d } in &self.pairs {
            cells.push(vec![
                printable(depth),
                printable(a),
                printable(b),
                d.flights.to_string(),
                format!("{:.2}", d.a_px),
                format!("{:.2}", d.b_px),
                interval(&d.difference_px, 2),
                format!("{} of {}", d.b_nearer, d.flights),
                verdict(&d.difference_px).to_string(),
            ]);
        }
        cells
    }
}

impl Ranking {
    /// What the ranking is of.
    pub(super) fn head(&self) -> String {
        let certain = match self.flights < FEWEST_TO_RANK {
            true => "; too few to say how certain it is",
            false => "",
        };
        format!(
            "ranking with {} depth over the {} flights that all have{certain}",
            printable(&self.depth),
            self.flights
        )
    }

    /// A line an estimator, with a heading.
    pub(super) fn cells(&self) -> Vec<Vec<String>> {
        let head = ["rank", "estimator", "mean px [95 %]", "certain of the rank", "the best"];
        let percent =
            |share: Option<f64>| share.map_or_else(|| "-".to_string(), |s| format!("{:.0} %", 100.0 * s));
        let mut cells = vec![head.map(String::from).to_vec()];
        for (name, standing) in &self.standings {
            cells.push(vec![
                standing.rank.to_string(),
                printable(name),
                plain(&standing.mean_px),
                percent(standing.rank_share),
                percent(standing.best_share),
            ]);
        }
        cells
    }
}

/// What is compared with each depth source: all pairs, and each set of estimators that flew together.
fn compared(flights: &[Flight]) -> BTreeSet<Compared> {
    let mut names: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    let mut compared = BTreeSet::new();
    for flight in flights {
        names.entry(&flight.depth).or_default().extend(flight.names());
        let mut together: Vec<String> = flight.names().into_iter().map(String::from).collect();
        together.sort();
        if together.len() > 1 {
            compared.insert((flight.depth.clone(), together));
        }
    }
    for (depth, names) in names.into_iter().filter(|(_, names)| names.len() <= MOST_IN_PAIRS) {
        for (place, a) in names.iter().enumerate() {
            for b in names.iter().skip(place + 1) {
                compared.insert((depth.to_string(), vec![(*a).to_string(), (*b).to_string()]));
            }
        }
    }
    compared
}

fn plain(number: &WithInterval) -> String {
    match number.interval_95 {
        // No error is below zero, whatever a symmetric interval says.
        Some([low, high]) => format!("{:.2} [{:.2}, {high:.2}]", number.value, low.max(0.0)),
        None => format!("{:.2} [-]", number.value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(flight: usize, estimator: &str, rmse: f64) -> ResultRow {
        ResultRow {
            flight: format!("f{flight}"),
            run_id: format!("f{flight}-{estimator}-{rmse}"),
            status: "done".to_string(),
            role: "estimate".to_string(),
            stream: estimator.to_string(),
            estimator: estimator.to_string(),
            depth: "floor".to_string(),
            pooled_px: Some(rmse),
            ..ResultRow::default()
        }
    }

    #[test]
    fn estimators_are_ranked_over_the_flights_that_all_have() {
        let mut rows = Vec::new();
        for flight in 0..8 {
            let scatter = 0.1 * (flight % 3) as f64;
            rows.push(row(flight, "good", 1.0 + scatter));
            rows.push(row(flight, "bad", 3.0 - scatter));
            // Repeated runs of one estimator are one.
            rows.push(row(flight, "bad", 3.2 - scatter));
            if flight < 6 {
                rows.push(row(flight, "middle", 2.0 + scatter));
            }
        }
        let found = Standings::of(&rows, &Samples::None);
        assert!(!found.same_labels && found.multiples.is_empty());
        let [ranking] = &found.rankings[..] else { panic!("{:?}", found.rankings) };
        let names: Vec<&str> = ranking.standings.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!((names, ranking.flights), (vec!["good", "middle", "bad"], 6));
        assert!(ranking.standings[0].1.best_share.unwrap() > 0.99);
        let pairs: Vec<_> = found.pairs.iter().map(|p| (&*p.a, &*p.b, p.difference.flights)).collect();
        assert_eq!(pairs, [("bad", "good", 8), ("bad", "middle", 6), ("good", "middle", 6)]);
        let text = found.text();
        assert!(text.contains("B is better") && text.contains("B is worse"), "{text}");
        assert!(Standings::of(&rows[..3], &Samples::None).text().is_empty(), "one flight is no fleet");
    }
}
