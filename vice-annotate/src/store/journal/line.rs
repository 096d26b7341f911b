//! One line of a journal, and its bytes.

use serde::{Deserialize, Serialize};
use vice_core::error::{DataError, DataResult};

use crate::store::document::Cell;
use crate::store::history::By;

/// Name and version of the journal's schema.
pub const JOURNAL_SCHEMA: &str = "vice.journal/2";
/// The one before, which is still read: its lines have no number, no time and no link to the line before.
pub(super) const OLD_SCHEMA: &str = "vice.journal/1";

/// A file's content, by length and check sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileMark {
    /// Bytes.
    pub len: u64,
    /// CRC-32 of them.
    pub crc32: u32,
}

impl FileMark {
    /// The mark of bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self { len: bytes.len() as u64, crc32: crc32fast::hash(bytes) }
    }
}

/// What a line says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "is", rename_all = "kebab-case")]
pub(crate) enum Line {
    /// The first line: where the journal starts from.
    Head {
        schema: String,
        dataset: Option<String>,
        camera: Option<String>,
        /// The labels file then; `None` where there was none.
        file: Option<FileMark>,
        /// All observations, as cells that add them.
        base: Vec<Cell>,
    },
    /// A step, or a part of a job's step.
    Change {
        by: By,
        label: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        job: Option<u64>,
        cells: Vec<Cell>,
    },
    /// The last step was taken back.
    Undo,
    /// It was made again.
    Redo,
    /// The labels file is about to be replaced by one with this content.
    Saving { file: FileMark },
    /// That was done.
    Saved,
}

impl Line {
    /// The line as today's schema has it.
    pub(super) fn with_schema(mut self) -> Self {
        if let Self::Head { schema, .. } = &mut self {
            *schema = JOURNAL_SCHEMA.to_string();
        }
        self
    }
}

/// Where a line stands among the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Its number, from 0.
    pub(super) seq: u64,
    /// When it was written, in milliseconds since 1970.
    pub(super) time_ms: u64,
    /// Check sum of the line before; 0 for the first.
    pub(super) before: u32,
}

/// A line of which each byte is there.
pub(super) struct Whole<'a> {
    /// `None` for a line of the old schema.
    pub(super) place: Option<Place>,
    pub(super) crc: u32,
    pub(super) json: &'a [u8],
    /// Bytes of the line with its break.
    pub(super) len: usize,
}

/// The bytes of a line, and its check sum.
pub(super) fn frame(line: &Line, place: Place) -> DataResult<(Vec<u8>, u32)> {
    let json =
        serde_json::to_vec(line).map_err(|e| DataError::new("cannot make the journal's JSON").because(e))?;
    let start = format!("{} {} {} {:08x} ", place.seq, place.time_ms, json.len(), place.before);
    let crc = sum(start.as_bytes(), &json);
    let mut bytes = start.into_bytes();
    bytes.extend(format!("{crc:08x} ").into_bytes());
    bytes.extend(json);
    bytes.push(b'\n');
    Ok((bytes, crc))
}

/// The check sum covers the number, the time and the link as well: none can be changed unseen.
fn sum(start: &[u8], json: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(start);
    hasher.update(json);
    hasher.finalize()
}

/// The line that bytes start with, if it is whole.
pub(super) fn whole_line(bytes: &[u8]) -> Option<Whole<'_>> {
    numbered(bytes).or_else(|| of_old_schema(bytes))
}

fn numbered(bytes: &[u8]) -> Option<Whole<'_>> {
    let (place, len, start) = start_of(bytes)?;
    let crc = hex(bytes.get(start..start + 8)?)?;
    let (json, end) = body(bytes, start + 8, len)?;
    (sum(&bytes[..start], json) == crc).then_some(Whole { place: Some(place), crc, json, len: end })
}

fn of_old_schema(bytes: &[u8]) -> Option<Whole<'_>> {
    let (len, at) = number(bytes, 0)?;
    let crc = hex(bytes.get(at..at + 8)?)?;
    let (json, end) = body(bytes, at + 8, usize::try_from(len).ok()?)?;
    (crc32fast::hash(json) == crc).then_some(Whole { place: None, crc, json, len: end })
}

/// Number, time, length of the JSON and link of a line, and where its check sum starts.
fn start_of(bytes: &[u8]) -> Option<(Place, usize, usize)> {
    let (seq, at) = number(bytes, 0)?;
    let (time_ms, at) = number(bytes, at)?;
    let (len, at) = number(bytes, at)?;
    let before = hex(bytes.get(at..at + 8)?)?;
    (bytes.get(at + 8) == Some(&b' ')).then_some(())?;
    Some((Place { seq, time_ms, before }, usize::try_from(len).ok()?, at + 9))
}

/// The JSON of a length after a space, and where the line ends.
fn body(bytes: &[u8], space: usize, len: usize) -> Option<(&[u8], usize)> {
    let start = space + 1;
    let end = start.checked_add(len)?;
    let json = bytes.get(start..end)?;
    (bytes.get(space) == Some(&b' ') && bytes.get(end) == Some(&b'\n')).then_some((json, end + 1))
}

/// A decimal number and where what follows its space starts.
fn number(bytes: &[u8], at: usize) -> Option<(u64, usize)> {
    // 20 digits are more than any number has: no need to look further for the space.
    let len = bytes.get(at..)?.iter().take(21).position(|b| *b == b' ')?;
    let digits = &bytes[at..at + len];
    if digits.is_empty() || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    Some((std::str::from_utf8(digits).ok()?.parse().ok()?, at + len + 1))
}

fn hex(digits: &[u8]) -> Option<u32> {
    u32::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()
}

/// Whether bytes are what is there of one line that was not finished: nothing in them contradicts that.
pub(super) fn is_unfinished(rest: &[u8]) -> bool {
    if rest.contains(&b'\n') || !rest.first().is_some_and(u8::is_ascii_digit) {
        return false;
    }
    // The head of a line is ASCII; behind it stands less than its length says.
    match start_of(rest) {
        Some((_, len, start)) => rest.len() < start.saturating_add(9).saturating_add(len).saturating_add(1),
        None => rest.len() < 80 && rest.iter().all(|b| b.is_ascii_hexdigit() || *b == b' '),
    }
}
