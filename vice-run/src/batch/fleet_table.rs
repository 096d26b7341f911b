//! The table of many flights, in the shape of the paper's Table 1.

use super::beside::Beside;
use super::grid::{Grid, HEADS, HELD, grid};
use super::markup;
use super::results::ResultRow;
use super::standings::Standings;
use crate::error::RunResult;
use crate::report::csv::{cell, finished};
use crate::report::table::align;
use crate::text::printable;

/// How it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Columns for a terminal.
    Text,
    /// A `tabular` (booktabs).
    Latex,
    /// Comma separated.
    Csv,
    /// A page.
    Html,
}

/// The table of some results.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if a text is none.
pub(super) fn render(rows: &[ResultRow], beside: &Beside<'_>, format: Format) -> RunResult<String> {
    let grid = grid(rows);
    match format {
        Format::Text => Ok(text(&grid, &Standings::of(rows, &beside.samples))),
        Format::Csv => csv_text(&grid),
        Format::Latex => markup::latex(&grid),
        Format::Html => Ok(markup::html(&grid, &Standings::of(rows, &beside.samples), beside)),
    }
}

fn text(grid: &Grid, standings: &Standings) -> String {
    let mut cells = vec![HEADS.iter().chain([&HELD]).map(|h| (*h).to_string()).collect::<Vec<_>>()];
    for (group, lines) in &grid.groups {
        for (place, line) in lines.iter().enumerate() {
            let group = if place == 0 { printable(group) } else { String::new() };
            cells.push([vec![group], line.cells("±", "-")].concat());
        }
    }
    let mut text = String::from(
        "RMSE_2D in px, mean ± sd over subsets of the points, of repeated runs over the runs; GT: the reference against the labels, on-board: the estimate against the labels\n\n",
    );
    text.push_str(&align(&cells));
    text.push_str(&standings.text());
    if !grid.without.is_empty() {
        text.push_str("\nno result\n");
    }
    for (run, reason) in &grid.without {
        text.push_str(&format!("- {}: {}\n", printable(run), printable(reason)));
    }
    text
}

fn csv_text(grid: &Grid) -> RunResult<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let points =
        |who: &str| [1, 2, 3].map(|n| [format!("{who}_{n}_px"), format!("{who}_{n}_sd_px")]).concat();
    let start = ["group", "flight", "estimate", "runs", "rmse_3d_m", "aoe_rad", "roe_rad", "depth"];
    let mut heads: Vec<String> = start.map(String::from).to_vec();
    heads.extend(points("gt"));
    heads.extend(points("on_board"));
    heads.extend(["held_px", "low_95_px", "high_95_px"].map(String::from));
    writer.write_record(heads)?;
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
    for (group, lines) in &grid.groups {
        for line in lines {
            let mut cells =
                vec![cell(group), cell(&line.flight), cell(&line.estimate), line.runs.to_string()];
            cells.extend(line.three_d.map(number));
            cells.push(cell(&line.depth));
            for pair in line.reference.iter().chain(&line.on_board) {
                cells.extend([number(pair.map(|p| p.0)), number(pair.map(|p| p.1))]);
            }
            let interval = line.held.and_then(|h| h.1);
            cells.push(number(line.held.map(|h| h.0)));
            cells.extend([0, 1].map(|end| number(interval.map(|i| i[end]))));
            writer.write_record(cells)?;
        }
    }
    finished(writer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::HOSTILE;

    use crate::batch::samples::Samples;

    const ALONE: Beside<'_> = Beside { samples: Samples::None, links: None };

    fn row(run: &str, group: &str, role: &str, mean: f64) -> ResultRow {
        ResultRow {
            run_id: run.to_string(),
            flight: run.to_string(),
            estimator: format!("{role}-stream"),
            group: group.to_string(),
            status: "done".to_string(),
            stream: format!("{role}-stream"),
            role: role.to_string(),
            depth: "floor".to_string(),
            mean_1_px: Some(mean),
            std_1_px: Some(0.5),
            held_px: Some(mean),
            low_95_px: Some(mean - 0.5),
            high_95_px: Some(mean + 0.5),
            ..ResultRow::default()
        }
    }

    fn rows() -> Vec<ResultRow> {
        let failed = ResultRow {
            status: "failed".to_string(),
            error: "no such file".to_string(),
            ..row("f2", "A", "", 1.0)
        };
        vec![
            row("f1", "A", "reference", 1.0),
            row("f1", "A", "estimate", 4.0),
            row("f3", "B", "reference", 2.0),
            failed,
            row("f4", "A", "estimate", 7.0),
        ]
    }

    #[test]
    fn flights_stand_in_their_groups_with_the_reference_beside_the_estimate() {
        let text = render(&rows(), &ALONE, Format::Text).unwrap();
        let lines: Vec<&str> = text.lines().skip(4).collect();
        assert!(lines[0].starts_with("A      f1      estimate-stream"), "{text}");
        assert!(lines[0].contains("1.00±0.50") && lines[0].ends_with("4.00 [3.50, 4.50]"), "{text}");
        assert!(lines[1].starts_with("       f4"), "{text}");
        assert!(lines[2].starts_with("B      f3      reference-stream"), "{text}");
        assert!(text.ends_with("\nno result\n- f2: no such file\n"), "{text}");
    }

    #[test]
    fn repeated_runs_are_one_cell_with_their_spread() {
        let again =
            |run: &str, mean: f64| ResultRow { run_id: run.to_string(), ..row("f1", "A", "estimate", mean) };
        let rows = [again("a", 2.0), again("b", 3.0), again("c", 4.0), row("f2", "A", "estimate", 9.0)];
        let text = render(&rows, &ALONE, Format::Text).unwrap();
        let line = text.lines().find(|l| l.contains("f1")).unwrap();
        assert!(line.contains("estimate-stream (3 runs)") && line.contains("3.00±1.00"), "{text}");
        assert!(line.ends_with("3.00 [1.50, 4.50]"), "{text}");
        assert_eq!(text.lines().filter(|l| l.contains("estimate-stream")).count(), 2);
        let csv = render(&rows, &ALONE, Format::Csv).unwrap();
        assert!(csv.lines().nth(1).unwrap().starts_with("A,f1,estimate-stream,3,"), "{csv}");
    }

    #[test]
    fn names_from_data_stay_names() {
        let mut rows = rows();
        rows[1].estimator = HOSTILE.to_string();
        rows[3].error = HOSTILE.to_string();
        let html = render(&rows, &ALONE, Format::Html).unwrap();
        assert!(!html.contains("<script>alert") && html.contains("&lt;script&gt;alert"));
        let latex = render(&rows, &ALONE, Format::Latex).unwrap();
        assert!(
            latex.contains("\\textbackslash{}input\\{y\\}") && latex.contains("$1.00\\pm0.50$"),
            "{latex}"
        );
        assert!(!render(&rows, &ALONE, Format::Text).unwrap().contains('\u{1b}'));
        let csv = render(&rows[..1], &ALONE, Format::Csv).unwrap();
        assert!(csv.starts_with("group,flight,estimate,runs,rmse_3d_m"), "{csv}");
    }
}
