//! Rows of separated text, one at a time: the reader under trajectories and sensor lists.
//!
//! A line is split at commas where it has any, else at semicolons, else at white space. Blank lines and lines that
//! start with `#` are skipped; a byte-order mark and CRLF are accepted. One buffer is reused for all rows.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use vice_core::error::{DataError, DataResult};
use vice_core::time::{Stamp, TimeError};

/// Bytes beyond which a line is not text in rows.
const MAX_LINE_BYTES: usize = 1 << 16;

/// Reads rows from text.
#[derive(Debug)]
pub struct Rows<R> {
    reader: R,
    buffer: Vec<u8>,
    fields: Vec<(u32, u32)>,
    line: u64,
}

/// One row. It borrows the reader's buffer.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    text: &'a str,
    fields: &'a [(u32, u32)],
    separator: Separator,
    line: u64,
    ends: bool,
}

/// What stands between the fields of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    /// A comma.
    Comma,
    /// A semicolon.
    Semicolon,
    /// Blanks and tabs.
    Space,
}

/// Opens a file of rows.
///
/// # Errors
/// [`DataError`] with the path if it cannot be opened.
pub fn open(path: impl AsRef<Path>) -> DataResult<Rows<BufReader<File>>> {
    let path = path.as_ref();
    let failed = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::new("no such file").at(path),
        _ => DataError::new("cannot be read").at(path).because(e),
    };
    let file = File::open(path).map_err(failed)?;
    if file.metadata().map_err(failed)?.is_dir() {
        return Err(DataError::new("is a folder, not a file").at(path));
    }
    Ok(Rows::new(BufReader::with_capacity(1 << 18, file)))
}

impl<R: BufRead> Rows<R> {
    /// Reads from any source.
    pub fn new(reader: R) -> Self {
        Self { reader, buffer: Vec::new(), fields: Vec::new(), line: 0 }
    }

    /// The next row, `None` at the end.
    ///
    /// # Errors
    /// [`DataError`] with the line if it is not UTF-8, far too long, or cannot be read. The path is the caller's to add.
    pub fn next_row(&mut self) -> DataResult<Option<Row<'_>>> {
        // In two steps, since a row borrows the buffer that the search for it fills.
        if !self.advance()? {
            return Ok(None);
        }
        let ends = self.buffer.last() == Some(&b'\n');
        let text = text_of(&self.buffer, self.line)?;
        let separator = split(text, &mut self.fields);
        Ok(Some(Row { text, fields: &self.fields, separator, line: self.line, ends }))
    }

    /// Fills the buffer with the next line that holds a row; false at the end.
    fn advance(&mut self) -> DataResult<bool> {
        loop {
            self.buffer.clear();
            self.line += 1;
            let mut limited = (&mut self.reader).take(MAX_LINE_BYTES as u64 + 1);
            let read = limited
                .read_until(b'\n', &mut self.buffer)
                .map_err(|e| DataError::new("cannot be read").line(self.line).because(e))?;
            if read == 0 {
                return Ok(false);
            }
            if read > MAX_LINE_BYTES {
                return Err(
                    DataError::new("the line is longer than 64 KiB: this is no text in rows").line(self.line)
                );
            }
            if self.line == 1 && self.buffer.starts_with(b"\xef\xbb\xbf") {
                self.buffer.drain(..3);
            }
            let first = self.buffer.iter().find(|b| !b.is_ascii_whitespace());
            if first.is_some_and(|b| *b != b'#') {
                return Ok(true);
            }
        }
    }
}

fn text_of(buffer: &[u8], line: u64) -> DataResult<&str> {
    std::str::from_utf8(buffer)
        .map(|text| text.trim_matches(|c: char| c.is_ascii_whitespace()))
        .map_err(|_| DataError::new("the line is not UTF-8 text").line(line))
}

/// Finds the fields of a trimmed, non-empty line as byte ranges.
fn split(text: &str, fields: &mut Vec<(u32, u32)>) -> Separator {
    fields.clear();
    let bytes = text.as_bytes();
    let mut push = |from: usize, to: usize| fields.push((from as u32, to as u32));
    let separator = if bytes.contains(&b',') {
        (b',', Separator::Comma)
    } else if bytes.contains(&b';') {
        (b';', Separator::Semicolon)
    } else {
        let mut from = None;
        for (at, byte) in bytes.iter().enumerate() {
            match (byte.is_ascii_whitespace(), from) {
                (false, None) => from = Some(at),
                (true, Some(start)) => {
                    push(start, at);
                    from = None;
                }
                _ => {}
            }
        }
        if let Some(start) = from {
            push(start, bytes.len());
        }
        return Separator::Space;
    };
    let mut from = 0;
    for (at, byte) in bytes.iter().enumerate() {
        if *byte == separator.0 {
            push(from, at);
            from = at + 1;
        }
    }
    // One separator after the last field is a habit of some writers, not an empty field.
    if from < bytes.len() {
        push(from, bytes.len());
    }
    separator.1
}

impl<'a> Row<'a> {
    /// Line in the file, counted from 1.
    pub const fn line(&self) -> u64 {
        self.line
    }

    /// Number of fields.
    pub const fn len(&self) -> usize {
        self.fields.len()
    }

    /// Whether there is no field, as in a line of separators only.
    pub const fn is_empty(&self) -> bool {
        self.fields.is_empty()
    }

    /// What stands between the fields.
    pub const fn separator(&self) -> Separator {
        self.separator
    }

    /// The whole line without the white space around it.
    pub const fn text(&self) -> &'a str {
        self.text
    }

    /// A field without the white space around it; `None` past the last.
    pub fn field(&self, column: usize) -> Option<&'a str> {
        let (from, to) = *self.fields.get(column)?;
        Some(self.text[from as usize..to as usize].trim_ascii())
    }

    /// Checks that there are at least `expected` columns.
    ///
    /// # Errors
    /// [`DataError`] with the line; a last line without a line end is said to be cut off.
    pub fn expect_columns(&self, expected: usize) -> DataResult<()> {
        if self.len() >= expected {
            return Ok(());
        }
        let cut = if self.ends { "" } else { ": the last row is cut off" };
        Err(self.error(format!("expected {expected} columns, found {}{cut}", self.len())))
    }

    /// A finite number.
    ///
    /// # Errors
    /// [`DataError`] with line and column if the field is missing, no number, NaN or infinite.
    pub fn number(&self, column: usize) -> DataResult<f64> {
        let text = self.required(column)?;
        let value: f64 =
            text.parse().map_err(|_| self.error(format!("column {}: `{text}` is no number", column + 1)))?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.error(format!("column {}: {text} is not finite", column + 1)))
        }
    }

    /// `N` finite numbers from a column on.
    ///
    /// # Errors
    /// As [`Row::number`].
    pub fn numbers<const N: usize>(&self, from: usize) -> DataResult<[f64; N]> {
        let mut values = [0.0; N];
        for (i, value) in values.iter_mut().enumerate() {
            *value = self.number(from + i)?;
        }
        Ok(values)
    }

    /// A stamp in decimal seconds, exact.
    ///
    /// # Errors
    /// [`DataError`] with the line if the field is no time, with the unit it looks like where it is far too large.
    pub fn seconds(&self, column: usize) -> DataResult<Stamp> {
        let text = self.required(column)?;
        Stamp::parse_seconds(text).map_err(|e| match e {
            TimeError::OutOfRange(_) => self
                .error(format!("column {}: {text} seconds is no plausible time", column + 1))
                .hint(format!("{}; seconds are expected here", looks_like(text))),
            _ => self.no_time(column, text, e),
        })
    }

    /// A stamp in nanoseconds.
    ///
    /// # Errors
    /// [`DataError`] with the line if the field is no time, or has a fraction, as seconds have.
    pub fn nanos(&self, column: usize) -> DataResult<Stamp> {
        let text = self.required(column)?;
        let fraction = text.split_once('.').map_or("", |(_, fraction)| fraction);
        if fraction.bytes().all(|b| b.is_ascii_digit()) && fraction.bytes().any(|b| b != b'0') {
            return Err(self
                .error(format!("column {}: {text} is no whole number of nanoseconds", column + 1))
                .hint("the stamps look like seconds or milliseconds; nanoseconds are expected here"));
        }
        Stamp::parse_nanos(text).map_err(|e| self.no_time(column, text, e))
    }

    /// A stamp in microseconds.
    ///
    /// # Errors
    /// [`DataError`] with the line if the field is no time.
    pub fn micros(&self, column: usize) -> DataResult<Stamp> {
        let text = self.required(column)?;
        Stamp::parse_micros(text).map_err(|e| self.no_time(column, text, e))
    }

    /// An error at this row.
    pub fn error(&self, problem: impl Into<String>) -> DataError {
        DataError::new(problem).line(self.line)
    }

    fn required(&self, column: usize) -> DataResult<&'a str> {
        match self.field(column) {
            Some("") => Err(self.error(format!("column {} is empty", column + 1))),
            Some(text) => Ok(text),
            None => {
                self.expect_columns(column + 1)?;
                Err(self.error(format!("column {} is missing", column + 1)))
            }
        }
    }

    fn no_time(&self, column: usize, text: &str, error: TimeError) -> DataError {
        let problem = match error {
            TimeError::OutOfRange(_) => format!("column {}: {text} does not fit a time stamp", column + 1),
            _ => format!("column {}: `{text}` is no time stamp", column + 1),
        };
        self.error(problem)
    }
}

/// What a number too large for seconds is the epoch time in.
fn looks_like(text: &str) -> &'static str {
    let digits = text.trim_start_matches(['+', '-']).split(['.', 'e', 'E']).next().unwrap_or_default().len();
    match digits {
        0..=10 => "the number is out of range",
        11..=14 => "the stamps look like milliseconds",
        15..=17 => "the stamps look like microseconds",
        _ => "the stamps look like nanoseconds",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn all(text: &str) -> Vec<(u64, Vec<String>)> {
        let mut rows = Rows::new(text.as_bytes());
        let mut found = Vec::new();
        while let Some(row) = rows.next_row().unwrap() {
            found.push((row.line(), (0..row.len()).map(|i| row.field(i).unwrap().to_string()).collect()));
        }
        found
    }

    #[test]
    fn every_usual_separator_is_understood() {
        let expected =
            |line, fields: &[&str]| (line, fields.iter().map(ToString::to_string).collect::<Vec<_>>());
        assert_eq!(
            all("\u{feff}# head\r\n\r\n1 2\t 3\r\n  # more\n4, 5 ,6,\n7;8\n9"),
            [
                expected(3, &["1", "2", "3"]),
                expected(5, &["4", "5", "6"]),
                expected(6, &["7", "8"]),
                expected(7, &["9"]),
            ]
        );
        assert_eq!(all("1,,2"), [expected(1, &["1", "", "2"])]);
        assert!(all("").is_empty() && all("#\n\n \n").is_empty());
    }

    #[test]
    fn numbers_are_taken_strictly() {
        let mut rows = Rows::new("1.5 nan inf x 1e400 1_000 -2e-3\n1,,3".as_bytes());
        let row = rows.next_row().unwrap().unwrap();
        assert_eq!((row.number(0).unwrap(), row.number(6).unwrap()), (1.5, -0.002));
        let says = |column, text: &str| {
            let error = row.number(column).unwrap_err().to_string();
            assert!(error.starts_with("line 1: ") && error.contains(text), "{error}");
        };
        says(1, "column 2: nan is not finite");
        says(2, "inf is not finite");
        says(3, "`x` is no number");
        says(4, "1e400 is not finite");
        says(5, "`1_000` is no number");
        says(7, "expected 8 columns, found 7");
        assert!(row.numbers::<2>(0).is_err());
        let row = rows.next_row().unwrap().unwrap();
        assert!(row.number(1).unwrap_err().to_string().contains("column 2 is empty"));
        let cut = row.expect_columns(4).unwrap_err().to_string();
        assert_eq!(cut, "line 2: expected 4 columns, found 3: the last row is cut off");
    }

    #[test]
    fn stamps_are_exact_and_units_are_suspected() {
        let mut rows =
            Rows::new("1403715278.76214 1403715273262142976 1403715273262142 1403715273262 x".as_bytes());
        let row = rows.next_row().unwrap().unwrap();
        assert_eq!(row.seconds(0).unwrap().as_nanos(), 1_403_715_278_762_140_000);
        assert_eq!(row.nanos(1).unwrap().as_nanos(), 1_403_715_273_262_142_976);
        assert_eq!(row.micros(2).unwrap().as_nanos(), 1_403_715_273_262_142_000);
        let hint = |column| row.seconds(column).unwrap_err().to_string();
        assert!(hint(1).contains("nanoseconds") && hint(2).contains("microseconds"));
        let seconds = row.nanos(0).unwrap_err().to_string();
        assert!(seconds.contains("no whole number of nanoseconds"), "{seconds}");
        assert!(hint(3).contains("milliseconds") && hint(4).contains("`x` is no time stamp"));
    }

    #[test]
    fn a_line_without_end_takes_no_memory() {
        let mut rows = Rows::new(BufReader::new(std::io::repeat(b'1')));
        assert!(rows.next_row().unwrap_err().to_string().contains("64 KiB"));
        let mut rows = Rows::new(&b"1 2\n\xff\xfe\n"[..]);
        assert!(rows.next_row().is_ok());
        assert!(rows.next_row().unwrap_err().to_string().contains("line 2: the line is not UTF-8"));
    }

    proptest! {
        #[test]
        fn any_bytes_are_rows_or_an_error(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let mut rows = Rows::new(&bytes[..]);
            while let Ok(Some(row)) = rows.next_row() {
                for i in 0..row.len() {
                    let (_, _) = (row.number(i), row.seconds(i));
                }
            }
        }
    }
}
