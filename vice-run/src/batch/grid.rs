//! The rows of the table of many flights.

use std::collections::BTreeMap;

use super::results::ResultRow;
use crate::report::held::value_and_interval;
use crate::report::rows::{decimals, pixels};
use crate::text::printable;

/// What a table is made of: groups of rows, each of which is a flight, an estimate and a depth source.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Grid {
    pub(super) groups: Vec<(String, Vec<Line>)>,
    /// Runs without a result, with the reason.
    pub(super) without: Vec<(String, String)>,
}

/// A row of the table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Line {
    pub(super) flight: String,
    pub(super) estimate: String,
    /// RMSE_3D in metres, AOE and ROE in radians.
    pub(super) three_d: [Option<f64>; 3],
    pub(super) depth: String,
    /// Mean and standard deviation for 1, 2 and 3 points: the reference's against the labels.
    pub(super) reference: [Option<(f64, f64)>; 3],
    /// The estimate's.
    pub(super) on_board: [Option<(f64, f64)>; 3],
    /// RMSE_2D of the labels that hold, with its interval.
    pub(super) held: Option<(f64, Option<[f64; 2]>)>,
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
    let mut places: BTreeMap<&str, usize> = BTreeMap::new();
    for row in rows {
        if row.status != "done" {
            let reason = if row.error.is_empty() { &row.status } else { &row.error };
            grid.without.push((row.run_id.clone(), reason.clone()));
            continue;
        }
        let run = runs.get(row.run_id.as_str()).map_or(&[][..], Vec::as_slice);
        let is_reference = row.role == "reference";
        // A reference stands in the rows of its estimates, and by itself only where there is none.
        if is_reference && run.iter().any(|r| r.role == "estimate") {
            continue;
        }
        let reference = run.iter().find(|r| r.role == "reference" && r.depth == row.depth);
        let interval = row.low_95_px.zip(row.high_95_px).map(|(low, high)| [low, high]);
        let line = Line {
            flight: row.run_id.clone(),
            estimate: row.stream.clone(),
            three_d: [row.rmse_3d_m, row.aoe_rad, row.roe_rad],
            depth: row.depth.clone(),
            reference: reference.map(|r| r.by_points()).unwrap_or_default(),
            on_board: if is_reference { Default::default() } else { row.by_points() },
            held: row.held_px.map(|v| (v, interval)),
        };
        let place = *places.entry(&row.group).or_insert_with(|| {
            grid.groups.push((row.group.clone(), Vec::new()));
            grid.groups.len() - 1
        });
        grid.groups[place].1.push(line);
    }
    grid
}

/// `mean±sd` with as many decimals as are good for something.
fn mean_and_sd((mean, sd): (f64, f64), plus_minus: &str) -> String {
    let shown = |px| pixels(px, decimals(mean));
    format!("{}{plus_minus}{}", shown(mean), shown(sd))
}

impl Line {
    /// The cells behind the group; `none` stands where there is no number.
    pub(super) fn cells(&self, plus_minus: &str, none: &str) -> Vec<String> {
        let mut cells = vec![printable(&self.flight), printable(&self.estimate)];
        cells.extend(self.three_d.map(|v| v.map_or_else(|| none.to_string(), |v| format!("{v:.3}"))));
        cells.push(printable(&self.depth));
        let both = self.reference.iter().chain(&self.on_board);
        cells.extend(both.map(|v| v.map_or_else(|| none.to_string(), |v| mean_and_sd(v, plus_minus))));
        cells.push(self.held.map_or_else(|| none.to_string(), |(v, i)| value_and_interval(v, i)));
        cells
    }
}
