//! Rows of separated text, one at a time: the reader under trajectories and sensor lists.
//!
//! A line is split at commas where it has any, else at semicolons, else at white space. Blank lines and lines that
//! start with `#` or `%` are skipped; a byte-order mark wherever a line starts and CRLF are accepted. One buffer is
//! reused for all rows. [`Rows::begin`] finds the names of the columns, in a first row or in a comment above it.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use vice_core::error::{DataError, DataResult, ErrorKind};

use crate::heading::Heading;
use crate::not_text;
use crate::row::split;
pub use crate::row::{Row, Separator};

/// Bytes beyond which a line is not text in rows.
const MAX_LINE_BYTES: usize = 1 << 16;
/// Comments above the first row that may be its heading: the last of them.
const MAX_COMMENTS: usize = 16;
/// U+FEFF in UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Reads rows from text.
#[derive(Debug)]
pub struct Rows<R> {
    reader: R,
    buffer: Vec<u8>,
    fields: Vec<(u32, u32)>,
    line: u64,
    /// The row in the buffer is still to be given out.
    pending: bool,
    /// Comments so far, until a row was given out.
    comments: Vec<(u64, String)>,
    given: bool,
}

/// What stands above the first row of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Beginning {
    /// A first row of names, which some tools write without `#`.
    pub heading: Option<Heading>,
    /// Comments that may be such a row, the nearest to the rows first.
    pub comments: Vec<Heading>,
    /// Columns of the first row; 0 where there is none.
    pub columns: usize,
    /// Line of the first row; 0 where there is none.
    pub line: u64,
}

/// Opens a file of rows.
///
/// # Errors
/// [`DataError`] with the path if it cannot be opened.
pub fn open(path: impl AsRef<Path>) -> DataResult<Rows<BufReader<File>>> {
    let path = path.as_ref();
    let failed = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file").at(path),
        _ => DataError::new("cannot be read").at(path).because(e),
    };
    let file = File::open(path).map_err(failed)?;
    if file.metadata().map_err(failed)?.is_dir() {
        return Err(not_text::folder(path));
    }
    let mut reader = BufReader::with_capacity(1 << 18, file);
    match not_text::what(reader.fill_buf().map_err(failed)?) {
        Some(what) => Err(not_text::error(what).at(path)),
        None => Ok(Rows::new(reader)),
    }
}

impl<R: BufRead> Rows<R> {
    /// Reads from any source.
    pub fn new(reader: R) -> Self {
        Self {
            reader,
            buffer: Vec::new(),
            fields: Vec::new(),
            line: 0,
            pending: false,
            comments: Vec::new(),
            given: false,
        }
    }

    /// Looks for names of columns above the first row of numbers, and leaves that row to [`Rows::next_row`].
    ///
    /// To be called before anything else.
    ///
    /// # Errors
    /// As [`Rows::next_row`].
    pub fn begin(&mut self) -> DataResult<Beginning> {
        let mut beginning = Beginning { heading: None, comments: Vec::new(), columns: 0, line: 0 };
        while let Some(row) = self.next_row()? {
            match Heading::of_row(&row) {
                Some(found) if beginning.heading.is_none() => beginning.heading = Some(found),
                _ => {
                    (beginning.columns, beginning.line) = (row.len(), row.line());
                    self.pending = true;
                    break;
                }
            }
        }
        let read = |(line, text): &(u64, String)| Heading::of_comment(text, *line);
        beginning.comments = self.comments.iter().rev().filter_map(read).collect();
        Ok(beginning)
    }

    /// The next row, `None` at the end.
    ///
    /// # Errors
    /// [`DataError`] with the line if it is not UTF-8, far too long, or cannot be read. The path is the caller's to add.
    pub fn next_row(&mut self) -> DataResult<Option<Row<'_>>> {
        // In two steps, since a row borrows the buffer that the search for it fills.
        if !std::mem::take(&mut self.pending) && !self.advance()? {
            return Ok(None);
        }
        self.given = true;
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
            // Files that were put together have a mark where each part begins.
            if self.buffer.starts_with(BYTE_ORDER_MARK) {
                self.buffer.drain(..BYTE_ORDER_MARK.len());
            }
            match self.buffer.iter().find(|b| !b.is_ascii_whitespace()) {
                None => {}
                Some(b'#' | b'%') => self.keep_comment(),
                Some(_) => return Ok(true),
            }
        }
    }
}

impl<R> Rows<R> {
    /// Remembers a comment that may name the columns; only what comes before the first row can.
    fn keep_comment(&mut self) {
        if self.given {
            return;
        }
        if let Ok(text) = std::str::from_utf8(&self.buffer) {
            if self.comments.len() == MAX_COMMENTS {
                self.comments.remove(0);
            }
            self.comments.push((self.line, text.trim().to_string()));
        }
    }
}

fn text_of(buffer: &[u8], line: u64) -> DataResult<&str> {
    std::str::from_utf8(buffer)
        .map(|text| text.trim_matches(|c: char| c.is_ascii_whitespace()))
        .map_err(|_| DataError::of_kind(ErrorKind::Corrupt, "the line is not UTF-8 text").line(line))
}

#[cfg(test)]
mod tests;
