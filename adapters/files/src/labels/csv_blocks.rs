//! Large CSV, block by block on all threads, as long as each line is as plain as `write_csv` makes them.
//!
//! Whatever is unusual (a quote, a number in exponent form, a label twice) makes the whole file be read by
//! [`super::csv_file`], which says what is wrong: the two never differ in what they give.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use rayon::prelude::*;
use vice_core::camera::Pixel;
use vice_core::label::{LabelSetBuilder, Observation, ObservationList, ObservationSource};
use vice_core::time::Stamp;

use super::csv_columns::Columns;
use super::csv_file::{OCCLUDED, UNCERTAIN, delimiter};
use super::{LabelFile, LabelFormat};
use crate::columns::TimeUnit;
use crate::elsewhere;
use crate::leniency::Leniency;

/// Bytes of a block.
const BLOCK: usize = 1 << 22;
/// Blocks that are parsed at once.
const BLOCKS: usize = 8;
/// U+FEFF in UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Powers of ten that a double holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// The labels of a file; `None` where it is no CSV, or one that has to be read in another way.
pub(super) fn read(path: &Path) -> Option<LabelFile> {
    if matches!(elsewhere::find(path), Err(_) | Ok(Some(_))) || !path.metadata().is_ok_and(|m| m.is_file()) {
        return None;
    }
    read_blocks(File::open(path).ok()?, BLOCK)
}

fn read_blocks(mut reader: impl Read, size: usize) -> Option<LabelFile> {
    let mut blocks: Vec<Vec<u8>> = vec![Vec::new()];
    // What follows the last line end of what was read.
    let mut rest: Vec<u8> = Vec::new();
    let mut plan: Option<Plan> = None;
    let mut into = Into::default();
    loop {
        let (mut filled, mut ended) = (0, false);
        while filled < BLOCKS && !ended {
            if blocks.len() == filled {
                blocks.push(Vec::new());
            }
            let block = &mut blocks[filled];
            block.clear();
            block.append(&mut rest);
            let most = size.saturating_sub(block.len()).max(1) as u64;
            let read = reader.by_ref().take(most).read_to_end(block).ok()?;
            ended = (read as u64) < most;
            if !ended {
                // A line longer than a block is none of a table.
                let end = block.iter().rposition(|b| *b == b'\n')? + 1;
                rest.extend_from_slice(&block[end..]);
                block.truncate(end);
            }
            filled += 1;
        }
        let mut some: Vec<&[u8]> = blocks[..filled].iter().map(Vec::as_slice).collect();
        if plan.is_none() {
            let (found, rows) = Plan::find(some[0])?;
            into.lines = some[0][..some[0].len() - rows.len()].iter().filter(|b| **b == b'\n').count() as u64;
            some[0] = rows;
            plan = Some(found);
        }
        let plan = plan.as_ref()?;
        let parsed: Vec<Option<Parsed>> = some.par_iter().map(|block| plan.parse(block)).collect();
        for parsed in parsed {
            into.take(parsed?)?;
        }
        if ended {
            return into.finish(plan);
        }
    }
}

/// What is known of the whole file so far.
#[derive(Default)]
struct Into {
    labels: LabelSetBuilder,
    lenient: Leniency,
    lines: u64,
    rows: u64,
    kept: usize,
}

impl Into {
    fn take(&mut self, parsed: Parsed) -> Option<()> {
        self.lenient.rows(parsed.rows);
        self.rows += parsed.rows;
        parsed.gaps.iter().for_each(|line| self.lenient.gap(self.lines + line));
        for (name, list) in parsed.points {
            self.kept += list.len();
            self.labels.append(&name, list.lines_later(self.lines)).ok()?;
        }
        self.lines += parsed.lines;
        Some(())
    }

    fn finish(self, plan: &Plan) -> Option<LabelFile> {
        if self.rows == 0 {
            return None;
        }
        self.lenient.check(self.kept, "pixel").ok()?;
        let mut file = LabelFile::of(self.labels.finish().ok()?);
        file.labels.camera = plan.camera.clone().filter(|name| !name.is_empty());
        file.suspicions = self.lenient.suspicions("");
        file.suspicions.extend(plan.columns.unknown_said());
        Some(file)
    }
}

/// What a column holds.
#[derive(Clone, Copy)]
enum Kind {
    Point,
    Stamp,
    U,
    V,
    Keyframe,
    Source,
    Flags,
    Camera,
    Other,
}

/// Which column holds what, between which delimiters, in which unit.
struct Plan {
    columns: Columns,
    kinds: Vec<Kind>,
    delimiter: u8,
    /// Stamps are whole nanoseconds.
    nanos: bool,
    /// The camera of all rows; a file of several is read in another way.
    camera: Option<String>,
}

/// What a block holds.
struct Parsed {
    points: Vec<(String, ObservationList)>,
    rows: u64,
    /// Lines of rows without a pixel, counted from 1 in the block.
    gaps: Vec<u64>,
    lines: u64,
}

fn bare(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\r").unwrap_or(line)
}

impl Plan {
    /// By the heading; and what follows it.
    fn find(start: &[u8]) -> Option<(Self, &[u8])> {
        let bytes = start.strip_prefix(BYTE_ORDER_MARK).unwrap_or(start);
        if crate::not_text::what(start).is_some() || LabelFormat::of_content(start) != LabelFormat::Csv {
            return None;
        }
        let is_row = |line: &&[u8]| !(bare(line).is_empty() || line.starts_with(b"#"));
        let mut lines = bytes.split_inclusive(|b| *b == b'\n');
        let mut next = || lines.by_ref().map(|line| line.strip_suffix(b"\n").unwrap_or(line)).find(is_row);
        let heading = bare(next()?);
        let end = heading.as_ptr_range().end.addr() - bytes.as_ptr().addr();
        let first = bare(next()?);
        let text = std::str::from_utf8(heading).ok().filter(|t| !t.contains(['"', '\r', '\u{feff}']))?;
        let delimiter = delimiter(heading);
        let mut columns = Columns::find(text.split(char::from(delimiter))).ok()?;
        // The first row shows the unit of the stamps.
        let stamp = first.split(|b| *b == delimiter).nth(columns.timestamp)?;
        columns.stamp(std::str::from_utf8(stamp).ok()?.trim()).ok()?;
        let camera = match columns.camera {
            Some(column) => {
                let field = first.split(|b| *b == delimiter).nth(column)?;
                let name = std::str::from_utf8(field).ok()?;
                Some(name.to_string())
                    .filter(|n| n.trim() == n && !n.contains(['"', '\r', '\u{feff}']))?
                    .into()
            }
            None => None,
        };
        let kind = |column: usize| match column {
            c if c == columns.point => Kind::Point,
            c if c == columns.timestamp => Kind::Stamp,
            c if c == columns.u_px => Kind::U,
            c if c == columns.v_px => Kind::V,
            c if c == columns.keyframe => Kind::Keyframe,
            c if Some(c) == columns.source => Kind::Source,
            c if Some(c) == columns.flags => Kind::Flags,
            c if Some(c) == columns.camera => Kind::Camera,
            _ => Kind::Other,
        };
        let kinds = (0..text.split(char::from(delimiter)).count()).map(kind).collect();
        let nanos = columns.unit() == Some(TimeUnit::Nanos);
        Some((Self { columns, kinds, delimiter, nanos, camera }, &bytes[end..]))
    }

    fn parse(&self, block: &[u8]) -> Option<Parsed> {
        let mut points = Points::default();
        let mut parsed = Parsed { points: Vec::new(), rows: 0, gaps: Vec::new(), lines: 0 };
        let mut rest = block;
        while !rest.is_empty() {
            let line = parsed.lines + 1;
            if let [b'\n', ..] | [b'\r', b'\n', ..] | [b'#', ..] = rest {
                let end = rest.iter().position(|b| *b == b'\n').map_or(rest.len(), |at| at + 1);
                rest = &rest[end..];
            } else {
                let (point, observation);
                (point, observation, rest) = self.row(rest, &mut points, line)?;
                parsed.rows += 1;
                if observation.px.u.is_nan() || observation.px.v.is_nan() {
                    if observation.keyframe {
                        return None;
                    }
                    parsed.gaps.push(line);
                } else {
                    points.all[point].1.push(observation);
                }
            }
            parsed.lines += 1;
        }
        // The last line of a file may have no end; then no line follows it.
        parsed.points = points.all.into_iter().filter(|(_, list)| !list.is_empty()).collect();
        Some(parsed)
    }

    /// The row at the beginning of some bytes, and what follows it.
    fn row<'b>(
        &self,
        bytes: &'b [u8],
        points: &mut Points,
        line: u64,
    ) -> Option<(usize, Observation, &'b [u8])> {
        let mut rest = bytes;
        let mut point = 0;
        let mut o = Observation { line, ..Observation::manual(Stamp::from_nanos(0), Pixel::new(0.0, 0.0)) };
        let last = self.kinds.len() - 1;
        for (column, kind) in self.kinds.iter().enumerate() {
            let ends = |b: u8| b == self.delimiter || b == b'\n';
            let after = match kind {
                Kind::Stamp if self.nanos => match whole(rest) {
                    Some((nanos, after)) => {
                        o.stamp = Stamp::from_nanos(nanos);
                        Some(after)
                    }
                    None => None,
                },
                Kind::U | Kind::V => match decimal(rest) {
                    Some((value, after)) => {
                        if matches!(kind, Kind::U) {
                            o.px.u = value
                        } else {
                            o.px.v = value
                        }
                        Some(after)
                    }
                    None => None,
                },
                _ => None,
            };
            // What was read quickly ends where the field does.
            let quick = after.filter(|after| match after {
                [b'\r', b'\n', ..] | [] | [b'\n', ..] => column == last,
                [next, ..] => *next == self.delimiter,
            });
            rest = match quick {
                Some(after) => after,
                None => {
                    let end = rest.iter().position(|b| ends(*b)).unwrap_or(rest.len());
                    let (mut field, after) = rest.split_at(end);
                    if column == last {
                        field = bare(field);
                    }
                    match kind {
                        Kind::Point => point = points.find(field)?,
                        _ => self.field(*kind, field, &mut o)?,
                    }
                    after
                }
            };
            rest = match (rest, column == last) {
                ([next, after @ ..], false) if *next == self.delimiter => after,
                ([b'\n', after @ ..] | [b'\r', b'\n', after @ ..], true) => after,
                ([], true) => rest,
                _ => return None,
            };
        }
        Some((point, o, rest))
    }

    fn field(&self, kind: Kind, field: &[u8], o: &mut Observation) -> Option<()> {
        let text = || std::str::from_utf8(field).ok();
        let number = || {
            let text = text()?;
            if text.get(..3).is_some_and(|t| t.eq_ignore_ascii_case("nan")) {
                return Some(f64::NAN);
            }
            text.parse::<f64>().ok().filter(|v| v.is_finite())
        };
        match kind {
            Kind::Stamp => {
                let text = text().filter(|t| !t.contains(['e', 'E']))?;
                o.stamp = self.columns.stamp_in_unit(text).ok()?;
            }
            Kind::U => o.px.u = number()?,
            Kind::V => o.px.v = number()?,
            Kind::Keyframe => {
                o.keyframe = match field {
                    b"1" | b"true" | b"True" => true,
                    b"0" | b"false" | b"False" => false,
                    _ => return None,
                };
            }
            Kind::Source => {
                o.source = match field {
                    b"" => ObservationSource::default(),
                    _ => ObservationSource::from_name(text()?)?,
                };
            }
            Kind::Flags => {
                if !field.is_empty() {
                    for flag in text()?.split(['+', '|']) {
                        match flag {
                            OCCLUDED => o.occluded = true,
                            UNCERTAIN => o.uncertain = true,
                            _ => return None,
                        }
                    }
                }
            }
            Kind::Camera => (self.camera.as_ref()?.as_bytes() == field).then_some(())?,
            Kind::Point | Kind::Other => {
                text().filter(|t| !t.contains(['"', '\r']) && !t.starts_with('\u{feff}'))?;
            }
        }
        Some(())
    }
}

/// The points of a block.
#[derive(Default)]
struct Points {
    all: Vec<(String, ObservationList)>,
    by_name: HashMap<String, usize>,
    /// Files list points one after the other or frame by frame: the next one is mostly the same or the next.
    last: usize,
}

impl Points {
    fn find(&mut self, name: &[u8]) -> Option<usize> {
        let is_at = |i: &usize| self.all.get(*i).is_some_and(|p| p.0.as_bytes() == name);
        let near = [self.last, self.last + 1, 0].into_iter().find(is_at);
        self.last = match near {
            Some(index) => index,
            None => {
                let name = std::str::from_utf8(name).ok()?;
                match self.by_name.get(name) {
                    Some(index) => *index,
                    None => {
                        let odd = name.is_empty()
                            || name.trim() != name
                            || name.contains(['"', '\r'])
                            || name.starts_with('\u{feff}');
                        if odd {
                            return None;
                        }
                        self.by_name.insert(name.to_string(), self.all.len());
                        self.all.push((name.to_string(), ObservationList::default()));
                        self.all.len() - 1
                    }
                }
            }
        };
        Some(self.last)
    }
}

/// A whole number at the beginning of some bytes, and what follows it.
fn whole(bytes: &[u8]) -> Option<(i64, &[u8])> {
    let (negative, digits) = match bytes {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, bytes),
    };
    let (value, count) = some_digits(digits, 0);
    if count == 0 || count > 18 {
        // Nineteen digits may be too many: only those of an epoch are not.
        let fits = count == 19 && value <= i64::MAX as u64;
        if !fits {
            return None;
        }
    }
    let value = i64::try_from(value).ok()?;
    Some((if negative { -value } else { value }, &digits[count..]))
}

/// A decimal number at the beginning of some bytes, rounded as the standard library rounds it, and what follows it; `None`
/// where it has more digits than can be rounded at once, or is written in another way.
fn decimal(bytes: &[u8]) -> Option<(f64, &[u8])> {
    let (negative, digits) = match bytes {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, bytes),
    };
    let (mut value, before) = some_digits(digits, 0);
    let mut after = &digits[before..];
    let mut decimals = 0;
    if let [b'.', rest @ ..] = after {
        (value, decimals) = some_digits(rest, value);
        after = &rest[decimals..];
    }
    // A quotient of two doubles that are exact is the double nearest to the number.
    if before == 0 || before + decimals > 19 || value > 1 << 53 || decimals >= POWERS.len() {
        return None;
    }
    let value = value as f64 / POWERS[decimals];
    Some((if negative { -value } else { value }, after))
}

/// The digits at the beginning of some bytes behind those of `value`; and how many. Of too many the value is any.
#[inline]
fn some_digits(bytes: &[u8], mut value: u64) -> (u64, usize) {
    let mut count = 0;
    for byte in bytes {
        let digit = byte.wrapping_sub(b'0');
        if digit > 9 {
            break;
        }
        value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
        count += 1;
    }
    (value, count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::csv_file::read_csv_file;
    use crate::labels::tests::any_labels;
    use crate::labels::write_csv;
    use proptest::prelude::*;

    fn both(bytes: &[u8]) -> Option<LabelFile> {
        let slow = read_csv_file(bytes);
        let mut found = None;
        for size in [16, 64, 1 << 20] {
            let Some(quick) = read_blocks(bytes, size) else { continue };
            assert_eq!(Ok(&quick), slow.as_ref().map_err(ToString::to_string), "{size}");
            found = Some(quick);
        }
        found
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_as_ever(labels in any_labels(), stamp in prop::sample::select(vec!["\n", "\r\n", "\n\n", "\n#,,\n"])) {
            let mut bytes = Vec::new();
            write_csv(&mut bytes, &labels).unwrap();
            let text = String::from_utf8(bytes).unwrap().replace('\n', stamp);
            let found = both(text.as_bytes());
            prop_assert!(found.is_some() || text.contains('"') || text.contains("  "), "{}", text);
        }

        #[test]
        fn numbers_are_those_of_the_standard_library(whole in 0_u64..1 << 60, decimals in 0_usize..25, negative in any::<bool>()) {
            let mut text = format!("{whole:0>width$}", width = decimals + 1);
            text.insert(text.len() - decimals, '.');
            if negative {
                text.insert(0, '-');
            }
            let expected: f64 = text.parse().unwrap();
            if let Some((value, rest)) = decimal(format!("{text},").as_bytes()) {
                prop_assert_eq!((value.to_bits(), rest), (expected.to_bits(), &b","[..]), "{}", text);
            }
            let text = format!("{}{whole}", if negative { "-" } else { "" });
            prop_assert_eq!(super::whole(text.as_bytes()), Some((text.parse().unwrap(), &b""[..])));
        }

        #[test]
        fn no_table_is_read_in_two_ways(
            rows in prop::collection::vec(prop::collection::vec(prop::sample::select(vec![
                "a", "b", "1", "0", "12.5", "-3", "nan", "1e9", "", " 1", "auto", "occluded", "x", "1403715280562142976", "+4",
            ]), 5..8), 0..8),
        ) {
            let mut text = "point,timestamp_ns,u_px,v_px,keyframe,source,flags\n".to_string();
            for row in &rows {
                text.push_str(&row.join(","));
                text.push('\n');
            }
            both(text.as_bytes());
        }
    }

    #[test]
    fn plain_tables_are_read_in_blocks() {
        for text in [
            "point,timestamp_ns,u_px,v_px,keyframe\na,1,1.5,2.25,1\nb,1,3,4,1\na,2,-1.125,2,0\nb,2,3,4,0",
            "\u{feff}# by hand\n\npoint;t_s;u;v;key_frame;odd\na;1.5;1.5;2.5;1;x y\na;1.75;1;2;False;\n",
            "point,timestamp_ns,u_px,v_px,keyframe,camera\na,1,1.5,2.25,1,cam0\nb,1,3,4,1,cam0\n",
            "camera,point,timestamp_ns,u_px,v_px,keyframe\n,a,1,1.5,2.25,1\n,b,1,3,4,1\n",
            "label\ttimestamp [us]\tx [px]\ty [px]\tis_keyframe\r\na\t1500000\t1.5\t2.5\ttrue\r\n",
            "point,timestamp_ns,u_px,v_px,keyframe,source,flags\na,1,1,2,1,,\na,2,NaN,2,0,auto,occluded+uncertain\n\
             a,3,0.1234567890123456789,2e0,0,auto,uncertain\n",
        ] {
            assert!(both(text.as_bytes()).is_some(), "{text}");
        }
        for text in [
            "point,timestamp_ns,u_px,v_px,keyframe\n",
            "point,timestamp_ns,u_px,v_px,keyframe\na,1,1,2,1\na,1,1,2,0\n",
            "point,timestamp_ns,u_px,v_px,keyframe\na,1,1,2,1\na,2,1,2\n",
            "point,timestamp_ns,u_px,v_px,keyframe\na,1,1,2,1\n\"a\",2,1,2,0\n",
            "point,timestamp_ns,u_px,v_px,keyframe\na,1,1,2,1\r a,2,1,2,0\n",
            "point,timestamp_ns,u_px,v_px,keyframe\na,1.5E+18,1,2,1\na,1.6E+18,1,2,0\n",
            "point,timestamp_ns,u_px,v_px,keyframe\na,9223372036854775808,1,2,1\n",
            "{\"schema\": \"vice.labels/1\"}",
            "point,timestamp_ns,u_px,v_px,keyframe,camera\na,1,1,2,1,cam0\na,1,1,2,1,cam1\n",
            "point,timestamp_ns,u_px,v_px,keyframe,camera\na,1,1,2,1, cam0\n",
        ] {
            assert!(both(text.as_bytes()).is_none(), "{text}");
        }
    }
}
