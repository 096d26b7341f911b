//! The exponents, as a table.

use std::fmt::Write as _;
use std::path::Path;

use crate::Result;
use crate::measure::Cost;

/// Above this a command is at fault.
const FAULT: f64 = 1.2;
/// Less than this is the noise of starting a program, seconds.
const NOISE: f64 = 0.004;

/// A command, and what it costs by size.
pub(crate) struct Row {
    pub(crate) command: &'static str,
    pub(crate) grows: &'static str,
    pub(crate) reason: Option<&'static str>,
    pub(crate) measured: Vec<(usize, Cost)>,
}

impl Row {
    /// Of the last two sizes; `None` where its lower end is noise or there is none.
    pub(crate) fn exponent(&self) -> Option<f64> {
        let [.., (n, before), (m, after)] = self.measured.as_slice() else { return None };
        let decades = (*m as f64 / *n as f64).log10();
        // What is lost in noise at the lower end is at most the noise.
        let ratio = after.seconds.max(NOISE) / before.seconds.max(NOISE);
        (after.seconds > 2.0 * NOISE).then(|| ratio.log10() / decades)
    }
}

/// The table, in Markdown.
pub(crate) fn render(rows: &[Row], start_seconds: f64) -> String {
    let mut text = format!(
        "Seconds are the least of several runs, less the {:.0} ms that the program takes to start. The exponent is that of the last two \
         sizes.\n\n| command | what grows | sizes | seconds | exponent | peak MiB |\n| --- | --- | --- | --- | --- | --- |\n",
        1e3 * start_seconds
    );
    let mut faults = String::new();
    for row in rows {
        let list = |each: &dyn Fn(&(usize, Cost)) -> String| {
            row.measured.iter().map(each).collect::<Vec<_>>().join(" / ")
        };
        let exponent = row.exponent();
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} |",
            row.command,
            row.grows,
            list(&|(n, _)| n.to_string()),
            list(&|(_, cost)| format!("{:.3}", cost.seconds)),
            exponent.map_or_else(|| "in the noise".to_string(), |e| format!("{e:.2}")),
            list(&|(_, cost)| format!("{:.0}", cost.peak_mib)),
        );
        if let Some(exponent) = exponent.filter(|e| *e > FAULT) {
            let why = row.reason.unwrap_or("a fault: no reason is known");
            let _ = writeln!(faults, "- {}, {}: {exponent:.2}, {why}", row.command, row.grows);
        }
    }
    match faults.is_empty() {
        true => format!("{text}\nNo exponent is above {FAULT}.\n"),
        false => format!("{text}\nAbove {FAULT}:\n{faults}"),
    }
}

const BEGIN: &str = "<!-- scaling: begin -->\n";
const END: &str = "<!-- scaling: end -->\n";

/// Puts the table between the markers of a page.
pub(crate) fn replace(path: &Path, text: &str) -> Result<()> {
    let page = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let parts = page.split_once(BEGIN).and_then(|(before, rest)| Some((before, rest.split_once(END)?.1)));
    let (before, after) = parts.ok_or_else(|| format!("{}: the markers are missing", path.display()))?;
    std::fs::write(path, format!("{before}{BEGIN}{text}{END}{after}"))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(seconds: &[f64]) -> Row {
        let cost = |(i, s): (usize, &f64)| (10_usize.pow(3 + i as u32), Cost { seconds: *s, peak_mib: 1.0 });
        let measured = seconds.iter().enumerate().map(cost).collect();
        Row { command: "`vice x`", grows: "poses", reason: None, measured }
    }

    #[test]
    fn an_exponent_is_of_the_last_decade() {
        assert!((row(&[0.01, 0.1, 10.0]).exponent().unwrap() - 2.0).abs() < 1e-12);
        assert!((row(&[0.0, 0.004, 0.04]).exponent().unwrap() - 1.0).abs() < 1e-12);
        assert!(row(&[0.0, 0.0, 0.005]).exponent().is_none() && row(&[3.0]).exponent().is_none());
        let text = render(&[row(&[0.01, 0.1, 10.0]), row(&[0.01, 0.1, 1.0])], 0.003);
        assert!(text.contains("| 1000 / 10000 / 100000 | 0.010 / 0.100 / 10.000 | 2.00 |"), "{text}");
        assert!(text.contains("- `vice x`, poses: 2.00, a fault"), "{text}");
        assert!(render(&[row(&[0.01, 0.1, 1.0])], 0.003).contains("No exponent"));
    }
}
