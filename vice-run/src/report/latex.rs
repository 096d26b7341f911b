//! The table as LaTeX (booktabs), in the shape of the paper's.

use std::fmt::Write;

use crate::error::RunResult;
use crate::result::ResultDocument;

use crate::text::printable;

use super::held::held;
use super::rows::{mean_and_deviation, rows, sizes};

/// A `tabular` to `\input`; it needs the package booktabs.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if a text is none.
pub fn render(document: &ResultDocument) -> RunResult<String> {
    let sizes = sizes(document);
    let n = sizes.len();
    let mut text = String::new();
    writeln!(
        text,
        "% {} ({}), camera {}",
        escape(&document.dataset.name),
        escape(&document.dataset.format),
        escape(&document.dataset.camera)
    )?;
    writeln!(text, "\\begin{{tabular}}{{lrrrl{}}}", "r".repeat(2 * n + 1))?;
    writeln!(text, "\\toprule")?;
    writeln!(
        text,
        " & RMSE & AOE & ROE & & \\multicolumn{{{n}}}{{c}}{{$\\Delta$(VICE, GT) px}} & \\multicolumn{{{n}}}{{c}}{{$\\Delta$(VICE, On-Board) px}} & held labels px \\\\"
    )?;
    let points: Vec<String> =
        sizes.iter().map(|s| if *s == 1 { "1 pt".to_string() } else { format!("{s} pts") }).collect();
    let points = points.join(" & ");
    writeln!(text, "Estimate & (m) & (rad) & (rad) & Depth & {points} & {points} & [95\\,\\%] \\\\")?;
    writeln!(text, "\\midrule")?;
    for row in rows(document) {
        let three_d = row.trajectory.map(|t| [t.rmse_3d_m, t.aoe_rad, t.roe_rad]).unwrap_or_default();
        let mut cells = vec![escape(row.stream)];
        cells.extend(three_d.map(|v| v.map_or_else(|| "N.A.".to_string(), |v| format!("{v:.3}"))));
        cells.push(escape(row.depth));
        for part in [row.reference, row.estimate] {
            for size in &sizes {
                let cell = mean_and_deviation(part, *size, "\\pm");
                cells.push(cell.map_or_else(|| "N.A.".to_string(), |c| format!("${c}$")));
            }
        }
        let held = row.estimate.filter(|p| p.held_rmse_px.is_some()).map(|p| format!("${}$", held(p)));
        cells.push(held.unwrap_or_else(|| "N.A.".to_string()));
        writeln!(text, "{} \\\\", cells.join(" & "))?;
    }
    writeln!(text, "\\bottomrule")?;
    writeln!(text, "\\end{{tabular}}")?;
    Ok(text)
}

/// Text from data, with what LaTeX would take for a command made plain.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in printable(text).chars() {
        match c {
            '\\' => escaped.push_str("\\textbackslash{}"),
            '~' => escaped.push_str("\\textasciitilde{}"),
            '^' => escaped.push_str("\\textasciicircum{}"),
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => {
                escaped.push('\\');
                escaped.push(c);
            }
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    #[test]
    fn names_are_no_commands() {
        assert_eq!(super::escape("imu_euler & \\input{x}"), "imu\\_euler \\& \\textbackslash{}input\\{x\\}");
    }
}
