//! Results side by side: which are compared, and the document `vice.comparison/1` as text, CSV and LaTeX.

use std::fmt::Write;

use crate::error::RunResult;
use crate::result::ResultDocument;
use serde::Serialize;
use vice_core::paired::{Paired, paired};
use vice_core::result::{PixelPart, Role};
use vice_core::statistics::WithInterval;

use super::csv::{cell, finished};
use super::latex::escape;
use super::table::align;
use crate::text::printable;

/// What is held against each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// The same stream and depth source in each file, against the first file
    Runs,
    /// The streams of a file, against its first estimate
    Streams,
    /// The depth sources of a stream, against the first
    Depths,
}

impl By {
    /// What is compared where nothing is said: runs, else the streams of the only one, else its depth sources.
    pub fn usual(runs: &[NamedRun]) -> Self {
        let [(_, only)] = runs else { return Self::Runs };
        let first = only.pixel.first();
        let several =
            first.is_some_and(|f| only.pixel.iter().any(|p| p.stream != f.stream || p.role != f.role));
        if several { Self::Streams } else { Self::Depths }
    }
}

impl std::str::FromStr for By {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "runs" => Ok(Self::Runs),
            "streams" => Ok(Self::Streams),
            "depths" => Ok(Self::Depths),
            _ => Err("expected runs, streams or depths".to_string()),
        }
    }
}

/// One of the two sides.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Side {
    /// Name of the run.
    pub run: String,
    /// The pose stream.
    pub stream: String,
    /// Its role.
    pub role: Role,
    /// The depth source.
    pub depth: String,
}

/// A comparison of two sides.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// What is held against ...
    pub a: Side,
    /// ... this.
    pub b: Side,
    /// The paired differences.
    #[serde(flatten)]
    pub paired: Paired,
}

/// The document.
#[derive(Debug, Serialize)]
pub struct Document {
    schema: &'static str,
    vice_version: &'static str,
    by: By,
    seed: u64,
    /// The comparisons.
    pub comparisons: Vec<Comparison>,
}

/// A run with its name.
pub type NamedRun = (String, ResultDocument);

impl Document {
    /// Compares all pairs of a kind; pairs without a label in common are told to `warn`.
    pub fn of(runs: &[NamedRun], by: By, seed: u64, warn: &dyn Fn(String)) -> Self {
        let mut comparisons = Vec::new();
        for (a, b) in pairs(runs, by) {
            let sides = (a.side(), b.side());
            match paired(a.part, b.part, seed) {
                Some(paired) => {
                    if paired.moved_labels > 0 {
                        warn(format!(
                            "{} and {}: {} labels are not at the same pixel, so that not the same is compared",
                            sides.0.name(),
                            sides.1.name(),
                            paired.moved_labels
                        ));
                    }
                    comparisons.push(Comparison { a: sides.0, b: sides.1, paired });
                }
                None => {
                    warn(format!("{} and {} have no scored label in common", sides.0.name(), sides.1.name()))
                }
            }
        }
        Self { schema: "vice.comparison/1", vice_version: env!("CARGO_PKG_VERSION"), by, seed, comparisons }
    }
}

impl Side {
    /// Run, stream and depth source in words.
    pub fn name(&self) -> String {
        let role = if self.role == Role::Reference { " (reference)" } else { "" };
        format!("{}: {}{role} with {}", self.run, self.stream, self.depth)
    }
}

struct Entry<'a> {
    run: &'a str,
    part: &'a PixelPart,
}

impl Entry<'_> {
    fn side(&self) -> Side {
        let PixelPart { stream, role, depth, .. } = self.part;
        Side { run: self.run.to_string(), stream: stream.clone(), role: *role, depth: depth.clone() }
    }
}

fn pairs(runs: &[NamedRun], by: By) -> Vec<(Entry<'_>, Entry<'_>)> {
    match by {
        By::Runs => between_runs(runs),
        By::Streams => within(runs, |a, b| a.depth == b.depth),
        By::Depths => within(runs, |a, b| a.stream == b.stream && a.role == b.role),
    }
}

/// Each part against the first of its run that it is comparable with.
fn within(runs: &[NamedRun], alike: impl Fn(&PixelPart, &PixelPart) -> bool) -> Vec<(Entry<'_>, Entry<'_>)> {
    let mut pairs = Vec::new();
    for (run, document) in runs {
        let estimates = || document.pixel.iter().filter(|p| p.role == Role::Estimate);
        for part in &document.pixel {
            let first = estimates().chain(&document.pixel).find(|p| alike(p, part));
            if let Some(first) = first.filter(|first| !std::ptr::eq(*first, part)) {
                pairs.push((Entry { run, part: first }, Entry { run, part }));
            }
        }
    }
    pairs
}

fn between_runs(runs: &[NamedRun]) -> Vec<(Entry<'_>, Entry<'_>)> {
    let Some(((first_name, first), others)) = runs.split_first() else { return vec![] };
    let mut pairs = Vec::new();
    for (name, document) in others {
        for a in &first.pixel {
            let candidates = || document.pixel.iter().filter(|p| p.role == a.role && p.depth == a.depth);
            // A file that was given another name is the same estimate where there is only one in each.
            let alone = first.pixel.iter().filter(|p| p.role == a.role && p.depth == a.depth).count() == 1
                && candidates().count() == 1;
            if let Some(b) = candidates().find(|p| alone || p.stream == a.stream) {
                pairs.push((Entry { run: first_name, part: a }, Entry { run: name, part: b }));
            }
        }
    }
    pairs
}

fn interval(number: &WithInterval, decimals: usize) -> String {
    match number.interval_95 {
        Some([low, high]) => format!("{:+.decimals$} [{low:+.decimals$}, {high:+.decimals$}]", number.value),
        None => format!("{:+.decimals$} [-]", number.value),
    }
}

/// What the interval allows to say.
fn verdict(p: &Paired) -> &'static str {
    match p.rmse_difference_px.interval_95 {
        Some([low, _]) if low > 0.0 => "B is worse",
        Some([_, high]) if high < 0.0 => "B is better",
        Some(_) => "not told apart",
        None => "too little to tell",
    }
}

/// The table on the terminal.
pub fn text(document: &Document) -> String {
    let head =
        ["A", "B", "labels", "A px", "B px", "B - A px [95 %]", "mean B - A px [95 %]", "B nearer", ""];
    let mut grid = vec![head.map(String::from).to_vec()];
    for c in &document.comparisons {
        let p = &c.paired;
        grid.push(vec![
            printable(&c.a.name()),
            printable(&c.b.name()),
            p.labels.to_string(),
            format!("{:.3}", p.rmse_a_px),
            format!("{:.3}", p.rmse_b_px),
            interval(&p.rmse_difference_px, 3),
            interval(&p.mean_difference_px, 3),
            format!("{:.0} %", 100.0 * p.b_nearer_share),
            verdict(p).to_string(),
        ]);
    }
    let mut text =
        "RMSE_2D at the labels that both scored; intervals by resampling points and segments\n\n".to_string();
    text.push_str(&align(&grid));
    for c in document.comparisons.iter().filter(|c| c.paired.only_a + c.paired.only_b > 0) {
        text.push_str(&format!(
            "{} labels only in A ({}), {} only in B ({})\n",
            c.paired.only_a,
            printable(&c.a.name()),
            c.paired.only_b,
            printable(&c.b.name())
        ));
    }
    text
}

/// One line a comparison.
pub fn csv(document: &Document) -> RunResult<String> {
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "run_a",
        "stream_a",
        "depth_a",
        "run_b",
        "stream_b",
        "depth_b",
        "labels",
        "only_a",
        "only_b",
        "rmse_a_px",
        "rmse_b_px",
        "rmse_difference_px",
        "rmse_difference_low_px",
        "rmse_difference_high_px",
        "mean_difference_px",
        "mean_difference_low_px",
        "mean_difference_high_px",
        "b_nearer_share",
    ])?;
    for c in &document.comparisons {
        let p = &c.paired;
        let mut record: Vec<String> =
            [&c.a, &c.b].iter().flat_map(|s| [cell(&s.run), cell(&s.stream), cell(&s.depth)]).collect();
        record.extend([p.labels, p.only_a, p.only_b].map(|n| n.to_string()));
        record.extend([p.rmse_a_px, p.rmse_b_px].map(|v| v.to_string()));
        for number in [p.rmse_difference_px, p.mean_difference_px] {
            let ends = number.interval_95.map_or([None; 2], |i| i.map(Some));
            record.push(number.value.to_string());
            record.extend(ends.map(|v| v.map_or_else(String::new, |v| v.to_string())));
        }
        record.push(p.b_nearer_share.to_string());
        writer.write_record(record)?;
    }
    finished(writer)
}

/// A `tabular` to `\input`; it needs the package booktabs.
pub fn latex(document: &Document) -> RunResult<String> {
    let mut text = String::new();
    writeln!(text, "\\begin{{tabular}}{{llrrrr}}")?;
    writeln!(text, "\\toprule")?;
    writeln!(text, "A & B & Labels & A (px) & B (px) & B $-$ A (px) \\\\")?;
    writeln!(text, "\\midrule")?;
    for c in &document.comparisons {
        let p = &c.paired;
        writeln!(
            text,
            "{} & {} & {} & {:.2} & {:.2} & ${}$ \\\\",
            escape(&c.a.name()),
            escape(&c.b.name()),
            p.labels,
            p.rmse_a_px,
            p.rmse_b_px,
            interval(&p.rmse_difference_px, 2)
        )?;
    }
    writeln!(text, "\\bottomrule")?;
    writeln!(text, "\\end{{tabular}}")?;
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{HOSTILE, document, hostile_document, part, sample};

    fn run(name: &str, errors: &[(&str, f64)]) -> NamedRun {
        let parts = errors
            .iter()
            .map(|(stream, error)| part(stream, &[sample("a", 1, *error), sample("b", 2, *error)]));
        (name.to_string(), document(parts.collect()))
    }

    fn names(runs: &[NamedRun], by: By) -> Vec<String> {
        let made = Document::of(runs, by, 1, &|_| {});
        made.comparisons.iter().map(|c| format!("{} < {}", c.a.name(), c.b.name())).collect()
    }

    #[test]
    fn runs_streams_and_depths_are_paired() {
        let runs = [run("x", &[("e", 1.0), ("f", 2.0)]), run("y", &[("e", 3.0), ("f", 4.0)])];
        assert_eq!(
            names(&runs, By::Runs),
            ["x: e with floor < y: e with floor", "x: f with floor < y: f with floor"]
        );
        assert_eq!(names(&runs[..1], By::Streams), ["x: e with floor < x: f with floor"]);
        assert!(names(&runs, By::Depths).is_empty());
        let renamed = [run("x", &[("old", 1.0)]), run("y", &[("new", 3.0)])];
        assert_eq!(names(&renamed, By::Runs), ["x: old with floor < y: new with floor"]);
    }

    #[test]
    fn hostile_names_stay_text() {
        let runs = [(HOSTILE.to_string(), hostile_document()), ("b".to_string(), hostile_document())];
        let made = Document::of(&runs, By::Runs, 1, &|_| {});
        assert_eq!(made.comparisons.len(), 1);
        assert!(!text(&made).contains('\u{1b}'));
        assert!(!latex(&made).unwrap().contains("\\input"));
        let table = csv(&made).unwrap();
        assert!(table.lines().nth(1).unwrap().starts_with("\"'=x"), "{table}");
    }
}
