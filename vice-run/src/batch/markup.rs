//! The table of many flights as LaTeX and as a page.

use std::fmt::Write;

use maud::html;

use super::beside::Beside;
use super::grid::{Grid, HEADS, HELD, Line};
use super::multiples::multiples;
use super::standings::Standings;
use super::store::Store;
use crate::error::RunResult;
use crate::report::html::page_with;
use crate::report::latex::escape;
use crate::text::printable;

/// A `tabular` to `\input`; it needs the package booktabs.
pub(super) fn latex(grid: &Grid) -> RunResult<String> {
    let mut text = String::new();
    writeln!(text, "\\begin{{tabular}}{{lllrrrlrrrrrrr}}")?;
    writeln!(text, "\\toprule")?;
    writeln!(
        text,
        " & & & RMSE & AOE & ROE & & \\multicolumn{{3}}{{c}}{{$\\Delta$(VICE, GT) px}} & \\multicolumn{{3}}{{c}}{{$\\Delta$(VICE, On-Board) px}} & held labels px \\\\"
    )?;
    writeln!(
        text,
        "Group & Flight & Estimate & (m) & (rad) & (rad) & Depth & 1 pt & 2 pts & 3 pts & 1 pt & 2 pts & 3 pts & [95\\,\\%] \\\\"
    )?;
    for (group, lines) in &grid.groups {
        writeln!(text, "\\midrule")?;
        for (place, line) in lines.iter().enumerate() {
            let group = if place == 0 { escape(group) } else { String::new() };
            let cells = line.cells("\\pm", "N.A.").into_iter().enumerate().map(|(column, cell)| {
                // Names are text, and so is what is not there; the rest are numbers.
                let is_text = [0, 1, 5].contains(&column) || cell == "N.A.";
                if is_text { escape(&cell) } else { format!("${cell}$") }
            });
            writeln!(text, "{group} & {} \\\\", cells.collect::<Vec<_>>().join(" & "))?;
        }
    }
    writeln!(text, "\\bottomrule")?;
    writeln!(text, "\\end{{tabular}}")?;
    for (run, reason) in &grid.without {
        writeln!(text, "% no result of {}: {}", escape(run), escape(reason))?;
    }
    Ok(text)
}

/// Sorts the rows of a table by the heading that is clicked, and shows those that hold what is typed.
const SCRIPT: &str = include_str!("table.js");

/// A page that asks nobody for anything.
pub(super) fn html(grid: &Grid, standings: &Standings, beside: &Beside<'_>) -> String {
    let cells = |table: Vec<Vec<String>>| {
        html! {
            div.wide { table {
                @for (place, row) in table.iter().enumerate() {
                    tr { @for cell in row { @if place == 0 { th { (cell) } } @else { td { (cell) } } } }
                }
            } }
        }
    };
    let content = html! {
        p.brand { "VICE · Visual Inertial Correlation Estimator" }
        h1 { "Flights" }
        @for ranking in &standings.rankings { h2 { (ranking.head()) } (cells(ranking.cells())) }
        @if !standings.pairs.is_empty() { h2 { (standings.pairs_head()) } (cells(standings.pair_cells())) }
        h2 { "each flight" }
        p.soft {
            "RMSE_2D in px, mean ± sd over subsets of the points, of repeated runs over the runs; GT: the reference \
             against the labels, on-board: the estimate against the labels; held: the labels that hold, with the 95 % \
             interval. A click on a heading sorts."
        }
        p { label { "Show rows with " input #filter type="search"; } }
        div.wide { table #flights {
            thead { tr { @for head in HEADS.iter().chain([&HELD]) { th { (head) } } } }
            tbody {
                @for (group, lines) in &grid.groups {
                    @for line in lines {
                        @let link = beside.links.and_then(|before| link(before, line));
                        tr {
                            td { (printable(group)) }
                            @for cell in line.cells("±", "-") {
                                td { @match &link { Some(to) => a href=(to) { (cell) }, None => (cell) } }
                            }
                        }
                    }
                }
            }
        } }
        @if !standings.multiples.is_empty() {
            h2 { "error over time" }
            (multiples(&standings.multiples))
        }
        @if !grid.without.is_empty() {
            h2 { "no result" }
            ul { @for (run, reason) in &grid.without { li { (printable(run)) ": " (printable(reason)) } } }
        }
    };
    page_with("VICE: flights", &content, SCRIPT)
}

/// Where the report of a line's first run is.
fn link(before: &str, line: &Line) -> Option<String> {
    line.keys.first().map(|key| format!("{before}{}", Store::report_name(key)))
}
