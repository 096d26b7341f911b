//! The table as CSV, one line for each stream, depth source and subset size.

use crate::error::RunResult;
use crate::result::ResultDocument;

use crate::text::printable;

/// Columns: stream, role, depth, points, mean_px, std_px, subsets, pooled_px, scored, skipped, and the trajectory
/// errors of estimates.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if a text is none.
pub fn render(document: &ResultDocument) -> RunResult<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "stream",
        "role",
        "depth",
        "points",
        "mean_px",
        "std_px",
        "subsets",
        "pooled_px",
        "scored",
        "skipped",
        "rmse_3d_m",
        "aoe_rad",
        "roe_rad",
    ])?;
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
    for part in &document.pixel {
        let trajectory = document.trajectory.iter().find(|t| t.estimate == part.stream);
        for (size, rmse) in &part.rmse_px {
            writer.write_record([
                cell(&part.stream),
                format!("{:?}", part.role).to_lowercase(),
                cell(&part.depth),
                size.to_string(),
                number(rmse.map(|r| r.mean)),
                number(rmse.map(|r| r.std)),
                rmse.map_or_else(String::new, |r| r.subsets.to_string()),
                number(part.pooled_rmse_px),
                part.scored.to_string(),
                part.skipped.len().to_string(),
                number(trajectory.and_then(|t| t.rmse_3d_m)),
                number(trajectory.and_then(|t| t.aoe_rad)),
                number(trajectory.and_then(|t| t.roe_rad)),
            ])?;
        }
    }
    let bytes = writer.into_inner().map_err(|e| e.into_error())?;
    Ok(String::from_utf8(bytes)?)
}

/// Text from data that a spreadsheet would take for a formula is kept from being one.
pub(crate) fn cell(text: &str) -> String {
    let numeric = text.parse::<f64>().is_ok_and(f64::is_finite);
    // Tab and carriage return are skipped by some programs before they look for the sign.
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) && !numeric {
        format!("'{}", printable(text))
    } else {
        printable(text)
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_formula_is_not_run() {
        assert_eq!(super::cell("=1+1"), "'=1+1");
        for formula in ["+x", "-x", "@sum(a1)", "\t=1", "-inf"] {
            assert!(super::cell(formula).starts_with('\''), "{formula}");
        }
        assert_eq!(super::cell("-1.5"), "-1.5");
        assert_eq!(super::cell("imu-euler"), "imu-euler");
    }
}
