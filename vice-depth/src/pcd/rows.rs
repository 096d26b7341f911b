//! The points of a PCD file in its three forms.

use std::io::Read;

use vice_core::error::{DataError, DataResult, ErrorKind};

use super::header::{Axis, Header, Scalar, next_line};
use super::{ends_early, lzf};
use crate::ply::{PointSink, Source};

pub(super) fn text<R: Read>(
    source: &mut Source<R>,
    header: &Header,
    sink: &mut impl PointSink,
) -> DataResult<()> {
    let mut line = header.lines;
    let mut found = 0;
    while found < header.points {
        line += 1;
        let Some(row) = next_line(source).map_err(|e| e.line(line))? else {
            return Err(
                DataError::new(format!("the file ends after {found} of {} points", header.points)).line(line)
            );
        };
        if row.trim().is_empty() {
            continue;
        }
        let words: Vec<&str> = row.split_whitespace().collect();
        if words.len() != header.words {
            return Err(DataError::new(format!("the row has {} numbers, not {}", words.len(), header.words))
                .line(line));
        }
        let mut point = [0.0; 3];
        for (value, axis) in point.iter_mut().zip(&header.axes) {
            let word = words[axis.word];
            *value = word.parse().map_err(|_| DataError::new(format!("`{word}` is no number")).line(line))?;
        }
        found += 1;
        // What is written as text has more digits than a float holds, as coordinates of a map do.
        sink.double(point)?;
    }
    Ok(())
}

pub(super) fn binary<R: Read>(
    source: &mut Source<R>,
    header: &Header,
    sink: &mut impl PointSink,
) -> DataResult<()> {
    let size = header.point_bytes;
    let single = header.axes.iter().all(|axis| axis.scalar == Scalar::F32);
    let [x, y, z] = header.axes.map(|axis| axis.offset);
    let mut left = header.points;
    while left > 0 {
        if !source.at_least(size)? {
            return Err(ends_early(header.points - left, header.points, source.offset()));
        }
        let ahead = source.ahead();
        let rows = ((ahead.len() / size) as u64).min(left) as usize;
        let block = &ahead[..rows * size];
        if single {
            let at = |row: &[u8], o: usize| f32::from_le_bytes([row[o], row[o + 1], row[o + 2], row[o + 3]]);
            sink.singles(block.chunks_exact(size).map(|row| [at(row, x), at(row, y), at(row, z)]))?;
        } else {
            for row in block.chunks_exact(size) {
                sink.double(header.axes.map(|axis| axis.scalar.of(&row[axis.offset..])))?;
            }
        }
        source.pass(rows * size);
        left -= rows as u64;
    }
    Ok(())
}

/// A coordinate of all points, which lie one behind the other.
struct Column {
    axis: Axis,
    /// Where it starts and ends among the bytes that are made.
    start: u64,
    end: u64,
    values: Vec<f64>,
    singles: Vec<f32>,
    /// Bytes of a number that a piece broke off.
    rest: Vec<u8>,
}

impl Column {
    fn new(axis: Axis, points: u64) -> DataResult<Self> {
        let places = |bytes: usize| {
            points
                .checked_mul(bytes as u64)
                .ok_or_else(|| DataError::new(format!("{points} points are no cloud")))
        };
        let start = places(axis.offset)?;
        let end = start.saturating_add(places(axis.scalar.bytes())?);
        Ok(Self { axis, start, end, values: Vec::new(), singles: Vec::new(), rest: Vec::new() })
    }

    /// Takes what a piece that starts at a place has of it.
    fn take(&mut self, place: u64, piece: &[u8]) {
        let from = self.start.saturating_sub(place).min(piece.len() as u64) as usize;
        let to = self.end.saturating_sub(place).min(piece.len() as u64) as usize;
        if from >= to {
            return;
        }
        let size = self.axis.scalar.bytes();
        let mut own = &piece[from..to];
        if !self.rest.is_empty() {
            let (head, tail) = own.split_at((size - self.rest.len()).min(own.len()));
            self.rest.extend_from_slice(head);
            own = tail;
            if self.rest.len() < size {
                return;
            }
            let whole = std::mem::take(&mut self.rest);
            self.push(&whole);
        }
        let numbers = own.chunks_exact(size);
        let broken = numbers.remainder().to_vec();
        for bytes in numbers {
            self.push(bytes);
        }
        self.rest = broken;
    }

    fn push(&mut self, bytes: &[u8]) {
        match self.axis.scalar {
            Scalar::F32 => self.singles.push(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])),
            scalar => self.values.push(scalar.of(bytes)),
        }
    }

    fn len(&self) -> usize {
        self.values.len() + self.singles.len()
    }

    fn get(&self, i: usize) -> f64 {
        self.singles.get(i).map_or_else(|| self.values[i], |v| f64::from(*v))
    }
}

/// All x, then all y, then all z, and so on, compressed as one: the coordinates are held a second time until they are
/// together.
pub(super) fn compressed<R: Read>(
    source: &mut Source<R>,
    header: &Header,
    sink: &mut impl PointSink,
) -> DataResult<()> {
    let at = source.offset();
    if !source.at_least(8)? {
        return Err(DataError::new("the file ends before its compressed points").byte(at));
    }
    let head = source.ahead();
    let size = |i: usize| u64::from(u32::from_le_bytes([head[i], head[i + 1], head[i + 2], head[i + 3]]));
    let (packed, whole) = (size(0), size(4));
    source.pass(8);
    let expected = header.points.saturating_mul(header.point_bytes as u64);
    if whole != expected {
        return Err(DataError::of_kind(
            ErrorKind::Contradictory,
            format!("the compressed points are {whole} bytes, and {} points are {expected}", header.points),
        )
        .byte(at));
    }
    if source.remaining().is_some_and(|left| left < packed) {
        return Err(DataError::new(format!(
            "{packed} bytes of compressed points are announced, and the file ends"
        ))
        .byte(at));
    }
    let mut columns = Vec::with_capacity(3);
    for axis in header.axes {
        columns.push(Column::new(axis, header.points)?);
    }
    let mut place = 0_u64;
    lzf::unpack(source, packed, |piece| {
        columns.iter_mut().for_each(|column| column.take(place, piece));
        place += piece.len() as u64;
        match place > whole {
            true => Err(DataError::new("the compressed points are more than the header promises").byte(at)),
            false => Ok(()),
        }
    })?;
    let found = columns.iter().map(Column::len).min().unwrap_or(0) as u64;
    if place != whole || found < header.points {
        return Err(ends_early(found, header.points, source.offset()));
    }
    let single = header.axes.iter().all(|axis| axis.scalar == Scalar::F32);
    for i in 0..found as usize {
        match single {
            true => sink.single([columns[0].singles[i], columns[1].singles[i], columns[2].singles[i]])?,
            false => sink.double([columns[0].get(i), columns[1].get(i), columns[2].get(i)])?,
        }
    }
    Ok(())
}
