//! The table of many flights as LaTeX and as a page.

use std::fmt::Write;

use maud::html;

use super::grid::{Grid, HEADS, HELD};
use crate::error::RunResult;
use crate::report::html::bare_page;
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

/// A page that asks nobody for anything.
pub(super) fn html(grid: &Grid) -> String {
    let content = html! {
        p.brand { "VICE · Visual Inertial Correlation Estimator" }
        h1 { "Flights" }
        p.soft {
            "RMSE_2D in px, mean ± sd over subsets of the points; GT: the reference against the labels, on-board: the \
             estimate against the labels; held: the labels that hold, with the 95 % interval."
        }
        table {
            thead { tr { @for head in HEADS.iter().chain([&HELD]) { th { (head) } } } }
            @for (group, lines) in &grid.groups {
                tbody {
                    @for (place, line) in lines.iter().enumerate() {
                        tr {
                            td { @if place == 0 { (printable(group)) } }
                            @for cell in line.cells("±", "-") { td { (cell) } }
                        }
                    }
                }
            }
        }
        @if !grid.without.is_empty() {
            h2 { "No result" }
            ul { @for (run, reason) in &grid.without { li { (printable(run)) ": " (printable(reason)) } } }
        }
    };
    bare_page("VICE: flights", &content)
}
