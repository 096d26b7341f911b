//! The rows of an element, one after the other.
//!
//! Rows of numbers alone are read by loops of our own: binary ones are decoded a block at a time where they lie, text
//! goes through [`super::number`]. ply-rs would take a microsecond a row, and its text grammar knows neither `nan`
//! nor `.5`. Rows with lists, which are the rare ones, are ply-rs's.

use std::io::Read;

use ply_rs::parser::{ParseError, Parser};
use ply_rs::ply::{Property, PropertyAccess, PropertyAccessResult};
use vice_core::error::{DataError, DataResult};

use super::header::{BYTE_ORDER_MARK, Element, Kind, Layout, Scalar};
use super::number::{next_number, skip_word};
use super::source::{Source, unreadable};

/// Takes the points of a file, in its order.
pub(crate) trait PointSink {
    /// How many points the header promises and, where the file's length tells, how many it can hold at most.
    fn expect(&mut self, promised: u64, at_most: Option<u64>) -> DataResult<()>;
    /// A point that is stored in single precision.
    fn single(&mut self, point: [f32; 3]) -> DataResult<()>;
    /// Points that are stored in single precision, a block of the file at a time.
    fn singles(&mut self, mut points: impl ExactSizeIterator<Item = [f32; 3]> + Clone) -> DataResult<()> {
        points.try_for_each(|point| self.single(point))
    }
    /// A point that is stored otherwise.
    fn double(&mut self, point: [f64; 3]) -> DataResult<()>;
}

/// A file whose header has been read.
pub(crate) struct Rows<R> {
    pub(crate) source: Source<R>,
    pub(crate) layout: Layout,
    /// Line of the next row, counted from 1; of text only.
    pub(crate) line: u64,
}

/// A row that has lists, as ply-rs fills it: what of it is wanted.
#[derive(Default)]
pub(crate) struct ListRow {
    pub(crate) xyz: [f64; 3],
    pub(crate) corners: Vec<i64>,
}

impl PropertyAccess for ListRow {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            "vertex_indices" | "vertex_index" => {
                self.corners = match property {
                    Property::ListChar(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListUChar(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListShort(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListUShort(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListInt(v) => v.into_iter().map(i64::from).collect(),
                    Property::ListUInt(v) => v.into_iter().map(i64::from).collect(),
                    _ => return PropertyAccessResult::Ignored,
                };
                return PropertyAccessResult::Set;
            }
            _ => return PropertyAccessResult::Ignored,
        };
        self.xyz[axis] = match property {
            Property::Char(v) => v.into(),
            Property::UChar(v) => v.into(),
            Property::Short(v) => v.into(),
            Property::UShort(v) => v.into(),
            Property::Int(v) => v.into(),
            Property::UInt(v) => v.into(),
            Property::Float(v) => v.into(),
            Property::Double(v) => v,
            _ => return PropertyAccessResult::Ignored,
        };
        PropertyAccessResult::Set
    }
}

impl<R: Read> Rows<R> {
    /// Reads the `x y z` of every row of an element.
    pub(crate) fn points(&mut self, element: &Element, sink: &mut impl PointSink) -> DataResult<()> {
        let columns = coordinate_columns(element)?;
        let at_most = self.source.remaining().map(|left| left / element.min_row_bytes(self.layout).max(1));
        match (self.layout, element.row_bytes(), at_most) {
            // A row of numbers has a fixed size, so that a broken promise shows before anything is read.
            (Layout::LittleEndian | Layout::BigEndian, Some(_), Some(rows)) if rows < element.count => {
                return Err(self.broken_promise(element, rows));
            }
            _ => sink.expect(element.count, at_most)?,
        }
        match (self.layout, element.row_bytes()) {
            (Layout::Ascii, Some(_)) => self.text_points(element, columns, sink),
            (_, Some(row_bytes)) => self.binary_points(element, columns, row_bytes, sink),
            (_, None) => {
                let single = columns.iter().all(|c| element.properties[*c].kind == Kind::One(Scalar::F32));
                self.list_rows(element, |row| match single {
                    true => sink.single(row.xyz.map(|v| v as f32)),
                    false => sink.double(row.xyz),
                })
            }
        }
    }

    /// Passes over the rows of an element.
    pub(crate) fn skip(&mut self, element: &Element) -> DataResult<()> {
        match (self.layout, element.row_bytes()) {
            (Layout::Ascii, _) => {
                for row in 0..element.count {
                    let length = self.text_row(element, row)?;
                    self.source.pass(length);
                }
                Ok(())
            }
            (_, Some(0)) => Ok(()),
            (_, Some(row_bytes)) => {
                let (start, row_bytes) = (self.source.offset(), row_bytes as u64);
                match self.source.skip(element.count.saturating_mul(row_bytes))? {
                    true => Ok(()),
                    false => Err(self.broken_promise(element, (self.source.offset() - start) / row_bytes)),
                }
            }
            (_, None) => self.list_rows(element, |_| Ok(())),
        }
    }

    /// Gives every row of an element that has lists to `take`.
    pub(crate) fn list_rows(
        &mut self,
        element: &Element,
        mut take: impl FnMut(ListRow) -> DataResult<()>,
    ) -> DataResult<()> {
        let parser = Parser::<ListRow>::new();
        for row in 0..element.count {
            let parsed = match self.layout {
                Layout::LittleEndian => {
                    parser.read_little_endian_element(&mut self.source, &element.definition)
                }
                Layout::BigEndian => parser.read_big_endian_element(&mut self.source, &element.definition),
                Layout::Ascii => {
                    let length = self.text_row(element, row)?;
                    let text = String::from_utf8_lossy(&self.source.ahead()[..length]);
                    let parsed = parser.read_ascii_element(text.trim(), &element.definition);
                    self.source.pass(length);
                    parsed
                }
            };
            take(parsed.map_err(|e| self.bad_list_row(element, row, &e))?)?;
        }
        Ok(())
    }

    fn binary_points(
        &mut self,
        element: &Element,
        columns: [usize; 3],
        row_bytes: usize,
        sink: &mut impl PointSink,
    ) -> DataResult<()> {
        let scalar = |column: usize| match element.properties[column].kind {
            Kind::One(scalar) | Kind::List { count: scalar, .. } => scalar,
        };
        let offset = |column: usize| -> usize { (0..column).map(|c| scalar(c).bytes()).sum() };
        let (at, scalars) = (columns.map(offset), columns.map(scalar));
        let big = self.layout == Layout::BigEndian;
        let mut left = element.count;
        while left > 0 {
            if !self.source.at_least(row_bytes)? {
                return Err(self.broken_promise(element, element.count - left));
            }
            let rows = left.min((self.source.ahead().len() / row_bytes) as u64);
            let block = &self.source.ahead()[..rows as usize * row_bytes];
            if scalars == [Scalar::F32; 3] {
                singles(block, row_bytes, at, big, sink)?;
            } else {
                for row in block.chunks_exact(row_bytes) {
                    sink.double(std::array::from_fn(|i| number(&row[at[i]..], scalars[i], big)))?;
                }
            }
            self.source.pass(rows as usize * row_bytes);
            left -= rows;
        }
        Ok(())
    }

    fn text_points(
        &mut self,
        element: &Element,
        columns: [usize; 3],
        sink: &mut impl PointSink,
    ) -> DataResult<()> {
        let single = columns.iter().all(|c| element.properties[*c].kind == Kind::One(Scalar::F32));
        let width = element.properties.len();
        let mut axis_of = vec![None; width];
        for (axis, column) in columns.into_iter().enumerate() {
            axis_of[column] = Some(axis);
        }
        for row in 0..element.count {
            let length = self.text_row(element, row)?;
            let mut rest = &self.source.ahead()[..length];
            let mut point = [0.0; 3];
            for (column, axis) in axis_of.iter().enumerate() {
                let next = match axis {
                    Some(axis) => next_number(rest).map(|(value, rest)| {
                        point[*axis] = value;
                        rest
                    }),
                    None => skip_word(rest),
                };
                rest = match next {
                    Some(rest) => rest,
                    None => return Err(self.bad_text_row(element, column, length)),
                };
            }
            if skip_word(rest).is_some() {
                return Err(self.bad_text_row(element, width, length));
            }
            self.source.pass(length);
            match single {
                true => sink.single(point.map(|v| v as f32))?,
                false => sink.double(point)?,
            }
        }
        Ok(())
    }

    /// Length of the next line that is not blank, its end included; blank ones are passed over.
    fn text_row(&mut self, element: &Element, row: u64) -> DataResult<usize> {
        let mut searched = 0;
        self.pass_mark()?;
        loop {
            let bytes = self.source.ahead();
            if let Some(end) = bytes[searched..].iter().position(|b| *b == b'\n') {
                let length = searched + end + 1;
                self.line += 1;
                if !bytes[..length].trim_ascii().is_empty() {
                    return Ok(length);
                }
                self.source.pass(length);
                self.pass_mark()?;
                searched = 0;
                continue;
            }
            searched = bytes.len();
            if !self.source.more().map_err(unreadable)? {
                // The last line may lack its end.
                if self.source.ahead().trim_ascii().is_empty() {
                    return Err(self.broken_promise(element, row));
                }
                self.line += 1;
                return Ok(searched);
            }
        }
    }

    /// A byte-order mark where a line starts is no part of its numbers.
    fn pass_mark(&mut self) -> DataResult<()> {
        if self.source.at_least(BYTE_ORDER_MARK.len())? && self.source.ahead().starts_with(BYTE_ORDER_MARK) {
            self.source.pass(BYTE_ORDER_MARK.len());
        }
        Ok(())
    }

    fn broken_promise(&self, element: &Element, rows: u64) -> DataError {
        let (name, count) = (&element.name, element.count);
        let error = DataError::new(format!(
            "the header promises {count} rows of `{name}`, the file ends after {rows}"
        ))
        .hint("it was cut off, or its header is wrong");
        match self.layout {
            Layout::Ascii => error.line(self.line),
            _ => error.byte(self.source.offset()),
        }
    }

    fn bad_text_row(&self, element: &Element, column: usize, length: usize) -> DataError {
        let text = String::from_utf8_lossy(&self.source.ahead()[..length]);
        let shown: String = text.trim().chars().take(60).collect();
        let problem = match element.properties.get(column) {
            Some(p) => format!("no number for `{}` of a `{}` in `{shown}`", p.name, element.name),
            None => format!("more than the {column} numbers of a `{}` in `{shown}`", element.name),
        };
        DataError::new(problem).line(self.line)
    }

    fn bad_list_row(&self, element: &Element, row: u64, error: &ParseError) -> DataError {
        if error.kind() == std::io::ErrorKind::UnexpectedEof || self.source.remaining() == Some(0) {
            return self.broken_promise(element, row);
        }
        let text = error.to_string();
        let cause = text.lines().last().unwrap_or_default().trim();
        let error = DataError::new(format!("row {row} of `{}`: {cause}", element.name));
        match self.layout {
            Layout::Ascii => error.line(self.line),
            _ => error.byte(self.source.offset()),
        }
    }
}

/// Columns of x, y and z, which must be numbers.
fn coordinate_columns(element: &Element) -> DataResult<[usize; 3]> {
    let mut columns = [0; 3];
    for (column, name) in columns.iter_mut().zip(["x", "y", "z"]) {
        *column = element.index_of(name).ok_or_else(|| {
            let names: Vec<&str> = element.properties.iter().map(|p| p.name.as_str()).collect();
            DataError::new(format!("`{}` has no property `{name}`", element.name))
                .hint(format!("it has {}", names.join(", ")))
        })?;
        if let Kind::List { .. } = element.properties[*column].kind {
            return Err(DataError::new(format!("`{name}` of `{}` is a list, not a number", element.name)));
        }
    }
    Ok(columns)
}

/// Rows whose coordinates are single precision, which is most of them: kept apart so that the loop is tight.
fn singles(
    block: &[u8],
    row_bytes: usize,
    at: [usize; 3],
    big: bool,
    sink: &mut impl PointSink,
) -> DataResult<()> {
    let read = |row: &[u8], at: usize| -> f32 {
        let bytes = row.get(at..at + 4).and_then(|b| b.try_into().ok()).unwrap_or_default();
        if big { f32::from_be_bytes(bytes) } else { f32::from_le_bytes(bytes) }
    };
    // Nothing but coordinates is common, and a loop over rows of a known size is the fastest.
    if at == [0, 4, 8] && row_bytes == 12 && !big {
        let (rows, _) = block.as_chunks::<12>();
        return sink.singles(rows.iter().map(|row| [0, 4, 8].map(|at| read(row, at))));
    }
    sink.singles(block.chunks_exact(row_bytes).map(|row| at.map(|at| read(row, at))))
}

/// A number at the start of `bytes`, which hold it.
fn number(bytes: &[u8], scalar: Scalar, big: bool) -> f64 {
    fn first<const N: usize>(bytes: &[u8], big: bool) -> [u8; N] {
        let mut array: [u8; N] = bytes.get(..N).and_then(|b| b.try_into().ok()).unwrap_or([0; N]);
        if big {
            array.reverse();
        }
        array
    }
    match scalar {
        Scalar::I8 => i8::from_le_bytes(first(bytes, big)).into(),
        Scalar::U8 => u8::from_le_bytes(first(bytes, big)).into(),
        Scalar::I16 => i16::from_le_bytes(first(bytes, big)).into(),
        Scalar::U16 => u16::from_le_bytes(first(bytes, big)).into(),
        Scalar::I32 => i32::from_le_bytes(first(bytes, big)).into(),
        Scalar::U32 => u32::from_le_bytes(first(bytes, big)).into(),
        Scalar::F32 => f32::from_le_bytes(first(bytes, big)).into(),
        Scalar::F64 => f64::from_le_bytes(first(bytes, big)),
    }
}
