//! A row of names above a table, and which column holds what by it.

use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::time::{Span, Stamp};

use crate::columns::{Axis, ColumnName, Quantity, TimeUnit};
use crate::row::{Row, Separator};

/// The names of the columns of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heading {
    names: Vec<ColumnName>,
    line: u64,
    commented: bool,
}

/// Where the stamps of a table are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeColumn {
    column: usize,
    /// A second column with the nanoseconds after whole seconds.
    nanos: Option<usize>,
    /// `None` until the first row shows it.
    unit: Option<TimeUnit>,
    /// What whole numbers too small to show a unit are in.
    small: TimeUnit,
}

impl TimeColumn {
    /// Stamps in one column of a known unit, or one that the first row shows.
    pub const fn new(column: usize, unit: Option<TimeUnit>) -> Self {
        Self { column, nanos: None, unit, small: TimeUnit::Seconds }
    }

    /// The same, where whole numbers that are too small to be of today's epoch are in the unit of the format: stamps of
    /// a simulation may count nanoseconds from zero.
    #[must_use]
    pub const fn small_in(self, unit: TimeUnit) -> Self {
        Self { small: unit, ..self }
    }

    /// The columns that are read.
    pub fn columns(&self) -> impl Iterator<Item = usize> {
        [Some(self.column), self.nanos].into_iter().flatten()
    }

    /// The unit, as far as it is known.
    pub const fn unit(&self) -> Option<TimeUnit> {
        self.unit
    }

    /// The stamp of a row. The first one settles the unit where the heading does not.
    ///
    /// # Errors
    /// [`DataError`] with the line if the field is no time in that unit.
    pub fn stamp(&mut self, row: &Row<'_>) -> DataResult<Stamp> {
        if let Some(nanos) = self.nanos {
            let (secs, nanos) = (row.seconds(self.column)?, row.nanos(nanos)?.as_nanos());
            if !(0..1_000_000_000).contains(&nanos) {
                return Err(row.error(format!("{nanos} ns are no part of a second")).hint(
                    "a column of seconds and one of the nanoseconds after them are expected by their names",
                ));
            }
            return Ok(secs + Span::from_nanos(nanos));
        }
        let unit = match self.unit {
            Some(unit) => unit,
            None => {
                let whole =
                    row.field(self.column).is_some_and(|text| text.bytes().all(|b| b.is_ascii_digit()));
                let unit = match row.number(self.column).map_or(TimeUnit::Seconds, TimeUnit::of_magnitude) {
                    TimeUnit::Seconds if whole => self.small,
                    shown => shown,
                };
                *self.unit.insert(unit)
            }
        };
        match unit {
            TimeUnit::Seconds => row.seconds(self.column),
            TimeUnit::Millis => row.millis(self.column),
            TimeUnit::Micros => row.micros(self.column),
            TimeUnit::Nanos => row.nanos(self.column),
        }
    }
}

impl Heading {
    /// A row as a heading: no field is a number, and at least one has a letter.
    pub(crate) fn of_row(row: &Row<'_>) -> Option<Self> {
        let fields = || (0..row.len()).filter_map(|i| row.field(i)).map(|f| f.trim_matches(['"', '\'']));
        let is_name = fields().all(|f| f.parse::<f64>().is_err());
        let has_letters = fields().any(|f| f.contains(char::is_alphabetic));
        (is_name && has_letters).then(|| Self::of_text(row.text(), row.separator(), row.line(), false))
    }

    /// A comment as a heading, where a name in it is known.
    pub(crate) fn of_comment(text: &str, line: u64) -> Option<Self> {
        let text =
            text.trim_start_matches(|c: char| c == '#' || c == '%' || c == '\u{feff}' || c.is_whitespace());
        let separator = match text {
            _ if text.contains(',') => Separator::Comma,
            _ if text.contains(';') => Separator::Semicolon,
            _ => Separator::Space,
        };
        let heading = Self::of_text(text, separator, line, true);
        let known = heading.names.iter().filter(|n| n.meaning.is_some()).count();
        (known >= 2).then_some(heading)
    }

    fn of_text(text: &str, separator: Separator, line: u64, commented: bool) -> Self {
        let names: Vec<ColumnName> = match separator {
            Separator::Comma => text.trim_end_matches(',').split(',').map(ColumnName::new).collect(),
            Separator::Semicolon => text.trim_end_matches(';').split(';').map(ColumnName::new).collect(),
            Separator::Space => {
                // A unit in brackets belongs to the name before it, blanks and all.
                let mut names: Vec<String> = Vec::new();
                let mut open = false;
                for word in text.split_whitespace() {
                    let starts = word.starts_with(['[', '(']);
                    match names.last_mut() {
                        Some(name) if open || starts => {
                            name.push(' ');
                            name.push_str(word);
                        }
                        _ => names.push(word.to_string()),
                    }
                    if word.contains(['[', '(']) {
                        open = true;
                    }
                    if word.contains([']', ')']) {
                        open = false;
                    }
                }
                names.iter().map(|name| ColumnName::new(name)).collect()
            }
        };
        Self { names, line, commented }
    }

    /// The names.
    pub fn names(&self) -> &[ColumnName] {
        &self.names
    }

    /// Line of the heading.
    pub const fn line(&self) -> u64 {
        self.line
    }

    /// Whether it stands in a comment.
    pub const fn is_commented(&self) -> bool {
        self.commented
    }

    /// Whether a name of this quantity is there.
    pub fn has(&self, quantity: Quantity) -> bool {
        self.names.iter().any(|n| n.meaning.is_some_and(|(q, _)| q == quantity))
    }

    /// An error at the heading.
    pub fn error(&self, problem: impl Into<String>) -> DataError {
        DataError::of_kind(ErrorKind::Contradictory, problem).line(self.line)
    }

    /// The names as the file has them, for messages.
    pub fn shown(&self) -> String {
        let names: Vec<&str> = self.names.iter().map(|n| n.text.as_str()).collect();
        names.join(" ")
    }

    /// The column of a part of a quantity.
    ///
    /// # Errors
    /// [`DataError`] if two columns have that name.
    pub fn column(&self, quantity: Quantity, axis: Option<Axis>) -> DataResult<Option<usize>> {
        let is_it = |n: &ColumnName| n.meaning == Some((quantity, axis));
        let mut found = (0..self.names.len()).filter(|i| is_it(&self.names[*i]));
        match (found.next(), found.next()) {
            (first, None) => Ok(first),
            (Some(a), Some(b)) => Err(self.twice(a, b)),
            (None, Some(_)) => Ok(None),
        }
    }

    fn twice(&self, a: usize, b: usize) -> DataError {
        let name = |i: usize| &self.names[i].text;
        self.error(format!(
            "columns {} and {} are named `{}` and `{}`: which of them is meant?",
            a + 1,
            b + 1,
            name(a),
            name(b)
        ))
        .hint("name the column that is meant, and no other, so")
    }

    /// The columns of x, y and z; `None` where not all are named.
    ///
    /// # Errors
    /// [`DataError`] if two columns have the same name.
    pub fn vector(&self, quantity: Quantity) -> DataResult<Option<[usize; 3]>> {
        let column = |axis| self.column(quantity, Some(axis));
        Ok(match (column(Axis::X)?, column(Axis::Y)?, column(Axis::Z)?) {
            (Some(x), Some(y), Some(z)) => Some([x, y, z]),
            _ => None,
        })
    }

    /// The columns of a quaternion, w first; `None` where not all are named.
    ///
    /// # Errors
    /// [`DataError`] if two columns have the same name.
    pub fn quaternion(&self) -> DataResult<Option<[usize; 4]>> {
        let w = self.column(Quantity::Rotation, Some(Axis::W))?;
        Ok(match (w, self.vector(Quantity::Rotation)?) {
            (Some(w), Some([x, y, z])) => Some([w, x, y, z]),
            _ => None,
        })
    }

    /// The column of the stamps. Of several the one of a message's header is taken, or seconds and nanoseconds
    /// together.
    ///
    /// # Errors
    /// [`DataError`] if several columns are named as times.
    pub fn time(&self) -> DataResult<Option<TimeColumn>> {
        let mut times = self.times();
        if times.len() > 1 && times.iter().any(|i| self.names[*i].has_word("header")) {
            times.retain(|i| self.names[*i].has_word("header"));
        }
        let one = |i: usize| TimeColumn::new(i, self.names[i].time_unit());
        match times[..] {
            [] => Ok(None),
            [only] => Ok(Some(one(only))),
            [a, b] => match (self.names[a].time_unit(), self.names[b].time_unit()) {
                (Some(TimeUnit::Seconds), Some(TimeUnit::Nanos)) => {
                    Ok(Some(TimeColumn { nanos: Some(b), ..one(a) }))
                }
                (Some(TimeUnit::Nanos), Some(TimeUnit::Seconds)) => {
                    Ok(Some(TimeColumn { nanos: Some(a), ..one(b) }))
                }
                _ => Err(self.twice(a, b)),
            },
            [a, b, ..] => Err(self.twice(a, b)),
        }
    }

    /// All columns that are named as times.
    pub fn times(&self) -> Vec<usize> {
        let is_time = |i: &usize| self.names[*i].meaning.is_some_and(|(q, _)| q == Quantity::Time);
        (0..self.names.len()).filter(is_time).collect()
    }

    /// Checks that rows have as many columns as there are names. Rows that lack the last ones, none of which is
    /// `needed`, are fine where the stamps come first: some tools name what they write only now and then.
    ///
    /// # Errors
    /// [`DataError`] with both counts.
    pub fn check_width(&self, columns: usize, needed: impl IntoIterator<Item = usize>) -> DataResult<()> {
        let names = self.names.len();
        let starts = self.names.first().is_some_and(|n| n.meaning.is_some_and(|(q, _)| q == Quantity::Time));
        if columns == names || (columns < names && starts && needed.into_iter().all(|c| c < columns)) {
            return Ok(());
        }
        Err(self
            .error(format!("the heading names {names} columns, the first row has {columns}"))
            .hint(format!("the names are {}", self.shown())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::Rows;

    fn heading(text: &str) -> Heading {
        Rows::new(text.as_bytes()).begin().unwrap().heading.unwrap()
    }

    fn comment(text: &str) -> Heading {
        Rows::new(format!("{text}\n1 2 3\n").as_bytes()).begin().unwrap().comments.remove(0)
    }

    #[test]
    fn columns_are_found_whatever_stands_between_them() {
        for heading in [
            heading("num, t, x, y, z, qx, qy, qz, qw\n"),
            heading(";t;x;y;z;qx;qy;qz;qw;\n"),
            comment("# num t(s) x[m] y[m] z[m] q_x q_y q_z q_w"),
            comment("%num,time,tx [m],ty [m],tz [m],qx [],qy [],qz [],qw []"),
            comment(
                "#num timestamp [ns] p_RS_R_x [m] p_RS_R_y [m] p_RS_R_z [m] q_RS_x [] q_RS_y [] q_RS_z [] q_RS_w []",
            ),
        ] {
            assert_eq!(heading.vector(Quantity::Position).unwrap(), Some([2, 3, 4]), "{heading:?}");
            assert_eq!(heading.quaternion().unwrap(), Some([8, 5, 6, 7]), "{heading:?}");
            assert_eq!(heading.time().unwrap().unwrap().columns().next(), Some(1));
            assert!(heading.check_width(9, [8]).is_ok() && heading.check_width(8, [7]).is_err());
        }
    }

    #[test]
    fn names_that_contradict_are_refused_with_both() {
        let error = heading("time,x,y,z,pos_x\n").vector(Quantity::Position).unwrap_err().to_string();
        assert!(error.contains("columns 2 and 5 are named `x` and `pos_x`"), "{error}");
        let error = heading("time_s,stamp,x\n").time().unwrap_err().to_string();
        assert!(error.contains("`time_s` and `stamp`"), "{error}");
        let error = heading("t x y z\n").check_width(5, [3]).unwrap_err().to_string();
        assert!(error.contains("names 4 columns, the first row has 5"), "{error}");
        assert!(comment("# t x y z Pr11 Pr12").check_width(4, [3]).is_ok(), "what is named now and then");
    }

    #[test]
    fn times_are_read_in_the_unit_that_is_named_or_shows() {
        let stamp = |head: &str, row: &str| {
            let text = format!("{head}\n{row}\n");
            let mut rows = Rows::new(text.as_bytes());
            let beginning = rows.begin().unwrap();
            let heading = beginning.heading.or(beginning.comments.into_iter().next()).unwrap();
            let mut time = heading.time().unwrap().unwrap();
            let row = rows.next_row().unwrap().unwrap();
            time.stamp(&row).map(Stamp::as_nanos).map_err(|e| e.to_string())
        };
        assert_eq!(stamp("t x", "1.5 0").unwrap(), 1_500_000_000);
        assert_eq!(stamp("t_ms x", "1.5 0").unwrap(), 1_500_000);
        assert_eq!(stamp("time (us),x", "15,0").unwrap(), 15_000);
        assert_eq!(stamp("timestamp x", "1403715273262142976 0").unwrap(), 1_403_715_273_262_142_976);
        assert_eq!(stamp("timestamp x", "1403715273262 0").unwrap(), 1_403_715_273_262_000_000);
        assert_eq!(stamp("timestamp x", "1403715273262142.5 0").unwrap(), 1_403_715_273_262_142_500);
        assert_eq!(stamp("x,secs,nsecs", "0,12,34").unwrap(), 12_000_000_034);
        assert_eq!(
            stamp("%time,field.header.stamp,x", "1,1403715273262142976,0").unwrap(),
            1_403_715_273_262_142_976
        );
        // Nanoseconds from zero on, in a format of nanoseconds.
        let mut small = TimeColumn::new(0, None).small_in(TimeUnit::Nanos);
        let mut rows = Rows::new("0\n50000000\n".as_bytes());
        assert_eq!(small.stamp(&rows.next_row().unwrap().unwrap()).unwrap().as_nanos(), 0);
        assert_eq!(small.stamp(&rows.next_row().unwrap().unwrap()).unwrap().as_nanos(), 50_000_000);
        assert!(stamp("t [s],x", "1403715273262142976,0").unwrap_err().contains("look like nanoseconds"));
        assert!(stamp("t [ns],x", "1403715273.26,0").unwrap_err().contains("look like seconds"));
    }
}
