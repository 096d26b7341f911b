//! The rows of the table of many flights.

use std::collections::BTreeMap;

use super::results::ResultRow;
use crate::report::held::value_and_interval;
use crate::report::numbers::mean;
use crate::report::rows::{decimals, pixels};
use crate::text::printable;

/// What a table is made of: groups of rows, each of which is a flight, an estimate and a depth source.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Grid {
    pub(super) groups: Vec<(String, Vec<Line>)>,
    /// Runs without a result, with the reason.
    pub(super) without: Vec<(String, String)>,
}

/// A row of the table: the runs of an estimator on a flight with a depth source.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Line {
    pub(super) flight: String,
    pub(super) estimate: String,
    /// Runs that it is the mean of.
    pub(super) runs: usize,
    /// RMSE_3D in metres, AOE and ROE in radians.
    pub(super) three_d: [Option<f64>; 3],
    pub(super) depth: String,
    /// Mean and standard deviation for 1, 2 and 3 points: the reference's against the labels. The deviation is that over
    /// the subsets of the points, or of several runs that over the runs.
    pub(super) reference: [Option<(f64, f64)>; 3],
    /// The estimate's.
    pub(super) on_board: [Option<(f64, f64)>; 3],
    /// RMSE_2D of the labels that hold, with its interval; of several runs the mean, and from the lowest end to the
    /// highest.
    pub(super) held: Option<(f64, Option<[f64; 2]>)>,
    /// Keys of the runs.
    pub(super) keys: Vec<String>,
}

/// Heads of the columns; the six of RMSE_2D stand under "VICE, GT" and "VICE, On-Board".
pub(super) const HEADS: [&str; 13] = [
    "group",
    "flight",
    "estimate",
    "RMSE_3D m",
    "AOE rad",
    "ROE rad",
    "depth",
    "GT 1pt px",
    "GT 2pt px",
    "GT 3pt px",
    "on-board 1pt px",
    "on-board 2pt px",
    "on-board 3pt px",
];
pub(super) const HELD: &str = "held px [95 %]";

/// The rows of the table, in the order of the results; groups in that of their first row.
pub(super) fn grid(rows: &[ResultRow]) -> Grid {
    let mut grid = Grid::default();
    let mut runs: BTreeMap<&str, Vec<&ResultRow>> = BTreeMap::new();
    for row in rows {
        runs.entry(&row.run_id).or_default().push(row);
    }
    let mut groups: Vec<(&str, Vec<Vec<&ResultRow>>)> = Vec::new();
    let mut places: BTreeMap<(&str, [&str; 3]), (usize, usize)> = BTreeMap::new();
    for row in rows {
        if row.status != "done" {
            let reason = if row.error.is_empty() { &row.status } else { &row.error };
            grid.without.push((row.run_id.clone(), reason.clone()));
            continue;
        }
        let run = runs.get(row.run_id.as_str()).map_or(&[][..], Vec::as_slice);
        // A reference stands in the rows of its estimates, and by itself only where there is none.
        if is_reference(row) && run.iter().any(|r| r.role == "estimate") {
            continue;
        }
        let name = (row.group.as_str(), [row.flight.as_str(), &row.estimator, &row.depth]);
        let (group, line) = *places.entry(name).or_insert_with(|| {
            let group = groups.iter().position(|(group, _)| *group == name.0).unwrap_or_else(|| {
                groups.push((name.0, Vec::new()));
                groups.len() - 1
            });
            groups[group].1.push(Vec::new());
            (group, groups[group].1.len() - 1)
        });
        groups[group].1[line].push(row);
    }
    let line = |repeated: Vec<&ResultRow>| {
        let reference = |row: &ResultRow| {
            let run = runs.get(row.run_id.as_str())?;
            run.iter().copied().find(|r| is_reference(r) && r.depth == row.depth)
        };
        let references: Vec<&ResultRow> = repeated.iter().filter_map(|r| reference(r)).collect();
        Line::of(&repeated, &references)
    };
    grid.groups = groups
        .into_iter()
        .map(|(group, lines)| (group.to_string(), lines.into_iter().map(line).collect()))
        .collect();
    grid
}

fn is_reference(row: &ResultRow) -> bool {
    row.role == "reference"
}

impl Line {
    /// The line of repeated runs, at least one, and what their references say.
    fn of(runs: &[&ResultRow], references: &[&ResultRow]) -> Self {
        let Some(first) = runs.first() else { return Self::default() };
        let mean_of = |get: fn(&ResultRow) -> Option<f64>| {
            let values: Vec<f64> = runs.iter().filter_map(|r| get(r)).collect();
            mean(&values)
        };
        let held: Vec<f64> = runs.iter().filter_map(|r| r.held_px).collect();
        let end = |get: fn(&ResultRow) -> Option<f64>, pick: fn(f64, f64) -> f64| {
            runs.iter().map(|r| get(r)).collect::<Option<Vec<f64>>>()?.into_iter().reduce(pick)
        };
        let (low, high) = (end(|r| r.low_95_px, f64::min), end(|r| r.high_95_px, f64::max));
        Self {
            flight: first.flight.clone(),
            estimate: first.estimator.clone(),
            runs: runs.len(),
            three_d: [mean_of(|r| r.rmse_3d_m), mean_of(|r| r.aoe_rad), mean_of(|r| r.roe_rad)],
            depth: first.depth.clone(),
            reference: by_points(references),
            on_board: if is_reference(first) { Default::default() } else { by_points(runs) },
            held: mean(&held).map(|v| (v, low.zip(high).map(|(low, high)| [low, high]))),
            keys: runs.iter().map(|r| r.key.clone()).collect(),
        }
    }
}

/// Mean and deviation for 1, 2 and 3 points: of one run as it says, of several over the runs.
fn by_points(runs: &[&ResultRow]) -> [Option<(f64, f64)>; 3] {
    if let [one] = runs {
        return one.by_points();
    }
    [0, 1, 2].map(|size| {
        let means: Vec<f64> = runs.iter().filter_map(|r| r.by_points()[size]).map(|m| m.0).collect();
        let centre = mean(&means)?;
        let squares: f64 = means.iter().map(|m| (m - centre).powi(2)).sum();
        Some((centre, (squares / (means.len() as f64 - 1.0).max(1.0)).sqrt()))
    })
}

/// `mean±sd` with as many decimals as are good for something.
fn mean_and_sd((mean, sd): (f64, f64), plus_minus: &str) -> String {
    let shown = |px| pixels(px, decimals(mean));
    format!("{}{plus_minus}{}", shown(mean), shown(sd))
}

impl Line {
    /// The cells behind the group; `none` stands where there is no number.
    pub(super) fn cells(&self, plus_minus: &str, none: &str) -> Vec<String> {
        let estimate = match self.runs {
            0 | 1 => printable(&self.estimate),
            runs => format!("{} ({runs} runs)", printable(&self.estimate)),
        };
        let mut cells = vec![printable(&self.flight), estimate];
        cells.extend(self.three_d.map(|v| v.map_or_else(|| none.to_string(), |v| format!("{v:.3}"))));
        cells.push(printable(&self.depth));
        let both = self.reference.iter().chain(&self.on_board);
        cells.extend(both.map(|v| v.map_or_else(|| none.to_string(), |v| mean_and_sd(v, plus_minus))));
        cells.push(self.held.map_or_else(|| none.to_string(), |(v, i)| value_and_interval(v, i)));
        cells
    }
}
