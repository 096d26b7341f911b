//! The paper's table as rows: one for each estimate and depth source, with the reference beside it.

use crate::result::ResultDocument;
use vice_core::result::{PixelPart, Role, TrajectoryPart};

/// A row: what the estimate's own error is, and what the labels say of the reference and of the estimate.
pub(crate) struct Row<'a> {
    /// Name of the estimate; of the reference where there is no estimate.
    pub(crate) stream: &'a str,
    pub(crate) depth: &'a str,
    pub(crate) trajectory: Option<&'a TrajectoryPart>,
    pub(crate) reference: Option<&'a PixelPart>,
    pub(crate) estimate: Option<&'a PixelPart>,
}

/// Rows in the order of the estimates, then of the depth sources.
pub(crate) fn rows(document: &ResultDocument) -> Vec<Row<'_>> {
    let of = |role| document.pixel.iter().filter(move |p| p.role == role);
    let mut streams: Vec<&str> = Vec::new();
    for part in of(Role::Estimate) {
        if !streams.contains(&part.stream.as_str()) {
            streams.push(&part.stream);
        }
    }
    let mut rows = Vec::new();
    for stream in streams {
        for estimate in of(Role::Estimate).filter(|p| p.stream == stream) {
            rows.push(Row {
                stream,
                depth: &estimate.depth,
                trajectory: document.trajectory.iter().find(|t| t.estimate == stream),
                reference: of(Role::Reference).find(|p| p.depth == estimate.depth),
                estimate: Some(estimate),
            });
        }
    }
    if rows.is_empty() {
        rows.extend(of(Role::Reference).map(|reference| Row {
            stream: &reference.stream,
            depth: &reference.depth,
            trajectory: None,
            reference: Some(reference),
            estimate: None,
        }));
    }
    rows
}

/// The subset sizes that occur, ascending.
pub(crate) fn sizes(document: &ResultDocument) -> Vec<usize> {
    let mut sizes: Vec<usize> = document.pixel.iter().flat_map(|p| p.rmse_px.keys().copied()).collect();
    sizes.sort_unstable();
    sizes.dedup();
    sizes
}

/// `mean±std` of a subset size.
pub(crate) fn mean_and_deviation(part: Option<&PixelPart>, size: usize, plus_minus: &str) -> Option<String> {
    let rmse = part?.rmse_px.get(&size)?.as_ref()?;
    let shown = |px| pixels(px, decimals(rmse.mean));
    Some(format!("{}{plus_minus}{}", shown(rmse.mean), shown(rmse.std)))
}

/// Pixels with so many decimals. A lens model far outside of its image gives powers of ten, of which nobody reads the digits.
pub(crate) fn pixels(px: f64, decimals: usize) -> String {
    if px < 1e6 { format!("{px:.decimals$}") } else { format!("{px:.1e}") }
}

/// Enough decimals to see a good estimate, not more than labels are good for.
pub(crate) fn decimals(px: f64) -> usize {
    if px < 0.1 {
        4
    } else if px < 10.0 {
        2
    } else {
        1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_short_however_far_out() {
        assert_eq!(pixels(0.04551, decimals(0.04551)), "0.0455");
        assert_eq!(pixels(98.098, 3), "98.098");
        assert_eq!(pixels(179_799_286_189.4, 3), "1.8e11");
    }
}
