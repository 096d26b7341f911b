//! A journal's bytes to its lines, and what is wrong with them.
//!
//! Each line by itself says whether it is whole; its number and the check sum of the line before say whether it stands
//! where it belongs. Whatever is whole is read, also behind damage, and what is missing is named.

use std::fmt;
use std::ops::Range;

use vice_core::error::{DataError, DataResult};

use super::line::{JOURNAL_SCHEMA, Line, OLD_SCHEMA, Place, is_unfinished, whole_line};
use crate::store::utc::utc;

/// One line with where it stands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    /// Its number in the journal.
    pub(crate) seq: u64,
    /// When it was written, in milliseconds since 1970; 0 in a journal of the old schema.
    pub(crate) time_ms: u64,
    /// Lines before it could not be read.
    pub(crate) gap_before: bool,
    /// What it says.
    pub(crate) line: Line,
}

/// Lines that cannot be read, or stand in the wrong place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Damage {
    /// Numbers of lines that are missing between two that are there; the bytes that stand there instead.
    Missing { lines: Range<u64>, times_ms: (u64, u64) },
    /// Bytes at the end that are no line, behind the line of a number; how many lines they were, at least.
    End { after: u64, time_ms: u64, bytes: u64, lines: u64 },
    /// A line that stands twice or in the wrong place, and was put right.
    Moved { line: u64 },
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing { lines, times_ms: (from, to) } => {
                let (first, last) = (lines.start, lines.end.saturating_sub(1));
                match last.saturating_sub(first) {
                    0 => write!(f, "entry {first} cannot be read")?,
                    _ => write!(f, "entries {first} to {last} cannot be read")?,
                }
                match (*from, *to) {
                    (0, _) | (_, 0) => Ok(()),
                    (from, to) => write!(f, " (made between {} and {})", utc(from), utc(to)),
                }
            }
            Self::End { after, time_ms, bytes, lines } => {
                write!(f, "{bytes} bytes behind entry {after} cannot be read, ")?;
                match lines {
                    1 => f.write_str("one entry")?,
                    n => write!(f, "{n} entries or more")?,
                }
                match time_ms {
                    0 => Ok(()),
                    _ => write!(f, " made after {}", utc(*time_ms)),
                }
            }
            Self::Moved { line } => write!(f, "entry {line} stands twice or in the wrong place"),
        }
    }
}

/// What a journal holds.
#[derive(Debug, Default)]
pub(crate) struct Reading {
    /// The lines from the last head on, in the order in which they were written.
    pub(crate) entries: Vec<Entry>,
    /// What is wrong with it.
    pub(crate) damage: Vec<Damage>,
    /// Bytes of whole lines before anything that is none.
    pub(super) len: u64,
    /// Bytes of a line at the end that was not finished.
    pub(super) unfinished: u64,
    /// Where the next line stands.
    pub(super) next: Place,
    /// Its lines are of the old schema.
    pub(super) old: bool,
}

impl Reading {
    /// Whether lines between others are missing.
    pub(crate) fn has_gap(&self) -> bool {
        self.entries.iter().any(|e| e.gap_before)
    }
}

struct Found {
    place: Place,
    crc: u32,
    gap_before: bool,
    line: Line,
}

/// The lines of a journal from its last head on.
///
/// # Errors
/// [`DataError`] if it is no journal, or of a newer schema.
pub(super) fn read(bytes: &[u8]) -> DataResult<Reading> {
    let mut reading = Reading::default();
    let (mut found, mut at, mut gap, mut clean) = (Vec::new(), 0, false, true);
    while at < bytes.len() {
        match whole_line(&bytes[at..]) {
            Some(whole) => {
                let number = found.len() as u64;
                reading.old |= whole.place.is_none();
                let place = whole.place.unwrap_or(Place { seq: number, ..Place::default() });
                let line = understood(whole.json, number)?;
                found.push(Found { place, crc: whole.crc, gap_before: std::mem::take(&mut gap), line });
                at += whole.len;
                if clean {
                    reading.len = at as u64;
                }
            }
            None => {
                let Some(next) = next_whole(bytes, at) else { break };
                (gap, clean) = (true, false);
                at = next;
            }
        }
    }
    let rest = &bytes[at..];
    if found.is_empty() {
        return match rest {
            [] => Ok(reading),
            _ if is_unfinished(rest) => Ok(Reading { unfinished: rest.len() as u64, ..reading }),
            _ => Err(DataError::new("is no journal of vice").hint("move it away")),
        };
    }
    if reading.old && !matches!(found[0].line, Line::Head { .. }) && !found[0].gap_before {
        return Err(DataError::new("is no journal of vice").line(1).hint("move it away"));
    }
    in_order(&mut found, &mut reading);
    let last = &found[found.len() - 1];
    let behind = (last.place.seq, last.place.time_ms);
    reading.next = Place { seq: last.place.seq + 1, time_ms: 0, before: last.crc };
    keep_from_last_head(found, &mut reading);
    if is_unfinished(rest) {
        reading.unfinished = rest.len() as u64;
    } else if !rest.is_empty() {
        let breaks = rest.iter().filter(|b| **b == b'\n').count() as u64;
        reading.damage.push(Damage::End {
            after: behind.0,
            time_ms: behind.1,
            bytes: rest.len() as u64,
            lines: breaks.max(1),
        });
    }
    Ok(reading)
}

/// Where the next whole line starts.
fn next_whole(bytes: &[u8], at: usize) -> Option<usize> {
    let mut starts = bytes[at..].iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(i, _)| at + i + 1);
    starts.find(|start| whole_line(&bytes[*start..]).is_some())
}

fn understood(json: &[u8], number: u64) -> DataResult<Line> {
    let newer = |schema: &str| {
        DataError::new(format!("the journal's schema {schema} is not {JOURNAL_SCHEMA}")).hint("update vice")
    };
    let line = serde_json::from_slice(json).map_err(|e| match schema_of(json) {
        Some(schema) if schema != JOURNAL_SCHEMA && schema != OLD_SCHEMA => newer(&schema),
        _ => DataError::new("the journal holds a line that is not understood")
            .line(number + 1)
            .hint("was it written by a newer vice?")
            .because(e),
    })?;
    match &line {
        Line::Head { schema, .. } if schema != JOURNAL_SCHEMA && schema != OLD_SCHEMA => Err(newer(schema)),
        _ => Ok(line),
    }
}

fn schema_of(json: &[u8]) -> Option<String> {
    let value: serde_json::Value = serde_json::from_slice(json).ok()?;
    Some(value.get("schema")?.as_str()?.to_string())
}

/// Puts lines where their numbers say they belong, and marks where some are missing or do not follow.
fn in_order(found: &mut Vec<Found>, reading: &mut Reading) {
    if reading.old {
        // Without numbers only the bytes between tell that something is missing, and not how much.
        let gaps = found.iter().filter(|f| f.gap_before).map(|f| f.place.seq);
        reading.damage.extend(gaps.map(|at| Damage::Missing { lines: at..at + 1, times_ms: (0, 0) }));
        return;
    }
    for i in 1..found.len() {
        if found[i].place.seq <= found[i - 1].place.seq {
            reading.damage.push(Damage::Moved { line: found[i].place.seq });
        }
    }
    found.sort_by_key(|f| f.place.seq);
    found.dedup_by(|later, earlier| later.place.seq == earlier.place.seq);
    let mut before = (Place::default(), 0);
    let mut expected = 0;
    for f in found.iter_mut() {
        let missing = f.place.seq > expected;
        f.gap_before = missing || f.place.before != before.1;
        if f.gap_before {
            // One that does not follow took the place of another.
            let lines = if missing { expected..f.place.seq } else { f.place.seq..f.place.seq + 1 };
            let times_ms = (before.0.time_ms, f.place.time_ms);
            reading.damage.push(Damage::Missing { lines, times_ms });
        }
        before = (f.place, f.crc);
        expected = f.place.seq + 1;
    }
}

/// A head makes everything before it unneeded, damaged or not.
fn keep_from_last_head(found: Vec<Found>, reading: &mut Reading) {
    let head = found.iter().rposition(|f| matches!(f.line, Line::Head { .. }));
    let from = head.map_or(0, |head| found[head].place.seq);
    reading.damage.retain(|d| match d {
        Damage::Missing { lines, .. } => lines.end > from + u64::from(head.is_some()),
        Damage::Moved { line } => *line >= from,
        Damage::End { .. } => true,
    });
    let entries = found.into_iter().skip(head.unwrap_or(0)).enumerate().map(|(i, f)| Entry {
        seq: f.place.seq,
        time_ms: f.place.time_ms,
        gap_before: f.gap_before && !(i == 0 && head.is_some()),
        line: f.line,
    });
    reading.entries = entries.collect();
}
