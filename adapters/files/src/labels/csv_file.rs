//! Labels as CSV. Columns are found by their names, in any order.

use std::io::{self, Write};

use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelSet, LabelSetBuilder, Observation, ObservationSource};
use vice_core::time::Stamp;

use super::{label_error, no_labels};

const OCCLUDED: &str = "occluded";
const UNCERTAIN: &str = "uncertain";

/// Reads CSV with a heading. `source` is `manual` and `flags` empty where there are no such columns.
///
/// `flags` are `occluded` and `uncertain`, joined by `+` or `|`. Columns with other names are passed over with a warning.
///
/// # Errors
/// [`DataError`] with the line for a missing column, a field that cannot be read, and as [`LabelSet::from_rows`].
pub fn read_csv(bytes: &[u8]) -> DataResult<LabelSet> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // The reader's own trimming of fields allocates a record anew for each line.
    let mut csv = csv::ReaderBuilder::new().trim(csv::Trim::Headers).comment(Some(b'#')).from_reader(bytes);
    let mut lines = Lines { bytes, counted: 0, line: 1 };
    let heading = csv.headers().map_err(|e| csv_error(&e))?.clone();
    let heading_line = lines.at_end_of_record(csv.position());
    let columns = Columns::find(&heading).map_err(|e| e.line(heading_line))?;
    let mut labels = LabelSetBuilder::default();
    let mut any = false;
    let mut record = csv::StringRecord::new();
    loop {
        let read = csv.read_record(&mut record);
        let line = lines.at_end_of_record(csv.position());
        if !read.map_err(|e| csv_error(&e).line(line))? {
            return if any { labels.finish().map_err(|e| label_error(&e)) } else { Err(no_labels()) };
        }
        any = true;
        let observation = columns.observation(&record, line).map_err(|e| e.line(line))?;
        labels.push(columns.point(&record), observation).map_err(|e| label_error(&e))?;
    }
}

/// Counts lines. The reader's own count lags behind after comments, blank lines and CRLF.
struct Lines<'a> {
    bytes: &'a [u8],
    counted: usize,
    line: u64,
}

impl Lines<'_> {
    /// The line on which the record ends that the reader has just passed.
    fn at_end_of_record(&mut self, reader: &csv::Position) -> u64 {
        let passed = usize::try_from(reader.byte()).unwrap_or(usize::MAX).min(self.bytes.len());
        let record = self.bytes[..passed].trim_ascii_end();
        let newlines = record.get(self.counted..).unwrap_or_default().iter().filter(|b| **b == b'\n').count();
        self.line += newlines as u64;
        self.counted = self.counted.max(record.len());
        self.line
    }
}

/// Writes all columns, points in natural order, observations in time order. What a tracker says of its work
/// ([`vice_core::label::Provenance`]) has no column: JSON keeps it.
///
/// # Errors
/// [`io::Error`] of the writer.
pub fn write_csv(writer: &mut dyn Write, labels: &LabelSet) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(writer);
    csv.write_record(["point", "timestamp_ns", "u_px", "v_px", "keyframe", "source", "flags"])?;
    for point in labels.points() {
        for o in &point.observations {
            let marks = [(o.occluded, OCCLUDED), (o.uncertain, UNCERTAIN)];
            let flags: Vec<&str> = marks.iter().filter(|(set, _)| *set).map(|(_, name)| *name).collect();
            csv.write_record([
                point.name.as_str(),
                &o.stamp.to_string(),
                &o.px.u.to_string(),
                &o.px.v.to_string(),
                if o.keyframe { "1" } else { "0" },
                o.source.name(),
                &flags.join("+"),
            ])?;
        }
    }
    csv.flush()
}

/// Where the columns are.
struct Columns {
    point: usize,
    timestamp_ns: usize,
    u_px: usize,
    v_px: usize,
    keyframe: usize,
    source: Option<usize>,
    flags: Option<usize>,
}

impl Columns {
    fn find(heading: &csv::StringRecord) -> DataResult<Self> {
        let expected = "a heading `point,timestamp_ns,u_px,v_px,keyframe[,source,flags]` is expected";
        if heading.is_empty() {
            return Err(DataError::new("the file is empty").hint(expected));
        }
        let known = ["point", "timestamp_ns", "u_px", "v_px", "keyframe", "source", "flags"];
        let find = |name: &str| heading.iter().position(|column| column == name);
        let required = |name: &str| {
            find(name).ok_or_else(|| DataError::new(format!("the column {name} is missing")).hint(expected))
        };
        if let Some(twice) = known.iter().find(|n| heading.iter().filter(|c| c == *n).count() > 1) {
            return Err(DataError::new(format!("the column {twice} appears twice")));
        }
        let columns = Self {
            point: required("point")?,
            timestamp_ns: required("timestamp_ns")?,
            u_px: required("u_px")?,
            v_px: required("v_px")?,
            keyframe: required("keyframe")?,
            source: find("source"),
            flags: find("flags"),
        };
        for name in heading.iter().filter(|name| !known.contains(name)) {
            tracing::warn!("labels: column `{name}` is not known and passed over");
        }
        Ok(columns)
    }

    fn point<'r>(&self, record: &'r csv::StringRecord) -> &'r str {
        record.get(self.point).unwrap_or_default().trim()
    }

    fn observation(&self, record: &csv::StringRecord, line: u64) -> DataResult<Observation> {
        let field = |column: usize| record.get(column).unwrap_or_default().trim();
        let number = |column: usize, name: &str| {
            let text = field(column);
            text.parse::<f64>().map_err(|_| DataError::new(format!("{name}: `{text}` is no number")))
        };
        let stamp = Stamp::parse_nanos(field(self.timestamp_ns)).map_err(|_| {
            DataError::new(format!("timestamp_ns: `{}` is no time in ns", field(self.timestamp_ns)))
        })?;
        let keyframe = match field(self.keyframe) {
            "1" | "true" | "True" => true,
            "0" | "false" | "False" => false,
            other => return Err(DataError::new(format!("keyframe: `{other}` is neither 0 nor 1"))),
        };
        let source = match self.source.map(field).unwrap_or_default() {
            "" => ObservationSource::default(),
            name => ObservationSource::from_name(name).ok_or_else(|| {
                DataError::new(format!("source: `{name}` is not known"))
                    .hint("known: manual, auto, detected, interpolated")
            })?,
        };
        let (mut occluded, mut uncertain) = (false, false);
        for flag in self.flags.map(field).unwrap_or_default().split(['+', '|']).map(str::trim) {
            match flag {
                "" => {}
                OCCLUDED => occluded = true,
                UNCERTAIN => uncertain = true,
                other => {
                    return Err(DataError::new(format!("flags: `{other}` is not known"))
                        .hint("known: occluded, uncertain, joined by +"));
                }
            }
        }
        let px = Pixel::new(number(self.u_px, "u_px")?, number(self.v_px, "v_px")?);
        Ok(Observation { source, keyframe, occluded, uncertain, line, ..Observation::manual(stamp, px) })
    }
}

fn csv_error(error: &csv::Error) -> DataError {
    DataError::new(match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("expected {expected_len} columns, found {len}")
        }
        csv::ErrorKind::Utf8 { .. } => "the line is not UTF-8 text".to_string(),
        _ => format!("cannot be read as CSV: {error}"),
    })
}
