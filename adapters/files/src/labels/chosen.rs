//! Labels of chosen points out of a large CSV: lines of the others are passed over while the file is read.
//!
//! Only lines that cannot be wrong are passed over, so that the file is judged as if all of it had been read; whatever is
//! unusual stays for the reader of CSV, or makes the whole file be read.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use vice_core::label::ObservationSource;
use vice_core::time::Stamp;

use super::LabelFormat;
use super::csv_columns::Columns;
use super::csv_file::{OCCLUDED, UNCERTAIN, delimiter};
use crate::elsewhere;

/// Bytes that are read at once.
const BLOCK: usize = 1 << 20;
/// A pixel of more characters is not taken for a plain number.
const LONGEST_PIXEL: usize = 40;

/// What is left of a file: an empty line stands for each that was passed over, so that lines keep their numbers.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Sifted {
    pub(super) bytes: Vec<u8>,
    /// How many lines were passed over.
    pub(super) passed: u64,
    /// Whether one of these is at a frame; as `true` where the frames are not known.
    pub(super) at_a_frame: bool,
}

/// The lines of the named points of a CSV, and those that are unusual; `None` where the whole file has to be read: it is
/// no CSV, has quotes or lines that may be wrong, or lacks one of the points.
pub(super) fn sift(path: &Path, points: &[String], frames: Option<&[Stamp]>) -> Option<Sifted> {
    if matches!(elsewhere::find(path), Err(_) | Ok(Some(_))) {
        return None;
    }
    // What cannot be read twice is read once.
    if !path.metadata().is_ok_and(|m| m.is_file()) {
        return None;
    }
    let mut file = BufReader::with_capacity(BLOCK, File::open(path).ok()?);
    let start = file.fill_buf().ok()?;
    if crate::not_text::what(start).is_some() || LabelFormat::of_content(start) != LabelFormat::Csv {
        return None;
    }
    sift_csv(&mut file, points, frames)
}

fn sift_csv(reader: &mut dyn BufRead, points: &[String], frames: Option<&[Stamp]>) -> Option<Sifted> {
    let mut sifter: Option<Sifter<'_>> = None;
    let mut sifted = Sifted { bytes: Vec::new(), passed: 0, at_a_frame: frames.is_none_or(<[_]>::is_empty) };
    let mut line = Vec::new();
    loop {
        line.clear();
        if reader.read_until(b'\n', &mut line).ok()? == 0 {
            break;
        }
        let text = std::str::from_utf8(&line).ok()?;
        let bare = text.strip_suffix('\n').unwrap_or(text);
        let bare = bare.strip_suffix('\r').unwrap_or(bare);
        if bare.contains(['"', '\r', '\u{feff}']) {
            return None;
        }
        let is_blank = bare.trim().is_empty();
        // What a line of blanks is the reader of CSV decides.
        if is_blank && !bare.is_empty() {
            return None;
        }
        if !is_blank && !bare.starts_with('#') {
            match &mut sifter {
                None => sifter = Some(Sifter::new(bare, points)?),
                Some(sifter) => {
                    if let Some(stamp) = sifter.passes_over(bare)? {
                        let at_a_frame = || frames.is_some_and(|f| f.binary_search(&stamp).is_ok());
                        sifted.at_a_frame = sifted.at_a_frame || at_a_frame();
                        sifted.passed += 1;
                        sifted.bytes.push(b'\n');
                        continue;
                    }
                }
            }
        }
        sifted.bytes.extend_from_slice(&line);
    }
    sifter?.has_all().then_some(sifted)
}

/// A point of the file.
struct Point {
    name: String,
    chosen: bool,
    last: Stamp,
}

/// Tells which lines are passed over.
struct Sifter<'a> {
    columns: Columns,
    delimiter: char,
    width: usize,
    wanted: &'a [String],
    points: Vec<Point>,
    by_name: HashMap<String, usize>,
    /// The camera of the first line.
    camera: Option<String>,
    /// Files list points one after the other or frame by frame: the next one is mostly the same or the next.
    at: usize,
}

impl<'a> Sifter<'a> {
    fn new(heading: &str, wanted: &'a [String]) -> Option<Self> {
        let delimiter = char::from(delimiter(heading.as_bytes()));
        let columns = Columns::find(heading.split(delimiter)).ok()?;
        let width = heading.split(delimiter).count();
        let (points, by_name) = (Vec::new(), HashMap::new());
        Some(Self { columns, delimiter, width, wanted, points, by_name, camera: None, at: 0 })
    }

    /// The stamp of a line that is passed over; `Some(None)` where the line stays, `None` where all of them do.
    fn passes_over(&mut self, line: &str) -> Option<Option<Stamp>> {
        let mut fields = [""; 16];
        let mut count = 0;
        for field in line.split(self.delimiter) {
            *fields.get_mut(count)? = field.trim();
            count += 1;
        }
        if count != self.width {
            return None;
        }
        let field = |column: usize| fields.get(column).copied().unwrap_or_default();
        let stamp = field(self.columns.timestamp);
        // A number in exponent form may have been rounded.
        if stamp.contains(['e', 'E']) {
            return None;
        }
        let stamp = self.columns.stamp(stamp).ok()?;
        if let Some(column) = self.columns.camera {
            // Of several cameras the same names are other points.
            let camera = self.camera.get_or_insert_with(|| field(column).to_string());
            if camera != field(column) {
                return None;
            }
        }
        let name = field(self.columns.point);
        // The first line shows the unit of the stamps.
        let is_first = self.points.is_empty();
        // In time order no frame is labelled twice.
        let Some(chosen) = self.follows(name, stamp)? else { return Some(None) };
        let columns = &self.columns;
        let plain = is_plain(field(columns.u_px))
            && is_plain(field(columns.v_px))
            && matches!(field(columns.keyframe), "0" | "1" | "true" | "True" | "false" | "False")
            && columns
                .source
                .map(field)
                .is_none_or(|s| s.is_empty() || ObservationSource::from_name(s).is_some())
            && columns.flags.map(field).is_none_or(|f| f.is_empty() || f == OCCLUDED || f == UNCERTAIN);
        Some((plain && !chosen && !is_first).then_some(stamp))
    }

    /// Whether a point is one of the chosen, where the stamp is later than its last; `None` where it is not later, and
    /// `Some(None)` where it has no name.
    fn follows(&mut self, name: &str, stamp: Stamp) -> Option<Option<bool>> {
        if name.is_empty() {
            return Some(None);
        }
        let is_at = |index: &usize| self.points.get(*index).is_some_and(|p| p.name == name);
        let near = [self.at, self.at + 1, 0].into_iter().find(is_at);
        let Some(index) = near.or_else(|| self.by_name.get(name).copied()) else {
            let chosen = self.wanted.iter().any(|w| w == name);
            self.at = self.points.len();
            self.by_name.insert(name.to_string(), self.at);
            self.points.push(Point { name: name.to_string(), chosen, last: stamp });
            return Some(Some(chosen));
        };
        self.at = index;
        let point = &mut self.points[index];
        let is_later = stamp > point.last;
        point.last = stamp;
        is_later.then_some(Some(point.chosen))
    }

    fn has_all(&self) -> bool {
        self.wanted.iter().all(|w| self.by_name.contains_key(w))
    }
}

/// Whether a text is a number of digits, with a point or without.
fn is_plain(text: &str) -> bool {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |t: &str| t.bytes().all(|b| b.is_ascii_digit());
    text.len() <= LONGEST_PIXEL && !whole.is_empty() && all_digits(whole) && all_digits(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sift(text: &str, points: &[&str]) -> Option<Sifted> {
        let points: Vec<String> = points.iter().map(|p| (*p).to_string()).collect();
        sift_csv(&mut text.as_bytes(), &points, None)
    }

    #[test]
    fn lines_of_others_are_passed_over_and_keep_their_number() {
        let text = "# made by hand\npoint,timestamp_ns,u_px,v_px,keyframe,source,flags\n\
                    a,1,1.5,2,1,manual,\nb,1,3,4,1,auto,\n\nb,2,-3,4.25,0,,occluded\na,2,1,2,0,,\nb,3,NaN,4,0,,\nb,4,3,4,0,,odd\n";
        let sifted = sift(text, &["a"]).unwrap();
        assert_eq!(sifted.passed, 2);
        let expected = "# made by hand\npoint,timestamp_ns,u_px,v_px,keyframe,source,flags\n\
                        a,1,1.5,2,1,manual,\n\n\n\na,2,1,2,0,,\nb,3,NaN,4,0,,\nb,4,3,4,0,,odd\n";
        assert_eq!(String::from_utf8(sifted.bytes).unwrap(), expected);
        // The first row shows the unit, whosever it is.
        assert!(
            sift(text, &["b"])
                .unwrap()
                .bytes
                .starts_with(b"# made by hand\npoint,timestamp_ns,u_px,v_px,keyframe,source,flags\na,1,")
        );
    }

    #[test]
    fn what_may_be_wrong_makes_the_whole_file_be_read() {
        let head = "point,timestamp_ns,u_px,v_px,keyframe\na,1,1,2,1\n";
        assert!(sift(&format!("{head}b,1,1,2,0\n"), &["a"]).is_some());
        for (rest, points) in [
            ("b,5,1,2,1\nb,5,1,2,0\n", &["a"]),
            ("b,5,1,2,1\nb,4,1,2,0\n", &["a"]),
            ("b,5,1,2\n", &["a"]),
            ("\"b\",5,1,2,1\n", &["a"]),
            ("b,x,1,2,1\n", &["a"]),
            ("b,1.5E+18,1,2,1\n", &["a"]),
            ("b,5,1,2,1\rb,6,1,2,0\n", &["a"]),
            ("b,5,1,2,1\n", &["c"]),
            (" \n", &["a"]),
        ] {
            assert_eq!(sift(&format!("{head}{rest}"), points), None, "{rest}");
        }
        let of_cameras = "point,timestamp_ns,u_px,v_px,keyframe,camera\na,1,1,2,1,cam0\nb,1,1,2,1,";
        assert!(sift(&format!("{of_cameras}cam0\n"), &["a"]).is_some());
        assert_eq!(sift(&format!("{of_cameras}cam1\n"), &["a"]), None);
    }
}
