//! The table as CSV, one line for each stream, depth source and subset size.

use vice_core::metrics::by_age::{AGES_S, MOTIONS_M};
use vice_core::result::WindowPart;

use super::held;
use crate::error::RunResult;
use crate::result::ResultDocument;

use crate::text::printable;

/// Columns: stream, role, depth, points, mean_px, std_px, subsets, pooled_px, scored, skipped, the trajectory errors of
/// estimates and how many poses they rest on; then of the labels that hold RMSE_2D with its interval, angle and offset,
/// the median of all, how many samples were set aside, and RMSE_2D with its interval by age and by metres moved.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if a text is none.
pub fn render(document: &ResultDocument) -> RunResult<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let columns = [
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
    ];
    let more =
        ["poses", "held_px", "low_95_px", "high_95_px", "held_mrad", "held_mm", "median_px", "set_aside"];
    let windows = windows();
    writer.write_record(columns.into_iter().map(String::from).chain(more.map(String::from)).chain(
        windows.iter().flat_map(|w| ["", "_low_95", "_high_95"].map(|end| format!("{}{end}_px", w.2))),
    ))?;
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
    for part in &document.pixel {
        let trajectory = document.trajectory.iter().find(|t| t.estimate == part.stream);
        for (size, rmse) in &part.rmse_px {
            let mut record = vec![
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
                trajectory.map_or_else(String::new, |t| t.matched.to_string()),
                number(part.held_rmse_px),
            ];
            let held = part.held.as_ref();
            record.extend([0, 1].map(|end| number(part.interval_95.map(|i| i[end]))));
            record.push(number(held.and_then(|h| h.mrad).map(|f| f.rmse)));
            record.push(number(held.and_then(|h| h.mm).map(|f| f.rmse)));
            record.push(number(held.and_then(|h| h.median_px)));
            record.push(held.map_or_else(String::new, |h| h.samples_set_aside().to_string()));
            for (age_s, moved_m, _) in &windows {
                let is_it = |w: &&WindowPart| w.age_s == *age_s && w.moved_m == *moved_m;
                let px = held::windows(part).find(is_it).and_then(|w| w.px);
                record.push(number(px.map(|f| f.rmse)));
                record.extend([0, 1].map(|end| number(px.and_then(|f| f.interval_95).map(|i| i[end]))));
            }
            writer.write_record(record)?;
        }
    }
    finished(writer)
}

/// Seconds or metres since the key frame, and the start of the columns' names.
fn windows() -> Vec<(Option<f64>, Option<f64>, String)> {
    let ages = AGES_S.map(|s| (Some(s), None, format!("age_{s}s")));
    let motions = MOTIONS_M.map(|m| (None, Some(m), format!("moved_{m}m")));
    ages.into_iter().chain(motions).collect()
}

/// The text of a writer.
pub(crate) fn finished(writer: csv::Writer<Vec<u8>>) -> RunResult<String> {
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
