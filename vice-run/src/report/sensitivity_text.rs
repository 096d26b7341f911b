//! A sensitivity as text.

use vice_core::diagnose::SensitivityDocument;

use super::csv::finished;
use super::flaw_units::{axis, shown_unit};
use super::table;
use crate::error::RunResult;
use crate::text::printable;

/// The sensitivity as a table.
pub fn render(document: &SensitivityDocument) -> String {
    let mut text = format!(
        "{}, {} with {}: {:.3} px over {} labels of {} points; flaws injected one at a time\n\n",
        printable(&document.dataset),
        printable(&document.stream),
        printable(&document.depth),
        document.rmse_px,
        document.labels.scored,
        document.labels.points
    );
    let mut grid = vec![
        ["flaw", "axis", "injected", "RMSE_2D px", "seen from", "found from"].map(String::from).to_vec(),
    ];
    for curve in &document.curves {
        let (unit, scale) = shown_unit(curve);
        let size = |value: Option<f64>| {
            value.map_or_else(|| "never".to_string(), |v| format!("{} {unit}", three_digits(v * scale)))
        };
        // The typical size stands for the curve, which the CSV and the picture have.
        let typical = curve.points.get(5).or(curve.points.last());
        grid.push(vec![
            curve.flaw.words().to_string(),
            axis(curve).to_string(),
            size(typical.map(|p| p.size)),
            typical.map_or_else(String::new, |p| format!("{:.2}", p.rmse_px)),
            size(curve.seen_from),
            size(curve.found_from),
        ]);
    }
    text.push_str(&table::align(&grid));
    text
}

/// Three digits that count.
fn three_digits(value: f64) -> String {
    let decimals = (2.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.decimals$}")
}

/// The curves as CSV.
///
/// # Errors
/// None with text that is text.
pub fn csv(document: &SensitivityDocument) -> RunResult<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(["flaw", "parameter", "size", "rmse_px"])?;
    for curve in &document.curves {
        for point in &curve.points {
            let (size, rmse) = (point.size.to_string(), point.rmse_px.to_string());
            writer.write_record([curve.flaw.name(), &curve.parameter, &size, &rmse])?;
        }
    }
    finished(writer)
}

#[cfg(test)]
mod tests {
    #[test]
    fn sizes_are_read_at_a_glance() {
        assert_eq!([0.012345, 1.23456, 123.456].map(super::three_digits), ["0.0123", "1.23", "123"]);
    }
}
