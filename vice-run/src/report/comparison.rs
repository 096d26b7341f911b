//! Results side by side: which are compared, and the document `vice.comparison/1` as text, CSV and LaTeX.

use std::fmt::Write;

use crate::error::RunResult;
use crate::result::ResultDocument;
use serde::Serialize;
use vice_core::fleet::{FleetDifference, FlightErrors, difference};
use vice_core::paired::{Paired, paired};
use vice_core::result::{PixelPart, Role};

use super::csv::{cell, finished};
use super::difference::{interval, verdict};
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
    /// What is compared where nothing is said: runs; with one result of each recording its streams, or its depth sources
    /// where there is one stream.
    pub fn usual(runs: &[NamedRun]) -> Self {
        let alone = runs.first().filter(|_| flight_count(runs) == runs.len());
        let Some((_, only)) = alone else { return Self::Runs };
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
    /// The same pair over several recordings, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub over_flights: Vec<OverFlights>,
}

/// A run with its name.
pub type NamedRun = (String, ResultDocument);

impl Document {
    /// Compares all pairs of a kind; pairs without a label in common are told to `warn`.
    pub fn of(runs: &[NamedRun], by: By, seed: u64, warn: &dyn Fn(String)) -> Self {
        let mut comparisons = Vec::new();
        let pairs = pairs(runs, by);
        let over_flights = if flight_count(runs) > 1 { over_flights(&pairs, by, seed) } else { vec![] };
        for (a, b) in pairs {
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
        let (schema, vice_version) = ("vice.comparison/1", env!("CARGO_PKG_VERSION"));
        Self { schema, vice_version, by, seed, comparisons, over_flights }
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

/// The results by what they are of, each with those that are held against its first.
fn by_flight(runs: &[NamedRun]) -> Vec<Vec<&NamedRun>> {
    let flight = |run: &NamedRun| {
        let dataset = &run.1.dataset;
        (dataset.name.clone(), dataset.camera.clone(), dataset.first_frame_ns)
    };
    let mut flights: Vec<Vec<&NamedRun>> = Vec::new();
    for run in runs {
        match flights.iter_mut().find(|f| flight(f[0]) == flight(run)) {
            Some(of_flight) => of_flight.push(run),
            None => flights.push(vec![run]),
        }
    }
    flights
}

/// How many different recordings the results are of.
fn flight_count(runs: &[NamedRun]) -> usize {
    by_flight(runs).len()
}

fn between_runs(runs: &[NamedRun]) -> Vec<(Entry<'_>, Entry<'_>)> {
    let mut pairs = Vec::new();
    for flight in by_flight(runs) {
        let Some(((first_name, first), others)) = flight.split_first().map(|(f, o)| ((&f.0, &f.1), o)) else {
            continue;
        };
        for (name, document) in others {
            for a in &first.pixel {
                let candidates = || document.pixel.iter().filter(|p| p.role == a.role && p.depth == a.depth);
                // A file that was given another name is the same estimate where there is only one in each.
                let alone = first.pixel.iter().filter(|p| p.role == a.role && p.depth == a.depth).count()
                    == 1
                    && candidates().count() == 1;
                if let Some(b) = candidates().find(|p| alone || p.stream == a.stream) {
                    pairs.push((Entry { run: first_name, part: a }, Entry { run: name, part: b }));
                }
            }
        }
    }
    pairs
}

/// A pair of sides over the flights that have it.
#[derive(Debug, Serialize)]
pub struct OverFlights {
    /// What is held against ...
    pub a: String,
    /// ... this.
    pub b: String,
    /// The differences.
    #[serde(flatten)]
    pub difference: FleetDifference,
}

/// What pairs are the same pair on another flight, and its errors there.
fn over_flights(pairs: &[(Entry<'_>, Entry<'_>)], by: By, seed: u64) -> Vec<OverFlights> {
    let name = |entry: &Entry<'_>, side: &str| {
        let PixelPart { stream, depth, .. } = entry.part;
        match by {
            By::Runs => format!("{side} result: {stream} with {depth}"),
            By::Streams | By::Depths => format!("{stream} with {depth}"),
        }
    };
    let mut same: Vec<((String, String), Vec<FlightErrors>)> = Vec::new();
    for (a, b) in pairs {
        let errors = FlightErrors::of_samples(&[vec![&a.part.samples], vec![&b.part.samples]]);
        let Some(errors) = errors else { continue };
        let names = (name(a, "first"), name(b, "later"));
        match same.iter_mut().find(|(n, _)| *n == names) {
            Some((_, flights)) => flights.push(errors),
            None => same.push((names, vec![errors])),
        }
    }
    let several = same.into_iter().filter(|(_, flights)| flights.len() > 1);
    let found = several
        .filter_map(|((a, b), flights)| Some(OverFlights { a, b, difference: difference(&flights, seed)? }));
    found.collect()
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
            verdict(&p.rmse_difference_px).to_string(),
        ]);
    }
    let mut text =
        "RMSE_2D at the labels that both scored; intervals by resampling points and segments\n\n".to_string();
    text.push_str(&align(&grid));
    if !document.over_flights.is_empty() {
        let head = ["A", "B", "flights", "A px", "B px", "B - A px [95 %]", "B nearer on", ""];
        let mut grid = vec![head.map(String::from).to_vec()];
        for OverFlights { a, b, difference: d } in &document.over_flights {
            grid.push(vec![
                printable(a),
                printable(b),
                d.flights.to_string(),
                format!("{:.3}", d.a_px),
                format!("{:.3}", d.b_px),
                interval(&d.difference_px, 3),
                format!("{} of {}", d.b_nearer, d.flights),
                verdict(&d.difference_px).to_string(),
            ]);
        }
        text.push_str("\nover the flights: mean of their RMSE_2D at the labels that both scored\n\n");
        text.push_str(&align(&grid));
    }
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
    fn results_of_several_recordings_are_compared_recording_by_recording() {
        let of = |name: &str, flight: &str, error: f64| {
            let mut run = run(name, &[("e", error), ("f", 2.0 * error)]);
            run.1.dataset.name = flight.to_string();
            run
        };
        let runs = [of("a1", "one", 1.0), of("a2", "two", 1.2), of("b1", "one", 3.0), of("b2", "two", 3.4)];
        assert_eq!(flight_count(&runs), 2);
        let made = Document::of(&runs, By::Runs, 1, &|_| {});
        let names: Vec<_> = made.comparisons.iter().map(|c| (c.a.run.as_str(), c.b.run.as_str())).collect();
        assert_eq!(names, [("a1", "b1"), ("a1", "b1"), ("a2", "b2"), ("a2", "b2")]);
        let [e, f] = &made.over_flights[..] else { panic!("{:?}", made.over_flights) };
        assert_eq!((e.a.as_str(), e.difference.flights), ("first result: e with floor", 2));
        assert!((e.difference.difference_px.value - 2.1).abs() < 1e-12);
        assert!((f.difference.difference_px.value - 4.2).abs() < 1e-12);
        assert!(text(&made).contains("over the flights"));
        // The streams of each recording, and over both.
        let made = Document::of(&runs[..2], By::Streams, 1, &|_| {});
        assert_eq!((made.comparisons.len(), made.over_flights.len()), (2, 1));
        assert_eq!(made.over_flights[0].b, "f with floor");
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
