//! One row of a table: its fields as text, numbers and stamps.

use vice_core::error::{DataError, DataResult};
use vice_core::time::{Stamp, TimeError};

/// One row. It borrows the reader's buffer.
#[derive(Clone, Copy, Debug)]
pub struct Row<'a> {
    pub(crate) text: &'a str,
    pub(crate) fields: &'a [(u32, u32)],
    pub(crate) separator: Separator,
    pub(crate) line: u64,
    pub(crate) ends: bool,
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

/// Finds the fields of a trimmed, non-empty line as byte ranges.
pub(crate) fn split(text: &str, fields: &mut Vec<(u32, u32)>) -> Separator {
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

    /// Checks that there are at least `expected` columns, an empty last one included, which ends with its separator.
    ///
    /// # Errors
    /// As [`Row::expect_columns`].
    pub fn expect_width(&self, expected: usize) -> DataResult<()> {
        let empty_last = self.len() + 1 == expected && self.text.ends_with([',', ';']);
        if empty_last { Ok(()) } else { self.expect_columns(expected) }
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

    /// Whether a field is NaN, in whatever spelling.
    pub fn is_nan(&self, column: usize) -> bool {
        self.field(column).is_some_and(|text| {
            text.trim_start_matches(['-', '+']).get(..3).is_some_and(|word| word.eq_ignore_ascii_case("nan"))
        })
    }

    /// Whether a field is empty or one of the words that tables have for no value.
    pub fn is_missing(&self, column: usize) -> bool {
        self.is_nan(column)
            || self.field(column).is_none_or(|text| {
                ["", "-", "null", "none", "na", "n/a"].iter().any(|word| text.eq_ignore_ascii_case(word))
            })
    }

    /// A stamp in milliseconds.
    ///
    /// # Errors
    /// [`DataError`] with the line if the field is no time.
    pub fn millis(&self, column: usize) -> DataResult<Stamp> {
        let text = self.required(column)?;
        Stamp::parse_millis(text).map_err(|e| self.no_time(column, text, e))
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
