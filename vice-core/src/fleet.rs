//! Several estimators over many flights: differences and a ranking, at labels that all who are compared scored.
//!
//! The error of an estimator on a flight is its RMSE_2D there; over flights it is the mean of these, so that each flight
//! counts the same. Intervals come from resampling flights, and in each the repeated runs and the points, all with
//! replacement. A handful of flights resampled says too little of flights that were not flown: an interval is never
//! narrower than Student's over the flights.

use std::collections::BTreeMap;

use crate::metrics::student::quantile_975;
use crate::paired::RESAMPLES;
use crate::random::SplitMix;
use crate::result::{PointName, Sample};
use crate::statistics::{WithInterval, bootstrap};
use crate::time::Stamp;

/// Fewer flights than this say nothing certain of a ranking.
pub const FEWEST_TO_RANK: usize = 5;

/// The errors of some estimators on a flight, at the labels that all of their runs scored.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightErrors {
    points: Vec<PointErrors>,
    /// Runs of each estimator.
    runs: Vec<usize>,
}

/// Sums over the labels of a point.
#[derive(Clone, Debug, PartialEq)]
struct PointErrors {
    count: f64,
    /// By estimator and run, pixels squared.
    squares_px2: Vec<Vec<f64>>,
}

impl FlightErrors {
    /// From samples: for each estimator those of its runs. `None` where an estimator has no run, or there is no label
    /// that all scored.
    pub fn of_samples(estimators: &[Vec<&[Sample]>]) -> Option<Self> {
        let runs: Vec<usize> = estimators.iter().map(Vec::len).collect();
        let mut labels: BTreeMap<(&PointName, Stamp), Vec<f64>> = BTreeMap::new();
        for (place, samples) in estimators.iter().flatten().enumerate() {
            for sample in *samples {
                let errors = labels.entry((&sample.point, sample.timestamp_ns)).or_default();
                // Only who scored the label everywhere before goes on with it; a label that is there twice counts once.
                if errors.len() == place {
                    errors.push(sample.error_px);
                }
            }
        }
        let all: usize = runs.iter().sum();
        let mut points: BTreeMap<&PointName, PointErrors> = BTreeMap::new();
        for ((point, _), errors) in labels.iter().filter(|(_, errors)| errors.len() == all) {
            let sums = points.entry(point).or_insert_with(|| PointErrors {
                count: 0.0,
                squares_px2: runs.iter().map(|n| vec![0.0; *n]).collect(),
            });
            sums.count += 1.0;
            for (sum, error) in sums.squares_px2.iter_mut().flatten().zip(errors) {
                *sum += error * error;
            }
        }
        Self { points: points.into_values().collect(), runs }.checked()
    }

    /// Where only the RMSE_2D of each run is known, pixels: points cannot be resampled then, and who scored which labels
    /// is not looked at. `None` where an estimator has no run.
    pub fn of_rmse_px(estimators: &[Vec<f64>]) -> Option<Self> {
        let squares = |runs: &Vec<f64>| runs.iter().map(|rmse| rmse * rmse).collect();
        let point = PointErrors { count: 1.0, squares_px2: estimators.iter().map(squares).collect() };
        Self { points: vec![point], runs: estimators.iter().map(Vec::len).collect() }.checked()
    }

    fn checked(self) -> Option<Self> {
        let has_all = !self.points.is_empty() && !self.runs.is_empty() && self.runs.iter().all(|n| *n > 0);
        has_all.then_some(self)
    }

    /// Number of labels that all scored.
    pub fn labels(&self) -> u64 {
        self.points.iter().map(|p| p.count as u64).sum()
    }

    /// RMSE_2D of each estimator, the mean of its runs, pixels.
    pub fn rmse_px(&self) -> Vec<f64> {
        let whole = vec![1; self.points.len()];
        let mean = |estimator: usize| {
            let runs = self.runs[estimator];
            (0..runs).map(|run| self.rmse_of(estimator, run, &whole)).sum::<f64>() / runs as f64
        };
        (0..self.runs.len()).map(mean).collect()
    }

    fn rmse_of(&self, estimator: usize, run: usize, times: &[u32]) -> f64 {
        let (mut count, mut squares) = (0.0, 0.0);
        for (point, times) in self.points.iter().zip(times) {
            count += f64::from(*times) * point.count;
            squares += f64::from(*times) * point.squares_px2[estimator][run];
        }
        (squares / count).sqrt()
    }

    /// The same with points drawn anew, and one of the repeated runs: what another flight of this kind might have shown.
    fn resampled_px(&self, random: &mut SplitMix) -> Vec<f64> {
        let times = random.resample(self.points.len());
        let one = |(estimator, runs): (usize, &usize)| {
            let run = if *runs > 1 { random.below(*runs as u64) as usize } else { 0 };
            self.rmse_of(estimator, run, &times)
        };
        self.runs.iter().enumerate().map(one).collect()
    }
}

/// Two estimators over the flights that both have. Differences are B minus A: negative where B is better.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FleetDifference {
    /// Flights that both have.
    pub flights: usize,
    /// Labels that both scored.
    pub labels: u64,
    /// Flights on which B is nearer.
    pub b_nearer: usize,
    /// Mean RMSE_2D of A over the flights, pixels.
    pub a_px: f64,
    /// Mean RMSE_2D of B over the flights, pixels.
    pub b_px: f64,
    /// Difference of the two.
    pub difference_px: WithInterval,
}

/// Compares the second estimator of the flights with the first; `None` without a flight. The same seed gives the same.
pub fn difference(flights: &[FlightErrors], seed: u64) -> Option<FleetDifference> {
    let each: Vec<Vec<f64>> = flights.iter().map(FlightErrors::rmse_px).filter(|r| r.len() == 2).collect();
    if each.is_empty() || each.len() != flights.len() {
        return None;
    }
    let differences: Vec<f64> = each.iter().map(|rmse| rmse[1] - rmse[0]).collect();
    let drawn = draws(flights, seed).into_iter().map(|means| means[1] - means[0]).collect();
    Some(FleetDifference {
        flights: flights.len(),
        labels: flights.iter().map(FlightErrors::labels).sum(),
        b_nearer: differences.iter().filter(|d| **d < 0.0).count(),
        a_px: mean(each.iter().map(|r| r[0])),
        b_px: mean(each.iter().map(|r| r[1])),
        difference_px: with_interval(&differences, drawn),
    })
}

/// How an estimator stands among others over the flights that all of them have.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Standing {
    /// From 1, the smallest mean first; equal means share the smaller rank.
    pub rank: usize,
    /// Mean RMSE_2D over the flights, pixels.
    pub mean_px: WithInterval,
    /// Share of the resamples in which it is the best; `None` with fewer than [`FEWEST_TO_RANK`] flights.
    pub best_share: Option<f64>,
    /// Share of the resamples in which it has this rank; `None` with fewer than [`FEWEST_TO_RANK`] flights.
    pub rank_share: Option<f64>,
}

/// Ranks the estimators of the flights, in their order; nothing without a flight or where not all flights have the same
/// number of estimators. The same seed gives the same.
pub fn ranking(flights: &[FlightErrors], seed: u64) -> Vec<Standing> {
    let each: Vec<Vec<f64>> = flights.iter().map(FlightErrors::rmse_px).collect();
    let Some(estimators) = each.first().map(Vec::len) else { return vec![] };
    if each.iter().any(|rmse| rmse.len() != estimators) {
        return vec![];
    }
    let means: Vec<f64> = (0..estimators).map(|e| mean(each.iter().map(|r| r[e]))).collect();
    let drawn = draws(flights, seed);
    let rank_in = |means: &[f64], of: usize| 1 + means.iter().filter(|m| **m < means[of]).count();
    let standing = |of: usize| {
        let rank = rank_in(&means, of);
        let share = |wanted: usize| {
            let held = drawn.iter().filter(|means| rank_in(means, of) == wanted).count();
            (flights.len() >= FEWEST_TO_RANK).then(|| held as f64 / drawn.len().max(1) as f64)
        };
        let values: Vec<f64> = each.iter().map(|r| r[of]).collect();
        let resampled = drawn.iter().map(|means| means[of]).collect();
        Standing {
            rank,
            mean_px: with_interval(&values, resampled),
            best_share: share(1),
            rank_share: share(rank),
        }
    };
    (0..estimators).map(standing).collect()
}

/// The mean RMSE_2D of each estimator over flights drawn anew.
fn draws(flights: &[FlightErrors], seed: u64) -> Vec<Vec<f64>> {
    if flights.len() < 2 {
        return vec![];
    }
    bootstrap(RESAMPLES, seed, |random| {
        let times = random.resample(flights.len());
        let mut sums: Vec<f64> = vec![0.0; flights[0].runs.len()];
        for (flight, times) in flights.iter().zip(times) {
            for _ in 0..times {
                let values = flight.resampled_px(random);
                sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            }
        }
        Some(sums.into_iter().map(|sum| sum / flights.len() as f64).collect())
    })
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// The mean of some values, its interval from the resamples and at least Student's over the values.
fn with_interval(values: &[f64], resampled: Vec<f64>) -> WithInterval {
    let (count, centre) = (values.len() as f64, mean(values.iter().copied()));
    let mut found = WithInterval::of(centre, resampled);
    if let (Some([low, high]), Some(quantile)) = (&mut found.interval_95, quantile_975(count - 1.0)) {
        let variance = values.iter().map(|v| (v - centre).powi(2)).sum::<f64>() / (count - 1.0);
        let half = quantile * (variance / count).sqrt();
        (*low, *high) = (low.min(centre - half), high.max(centre + half));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Pixel;
    use proptest::prelude::*;

    fn samples(errors: &[(&str, i64, f64)]) -> Vec<Sample> {
        let one = |(point, stamp, error_px): &(&str, i64, f64)| Sample {
            point: PointName((*point).into()),
            timestamp_ns: Stamp::from_nanos(*stamp),
            label_px: Pixel::new(1.0, 1.0),
            tracked_px: Pixel::new(1.0 + error_px, 1.0),
            error_px: *error_px,
        };
        errors.iter().map(one).collect()
    }

    #[test]
    fn only_labels_that_all_scored_count() {
        let a = samples(&[("p", 1, 3.0), ("p", 2, 4.0), ("q", 1, 9.0)]);
        let b = samples(&[("p", 2, 1.0), ("q", 1, 2.0), ("q", 5, 50.0)]);
        let found = FlightErrors::of_samples(&[vec![&a], vec![&b]]).unwrap();
        assert_eq!(found.labels(), 2);
        assert_eq!(found.rmse_px(), [(97.0_f64 / 2.0).sqrt(), (5.0_f64 / 2.0).sqrt()]);
        assert_eq!(FlightErrors::of_samples(&[vec![&a], vec![]]), None);
        assert_eq!(FlightErrors::of_samples(&[vec![&a], vec![&samples(&[("z", 1, 1.0)])]]), None);
        // Two runs of one estimator: their mean.
        let found = FlightErrors::of_samples(&[vec![&a, &b]]).unwrap();
        assert!(
            (found.rmse_px()[0] - ((97.0_f64 / 2.0).sqrt() + (5.0_f64 / 2.0).sqrt()) / 2.0).abs() < 1e-12
        );
    }

    #[test]
    fn a_clear_difference_is_clear_and_a_single_flight_has_no_interval() {
        let flight = |k: i32, more: f64| {
            let at = 2.0 + 0.3 * f64::from(k % 4);
            FlightErrors::of_rmse_px(&[vec![at], vec![at + more + 0.05 * f64::from(k % 3)]]).unwrap()
        };
        let flights: Vec<_> = (0..12).map(|k| flight(k, 1.0)).collect();
        let found = difference(&flights, 1).unwrap();
        let [low, high] = found.difference_px.interval_95.unwrap();
        assert!(low > 0.9 && high < 1.2 && low <= found.difference_px.value, "{found:?}");
        assert_eq!((found.flights, found.b_nearer), (12, 0));
        assert_eq!(found, difference(&flights, 1).unwrap());
        let standings = ranking(&flights, 1);
        assert_eq!((standings[0].rank, standings[1].rank), (1, 2));
        assert!(standings[1].best_share.unwrap() < 0.05, "{standings:?}");
        assert_eq!(difference(&flights[..1], 1).unwrap().difference_px.interval_95, None);
        assert_eq!(ranking(&flights[..4], 1)[0].best_share, None, "four flights are too few");
        assert!(ranking(&[], 1).is_empty() && difference(&[], 1).is_none());
    }

    /// What an interval promises, on flights that are drawn as the interval does not know: normal differences between
    /// flights, and labels that scatter by themselves.
    #[test]
    fn intervals_hold() {
        for flights in [3_usize, 6, 15] {
            let (mut held, rounds) = (0, 200);
            for round in 0..rounds {
                let mut random = SplitMix::new(round);
                let made: Vec<_> = (0..flights)
                    .map(|_| {
                        let (a, b) = (5.0 + random.normal(), 5.5 + random.normal());
                        FlightErrors::of_rmse_px(&[vec![a], vec![b]]).unwrap()
                    })
                    .collect();
                let [low, high] = difference(&made, round).unwrap().difference_px.interval_95.unwrap();
                held += u32::from((low..=high).contains(&0.5));
            }
            assert!(f64::from(held) >= 0.92 * rounds as f64, "{held} of {rounds} with {flights} flights");
        }
    }

    proptest! {
        #[test]
        fn swapping_changes_the_sign(
            rmse in prop::collection::vec((0.1..50.0_f64, 0.1..50.0_f64), 1..12),
        ) {
            let flights = |swap: bool| -> Vec<FlightErrors> {
                rmse.iter().map(|(a, b)| {
                    let (a, b) = if swap { (b, a) } else { (a, b) };
                    FlightErrors::of_rmse_px(&[vec![*a], vec![*b]]).unwrap()
                }).collect()
            };
            let (there, back) = (difference(&flights(false), 3).unwrap(), difference(&flights(true), 3).unwrap());
            prop_assert!((there.difference_px.value + back.difference_px.value).abs() < 1e-9);
            if let (Some(there), Some(back)) = (there.difference_px.interval_95, back.difference_px.interval_95) {
                prop_assert!((there[0] + back[1]).abs() < 1e-9 && (there[1] + back[0]).abs() < 1e-9);
            }
        }
    }
}
