//! Lists of stamps, mostly with files: TUM's `rgb.txt`, EuRoC's `data.csv`, KITTI's `times.txt` and `timestamps.txt`, and
//! what people write by hand.

use std::path::{Path, PathBuf};

use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::time::{Span, Stamp};
use vice_files::columns::Quantity;
use vice_files::heading::{Heading, TimeColumn};
use vice_files::rows;

use crate::files::is_picture;

/// A row of a list.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) stamp: Stamp,
    /// The file, as the list names it.
    pub(crate) file: Option<String>,
    pub(crate) line: u64,
}

/// A list, in its own order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct List {
    pub(crate) path: PathBuf,
    pub(crate) rows: Vec<Row>,
}

impl List {
    /// Reads a list: columns by the names in a heading, else a stamp in the first column that is a number with the file
    /// in the first that is none; `id time file` where the first two count.
    ///
    /// # Errors
    /// [`DataError`] with path and line for a stamp that is none.
    pub(crate) fn read(path: &Path) -> DataResult<Self> {
        let rows = read_rows(path).map_err(|e| e.at(path))?;
        if rows.is_empty() {
            return Err(DataError::of_kind(ErrorKind::Missing, "the list holds no stamps").at(path));
        }
        Ok(Self { path: path.to_path_buf(), rows })
    }

    /// An error at a line of the list.
    pub(crate) fn error(&self, line: u64, problem: impl Into<String>) -> DataError {
        DataError::of_kind(ErrorKind::Corrupt, problem).at(&self.path).line(line)
    }
}

fn read_rows(path: &Path) -> DataResult<Vec<Row>> {
    let mut rows = rows::open(path)?;
    let beginning = rows.begin()?;
    let mut columns: Option<Columns> = None;
    let headings = beginning.heading.iter().chain(&beginning.comments);
    for heading in headings.filter(|h| h.names().len() == beginning.columns) {
        columns = columns.or(Columns::by_names(heading)?);
    }
    let mut found = Vec::new();
    while let Some(row) = rows.next_row()? {
        if let Some(stamp) = date_and_time(row.text()) {
            found.push(Row { stamp, file: None, line: row.line() });
            continue;
        }
        let columns = match &mut columns {
            Some(columns) => columns,
            None => columns.insert(Columns::by_first_row(&row)?),
        };
        let stamp = columns.time.stamp(&row)?;
        let file = match columns.file {
            Some(at) => {
                let text = row.field(at).filter(|f| !f.is_empty());
                Some(text.ok_or_else(|| row.error("the row names no file"))?.to_string())
            }
            None => None,
        };
        found.push(Row { stamp, file, line: row.line() });
    }
    Ok(found)
}

struct Columns {
    time: TimeColumn,
    file: Option<usize>,
}

impl Columns {
    fn by_names(heading: &Heading) -> DataResult<Option<Self>> {
        let Some(time) = heading.time()? else { return Ok(None) };
        Ok(Some(Self { time, file: heading.column(Quantity::File, None)? }))
    }

    fn by_first_row(row: &rows::Row<'_>) -> DataResult<Self> {
        let number = |i: &usize| row.field(*i).is_some_and(|f| f.parse::<f64>().is_ok());
        let file = (0..row.len()).find(|i| row.field(*i).is_some_and(|f| is_picture(Path::new(f))));
        let mut numbers = (0..file.unwrap_or(row.len())).filter(number);
        let first = numbers.next().or_else(|| (0..row.len()).find(number));
        let Some(first) = first else {
            return Err(row
                .error("the row has no stamp")
                .hint("a stamp and a file are expected, such as `12.5 a.png`"));
        };
        // `id time file`: a count stands before the time.
        let counts = file == Some(first + 2) && numbers.next() == Some(first + 1);
        Ok(Self { time: TimeColumn::new(if counts { first + 1 } else { first }, None), file })
    }
}

/// `2011-09-26 13:02:25.964389445` as nanoseconds since 1970, the clock taken for UTC.
fn date_and_time(text: &str) -> Option<Stamp> {
    let (date, time) = text.trim().split_once([' ', 'T'])?;
    let mut parts = date.splitn(3, '-').map(str::parse::<i64>);
    let (year, month, day) = (parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?);
    let mut parts = time.splitn(3, ':');
    let (hour, minute) = (parts.next()?.parse::<i64>().ok()?, parts.next()?.parse::<i64>().ok()?);
    let second = Span::parse_seconds(parts.next()?).ok()?;
    let in_range = (1970..2200).contains(&year)
        && (1..=12).contains(&month)
        && (1..=31).contains(&day)
        && (0..24).contains(&hour)
        && (0..60).contains(&minute)
        && (Span::ZERO..Span::from_millis(61_000)).contains(&second);
    if !in_range {
        return None;
    }
    // Days since 1970 by the civil calendar, whose years start in March.
    let (y, m) = if month <= 2 { (year - 1, month + 9) } else { (year, month - 3) };
    let days = 365 * y + y / 4 - y / 100 + y / 400 + (153 * m + 2) / 5 + day - 1 - 719_468;
    let seconds = (days * 24 + hour) * 3600 + minute * 60;
    Some(Stamp::from_nanos(seconds * 1_000_000_000) + second)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<(i64, Option<String>)>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("list.txt");
        std::fs::write(&path, text).unwrap();
        let list = List::read(&path).map_err(|e| e.to_string())?;
        Ok(list.rows.into_iter().map(|r| (r.stamp.as_nanos(), r.file)).collect())
    }

    #[test]
    fn lists_of_all_kinds_are_read() {
        let one = |ns: i64, file: &str| Ok(vec![(ns, Some(file.to_string()))]);
        let tum = "# color images\n# file: 'x.bag'\n# timestamp filename\n1305031102.175304 rgb/1305031102.175304.png\n";
        assert_eq!(read(tum), one(1_305_031_102_175_304_000, "rgb/1305031102.175304.png"));
        let euroc = "#timestamp [ns],filename\n1403636579763555584,1403636579763555584.png\n";
        assert_eq!(read(euroc), one(1_403_636_579_763_555_584, "1403636579763555584.png"));
        let uzh = "# id timestamp image_name\n0 1540818801.4321 img/image_0_0.png\n";
        assert_eq!(read(uzh), one(1_540_818_801_432_100_000, "img/image_0_0.png"));
        assert_eq!(
            read("0 1540818801.4321 img/image_0_0.png\n"),
            one(1_540_818_801_432_100_000, "img/image_0_0.png")
        );
        assert_eq!(read("1.5 b.png 1.6 depth/b.png\n"), one(1_500_000_000, "b.png"));
        assert_eq!(read("a.png 1.5\n"), one(1_500_000_000, "a.png"));
        assert_eq!(read("0.000000e+00\n1.036224e-01\n").unwrap()[1].0, 103_622_400);
        assert_eq!(read("2011-09-26 13:02:25.964389445\n").unwrap()[0].0, 1_317_042_145_964_389_445);
    }

    #[test]
    fn what_is_no_list_is_refused_with_its_line() {
        assert!(read("# only words\n").unwrap_err().contains("holds no stamps"));
        let error = read("1.5 a.png\nx b.png\n").unwrap_err();
        assert!(error.contains("list.txt:2: "), "{error}");
        assert!(read("a.png\n").is_err());
    }
}
