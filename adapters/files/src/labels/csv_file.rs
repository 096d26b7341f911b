//! Labels as CSV. Columns are found by their names, in any order, between commas, semicolons or tabs.

use std::io::{self, Write};

use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelSet, Observation, ObservationSource};

use super::by_camera::ByCamera;
use super::csv_columns::Columns;
use super::{LabelFile, label_error, no_labels, rounded};
use crate::leniency::Leniency;

pub(super) const OCCLUDED: &str = "occluded";
pub(super) const UNCERTAIN: &str = "uncertain";

/// Reads CSV with a heading. `source` is `manual` and `flags` empty where there are no such columns.
///
/// A column `camera` says whose labels they are; a file may hold those of several cameras: see [`LabelFile::of_camera`].
///
/// `flags` are `occluded` and `uncertain`, joined by `+` or `|`. Stamps are in the unit that the name of their column
/// says. A row whose pixel is NaN holds no label and is left out, unless it is a key frame.
///
/// # Errors
/// [`DataError`] with the line for a missing column, a field that cannot be read, stamps that were rounded, and as
/// [`LabelSet::from_rows`].
pub fn read_csv(bytes: &[u8]) -> DataResult<LabelSet> {
    read_csv_file(bytes)?.of_one_camera()
}

/// The same, with what was left out and columns that are not known.
///
/// # Errors
/// As [`read_csv`].
pub fn read_csv_file(bytes: &[u8]) -> DataResult<LabelFile> {
    read_sifted(bytes, 0)
}

/// The same, of a file out of which so many rows were passed over that hold labels.
pub(super) fn read_sifted(bytes: &[u8], passed: u64) -> DataResult<LabelFile> {
    let bytes = &*without_marks(bytes);
    // The reader's own trimming of fields allocates a record anew for each line.
    let mut csv = csv::ReaderBuilder::new()
        .trim(csv::Trim::Headers)
        .comment(Some(b'#'))
        .delimiter(delimiter(bytes))
        .from_reader(bytes);
    let mut lines = Lines { bytes, counted: 0, line: 1 };
    let heading = csv.headers().map_err(|e| csv_error(&e))?.clone();
    let heading_line = lines.at_end_of_record(csv.position());
    let mut columns = Columns::find(heading.iter()).map_err(|e| e.line(heading_line))?;
    let mut labels = ByCamera::default();
    let mut lenient = Leniency::new();
    // Stamps of few digits, and the largest number of these.
    let (mut rows, mut few, mut most_digits) = (passed, 0_u64, 0);
    let mut kept = usize::try_from(passed).unwrap_or(usize::MAX);
    lenient.rows(passed);
    let mut record = csv::StringRecord::new();
    loop {
        let read = csv.read_record(&mut record);
        let line = lines.at_end_of_record(csv.position());
        if !read.map_err(|e| csv_error(&e).line(line))? {
            break;
        }
        rows += 1;
        lenient.row();
        if let Some(digits) =
            rounded::digits_of_exponent_form(record.get(columns.timestamp).unwrap_or_default())
        {
            few += 1;
            most_digits = most_digits.max(digits);
        }
        let observation = observation(&mut columns, &record, line).map_err(|e| e.line(line))?;
        if !observation.keyframe && (observation.px.u.is_nan() || observation.px.v.is_nan()) {
            lenient.gap(line);
            continue;
        }
        kept += 1;
        let point = record.get(columns.point).unwrap_or_default().trim();
        let camera = columns.camera.and_then(|column| record.get(column)).unwrap_or_default().trim();
        labels.of(camera).push(point, observation).map_err(label_error)?;
    }
    if rows == 0 {
        return Err(no_labels());
    }
    // One stamp may end in zeros; all of them do only where something rounded them.
    if rows > 1 && few == rows {
        return Err(rounded::error(most_digits).line(heading_line + 1));
    }
    lenient.check(kept, "pixel")?;
    let mut file = labels.finish(|e| if few > 0 { rounded::error(most_digits) } else { label_error(e) })?;
    file.suspicions = lenient.suspicions("");
    file.suspicions.extend(columns.unknown_said());
    Ok(file)
}

/// Bytes without byte-order marks where a line starts.
fn without_marks(bytes: &[u8]) -> std::borrow::Cow<'_, [u8]> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if !bytes.windows(4).any(|w| w == b"\n\xef\xbb\xbf") {
        return bytes.into();
    }
    let mut without = Vec::with_capacity(bytes.len());
    for (i, line) in bytes.split(|b| *b == b'\n').enumerate() {
        if i > 0 {
            without.push(b'\n');
        }
        without.extend_from_slice(line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line));
    }
    without.into()
}

/// What stands between the names of the heading, as spreadsheets of some countries have it.
pub(super) fn delimiter(bytes: &[u8]) -> u8 {
    let is_heading = |line: &&[u8]| !line.trim_ascii().is_empty() && !line.starts_with(b"#");
    let heading = bytes.split(|b| *b == b'\n').find(is_heading).unwrap_or_default();
    match heading {
        line if line.contains(&b',') => b',',
        line if line.contains(&b';') => b';',
        line if line.contains(&b'\t') => b'\t',
        _ => b',',
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

/// Writes all columns, `camera` where the labels say theirs, points in natural order, observations in time order. What a tracker says of its work
/// ([`vice_core::label::Provenance`]) has no column: JSON keeps it.
///
/// # Errors
/// [`io::Error`] of the writer.
pub fn write_csv(writer: &mut dyn Write, labels: &LabelSet) -> io::Result<()> {
    // A name that begins as a byte-order mark does would be taken for one where a line starts.
    let marked = labels.points().iter().any(|p| p.name.starts_with('\u{feff}'));
    let quotes = if marked { csv::QuoteStyle::Always } else { csv::QuoteStyle::Necessary };
    let mut csv = csv::WriterBuilder::new().quote_style(quotes).from_writer(writer);
    let heading = ["point", "timestamp_ns", "u_px", "v_px", "keyframe", "source", "flags"];
    csv.write_record(heading.into_iter().chain(labels.camera.as_ref().map(|_| "camera")))?;
    for point in labels.points() {
        for o in &point.observations {
            let marks = [(o.occluded, OCCLUDED), (o.uncertain, UNCERTAIN)];
            let flags: Vec<&str> = marks.iter().filter(|(set, _)| *set).map(|(_, name)| *name).collect();
            let cells = [
                point.name.as_str(),
                &o.stamp.to_string(),
                &o.px.u.to_string(),
                &o.px.v.to_string(),
                if o.keyframe { "1" } else { "0" },
                o.source.name(),
                &flags.join("+"),
            ];
            csv.write_record(cells.into_iter().chain(labels.camera.as_deref()))?;
        }
    }
    csv.flush()
}

fn observation(columns: &mut Columns, record: &csv::StringRecord, line: u64) -> DataResult<Observation> {
    let field = |column: usize| record.get(column).unwrap_or_default().trim();
    let number = |column: usize, name: &str| {
        let text = field(column);
        if text.get(..3).is_some_and(|t| t.eq_ignore_ascii_case("nan")) {
            return Ok(f64::NAN);
        }
        text.parse::<f64>().map_err(|_| DataError::new(format!("{name}: `{text}` is no number")))
    };
    let text = field(columns.timestamp);
    let stamp = columns.stamp(text).map_err(|_| {
        DataError::new(format!("timestamp_ns: `{text}` is no time in {}", columns.unit_name()))
    })?;
    let keyframe = match field(columns.keyframe) {
        "1" | "true" | "True" => true,
        "0" | "false" | "False" => false,
        other => return Err(DataError::new(format!("keyframe: `{other}` is neither 0 nor 1"))),
    };
    let source = match columns.source.map(field).unwrap_or_default() {
        "" => ObservationSource::default(),
        name => ObservationSource::from_name(name).ok_or_else(|| {
            DataError::new(format!("source: `{name}` is not known"))
                .hint("known: manual, auto, detected, interpolated")
        })?,
    };
    let (mut occluded, mut uncertain) = (false, false);
    for flag in columns.flags.map(field).unwrap_or_default().split(['+', '|']).map(str::trim) {
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
    let px = Pixel::new(number(columns.u_px, "u_px")?, number(columns.v_px, "v_px")?);
    Ok(Observation { source, keyframe, occluded, uncertain, line, ..Observation::manual(stamp, px) })
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
