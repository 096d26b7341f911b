//! What readers repair or leave out: one rule for all of them, and all of it is counted and said.
//!
//! | found | what is done |
//! | --- | --- |
//! | a row whose values are NaN, or all missing | left out: it is a gap |
//! | the stamp of the row before once more | the first is kept, unless every other row is such |
//! | a quaternion up to 1 % off unit length | scaled to 1; beyond that the row is refused |
//! | a byte-order mark where a line starts | passed over |
//! | a heading, with `#` or without | names the columns |
//!
//! Infinite numbers, stamps that run backwards and rows of another width are errors.

use std::borrow::Cow;

use vice_core::error::{DataError, DataResult};
use vice_core::frames::UNIT_TOLERANCE;
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::Stamp;

/// How far from unit length a quaternion may be and still be scaled to it.
pub const SCALED_WITHIN: f64 = 0.01;

/// Something that was met, how often, and where first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Met {
    count: u64,
    first_line: u64,
}

impl Met {
    fn at(&mut self, line: u64) {
        if self.count == 0 {
            self.first_line = line;
        }
        self.count += 1;
    }
}

/// Counts what a reader of one file was lenient about.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Leniency {
    rows: u64,
    gaps: Met,
    duplicates: Met,
    first_duplicate: Stamp,
    scaled: Met,
    worst_length: f64,
    widths: Met,
}

/// What becomes of a row by its stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Later than the one before: it is kept.
    Later,
    /// The same stamp again: it is left out.
    Again,
}

impl Leniency {
    /// Nothing was met so far.
    pub fn new() -> Self {
        Self::default()
    }

    /// A row was read, whatever becomes of it.
    pub fn row(&mut self) {
        self.rows(1);
    }

    /// So many rows were read.
    pub fn rows(&mut self, count: u64) {
        self.rows += count;
    }

    /// A row that holds no value, at a line: it is left out.
    pub fn gap(&mut self, line: u64) {
        self.gaps.at(line);
    }

    /// A row with more columns than the first, at a line.
    pub fn other_width(&mut self, line: u64) {
        self.widths.at(line);
    }

    /// How a row follows on the one before in time; the same stamp once more is counted.
    ///
    /// # Errors
    /// [`DataError`] for a stamp that is earlier.
    pub fn order(&mut self, previous: Option<Stamp>, stamp: Stamp, line: u64) -> DataResult<Order> {
        match previous {
            Some(previous) if stamp == previous => {
                if self.duplicates.count == 0 {
                    self.first_duplicate = stamp;
                }
                self.duplicates.at(line);
                Ok(Order::Again)
            }
            Some(previous) if stamp < previous => {
                Err(DataError::new(format!("stamp {stamp} ns is earlier than the one before, {previous} ns"))
                    .line(line))
            }
            _ => Ok(Order::Later),
        }
    }

    /// A quaternion, w first, as it is used: scaled to unit length where it is off by more than rounding and at most
    /// 1 %. Beyond that it stays as it is, for the core to refuse.
    pub fn quaternion(&mut self, wxyz: [f64; 4], line: u64) -> [f64; 4] {
        let length = wxyz.iter().map(|v| v * v).sum::<f64>().sqrt();
        let off = (length - 1.0).abs();
        if !(off > UNIT_TOLERANCE && off <= SCALED_WITHIN) {
            return wxyz;
        }
        self.scaled.at(line);
        if off > (self.worst_length - 1.0).abs() || self.scaled.count == 1 {
            self.worst_length = length;
        }
        wxyz.map(|v| v / length)
    }

    /// Checks at the end that what was left out is the exception.
    ///
    /// # Errors
    /// [`DataError`] where all rows are gaps, or half of them repeat the stamp before.
    pub fn check(&self, kept: usize, what: &str) -> DataResult<()> {
        if kept == 0 && self.gaps.count > 0 {
            return Err(DataError::new(format!("none of the {} rows has a {what}: all are NaN", self.rows))
                .line(self.gaps.first_line));
        }
        if 2 * self.duplicates.count >= self.rows.max(1) {
            return Err(DataError::new(format!(
                "stamp {} ns appears twice: {} of {} rows have the stamp of the row before",
                self.first_duplicate, self.duplicates.count, self.rows
            ))
            .line(self.duplicates.first_line)
            .hint("were the stamps rounded, as a spreadsheet does? Write them with all their digits"));
        }
        Ok(())
    }

    /// Whether nothing was left out or repaired.
    pub fn is_clean(&self) -> bool {
        let Self { gaps, duplicates, scaled, widths, .. } = self;
        [gaps, duplicates, scaled, widths].iter().all(|met| met.count == 0)
    }

    /// What was met, about a file or stream.
    pub fn suspicions(&self, about: &str) -> Suspicions {
        let mut list = Suspicions::new();
        let mut add = |met: &Met, code: &str, message: &str, evidence: String, advice: &str| {
            if met.count > 0 {
                let suspicion = Suspicion::new(code, about, message).evidence(evidence).times(met.count);
                list.add(suspicion.advice(advice));
            }
        };
        let first = |met: &Met| format!("the first on line {}", met.first_line);
        let rows = |met: &Met| format!("{} of {} rows, {}", met.count, self.rows, first(met));
        add(&self.gaps, "rows-left-out", "rows without a value (NaN) are left out", rows(&self.gaps), "");
        add(
            &self.duplicates,
            "duplicate-stamps",
            "rows with the stamp of the row before are left out",
            rows(&self.duplicates),
            "",
        );
        add(
            &self.scaled,
            "quaternions-scaled",
            "quaternions are not of unit length and were scaled to it",
            format!("{}, the length furthest off is {:.6}", rows(&self.scaled), self.worst_length),
            "write more digits",
        );
        add(
            &self.widths,
            "rows-of-another-width",
            "rows have more columns than the first; these are passed over",
            rows(&self.widths),
            "name the columns in a first line",
        );
        list
    }
}

/// Text without byte-order marks where a line starts: files that were put together have one where each part begins.
pub fn without_marks(text: &str) -> Cow<'_, str> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.contains("\n\u{feff}") {
        Cow::Owned(text.replace("\n\u{feff}", "\n"))
    } else {
        Cow::Borrowed(text)
    }
}

/// Logs suspicions, for callers that have no document to put them into.
pub fn log(suspicions: &Suspicions) {
    for suspicion in suspicions.iter() {
        tracing::warn!("{}", suspicion.line());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_met_is_counted_and_said_once() {
        let mut lenient = Leniency::new();
        (0..10).for_each(|_| lenient.row());
        assert!(lenient.is_clean() && lenient.suspicions("a").is_empty());
        lenient.gap(4);
        lenient.gap(5);
        let t = Stamp::from_nanos;
        assert_eq!(lenient.order(None, t(1), 1).unwrap(), Order::Later);
        assert_eq!(lenient.order(Some(t(1)), t(1), 7).unwrap(), Order::Again);
        assert!(
            lenient
                .order(Some(t(2)), t(1), 8)
                .unwrap_err()
                .to_string()
                .contains("line 8: stamp 1 ns is earlier")
        );
        let q = lenient.quaternion([1.0011, 0.0, 0.0, 0.0], 9);
        assert_eq!(q, [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(lenient.quaternion([1.0009, 0.0, 0.0, 0.0], 9)[0], 1.0009, "rounding is the core's");
        assert_eq!(lenient.quaternion([1.02, 0.0, 0.0, 0.0], 9)[0], 1.02, "for the core to refuse");
        lenient.check(8, "pose").unwrap();
        let lines: Vec<String> = lenient.suspicions("a.tum").iter().map(Suspicion::line).collect();
        assert_eq!(
            lines,
            [
                "a.tum: rows without a value (NaN) are left out: 2 of 10 rows, the first on line 4, 2 times",
                "a.tum: rows with the stamp of the row before are left out: 1 of 10 rows, the first on line 7",
                "a.tum: quaternions are not of unit length and were scaled to it: 1 of 10 rows, the first on line 9, \
                 the length furthest off is 1.001100 (write more digits)",
            ]
        );
    }

    #[test]
    fn the_exception_must_not_be_the_rule() {
        let mut lenient = Leniency::new();
        for line in 1..=3 {
            lenient.row();
            lenient.gap(line);
        }
        assert!(lenient.check(0, "pose").unwrap_err().to_string().contains("none of the 3 rows has a pose"));
        let mut lenient = Leniency::new();
        for line in 1..=3 {
            lenient.row();
            lenient.order((line > 1).then(Stamp::default), Stamp::default(), line).unwrap();
        }
        let error = lenient.check(1, "pose").unwrap_err().to_string();
        assert!(
            error.contains("2 of 3 rows have the stamp of the row before") && error.contains("spreadsheet")
        );
    }

    #[test]
    fn marks_are_passed_over_wherever_a_line_starts() {
        assert_eq!(without_marks("\u{feff}a\n\u{feff}b\nc"), "a\nb\nc");
        assert_eq!(without_marks("a\u{feff}b"), "a\u{feff}b", "elsewhere it is a character");
        assert_eq!(without_marks("a\nb"), "a\nb");
    }
}
