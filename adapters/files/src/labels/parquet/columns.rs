//! Columns of a row group as numbers, flags and names, whatever types they are stored as.

use std::sync::Arc;

use parquet::basic::{ConvertedType, Encoding, LogicalType, TimeUnit as Ticks, Type as Physical};
use parquet::column::page::{Page, PageReader};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl, get_column_reader};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::reader::SerializedPageReader;
use parquet::schema::types::ColumnDescPtr;
use vice_core::error::{DataError, DataResult, ErrorKind};

use super::source::{Part, Source};
use crate::columns::TimeUnit;

/// Values that are read at a time: no more memory is taken than for so many beyond those that are there.
const BATCH: usize = 1 << 16;

/// What a column is stored as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stored {
    Text,
    Real,
    Whole,
    Flag,
}

/// A column that is read.
#[derive(Clone)]
pub(super) struct Column {
    index: usize,
    pub(super) name: String,
    pub(super) stored: Stored,
    /// The unit of a column of time stamps.
    pub(super) ticks: Option<TimeUnit>,
    described: ColumnDescPtr,
}

impl Column {
    /// The column at a place, if it is of one of some types.
    pub(super) fn new(index: usize, described: ColumnDescPtr, allowed: &[Stored]) -> DataResult<Self> {
        let name = described.path().string();
        let unsupported = |what: String| {
            Err(DataError::of_kind(ErrorKind::Unsupported, format!("the column {name} {what}")))
        };
        if described.max_rep_level() > 0 {
            return unsupported("holds lists".to_string());
        }
        let stored = match described.physical_type() {
            Physical::BYTE_ARRAY => Stored::Text,
            Physical::FLOAT | Physical::DOUBLE => Stored::Real,
            Physical::INT32 | Physical::INT64 => Stored::Whole,
            Physical::BOOLEAN => Stored::Flag,
            other => return unsupported(format!("is of the type {other}, which is not read")),
        };
        let ticks = match described.logical_type_ref() {
            Some(LogicalType::Timestamp(stamps)) => Some(match stamps.unit {
                Ticks::MILLIS => TimeUnit::Millis,
                Ticks::MICROS => TimeUnit::Micros,
                Ticks::NANOS => TimeUnit::Nanos,
            }),
            Some(LogicalType::Decimal(_)) => return unsupported("holds decimals".to_string()),
            // As older programs say it.
            _ => match described.converted_type() {
                ConvertedType::TIMESTAMP_MILLIS => Some(TimeUnit::Millis),
                ConvertedType::TIMESTAMP_MICROS => Some(TimeUnit::Micros),
                ConvertedType::DECIMAL => return unsupported("holds decimals".to_string()),
                _ => None,
            },
        };
        if !allowed.contains(&stored) {
            let what = |s: &Stored| match s {
                Stored::Text => "text",
                Stored::Real => "numbers",
                Stored::Whole => "whole numbers",
                Stored::Flag => "yes or no",
            };
            let allowed: Vec<&str> = allowed.iter().map(what).collect();
            return unsupported(format!("holds {}, not {}", what(&stored), allowed.join(" or ")));
        }
        Ok(Self { index, name, stored, ticks, described })
    }

    /// Its pages in a row group.
    fn pages(&self, source: &Source, group: &RowGroupMetaData, rows: usize) -> Result<Box<dyn PageReader>> {
        let chunk = group.column(self.index);
        if usize::try_from(chunk.num_values()) != Ok(rows) {
            let problem = format!("{} has {} values for {rows} rows", self.name, chunk.num_values());
            return Err(ParquetError::General(problem));
        }
        let (start, length) = chunk.byte_range();
        let part = Part { start, bytes: source.read(start, length)? };
        Ok(Box::new(SerializedPageReader::new(Arc::new(part), chunk, rows, None)?))
    }

    fn reader(&self, source: &Source, group: &RowGroupMetaData, rows: usize) -> Result<ColumnReader> {
        Ok(get_column_reader(self.described.clone(), self.pages(source, group, rows)?))
    }

    fn present(&self) -> i16 {
        self.described.max_def_level()
    }

    /// Numbers; NaN where there is none.
    pub(super) fn reals(&self, source: &Source, group: &RowGroupMetaData, rows: usize) -> Result<Vec<f64>> {
        Ok(match self.reader(source, group, rows)? {
            ColumnReader::DoubleColumnReader(r) => dense(r, rows, self.present(), &f64::NAN)?,
            ColumnReader::FloatColumnReader(r) => {
                dense(r, rows, self.present(), &f32::NAN)?.into_iter().map(f64::from).collect()
            }
            ColumnReader::Int32ColumnReader(r) => {
                expand(r, rows, self.present(), |v| v.map_or(f64::NAN, |v| f64::from(*v)))?
            }
            ColumnReader::Int64ColumnReader(r) => {
                expand(r, rows, self.present(), |v| v.map_or(f64::NAN, |v| *v as f64))?
            }
            _ => return Err(changed(&self.name)),
        })
    }

    /// Whole numbers; `missing` where there is none.
    pub(super) fn wholes(
        &self,
        source: &Source,
        group: &RowGroupMetaData,
        rows: usize,
        missing: i64,
    ) -> Result<Vec<i64>> {
        Ok(match self.reader(source, group, rows)? {
            ColumnReader::Int64ColumnReader(r) => dense(r, rows, self.present(), &missing)?,
            ColumnReader::Int32ColumnReader(r) => {
                expand(r, rows, self.present(), |v| v.map_or(missing, |v| i64::from(*v)))?
            }
            _ => return Err(changed(&self.name)),
        })
    }

    /// Yes or no, also as 1 and 0; `None` where it is neither, with the row.
    pub(super) fn flags(
        &self,
        source: &Source,
        group: &RowGroupMetaData,
        rows: usize,
        missing: Option<bool>,
    ) -> Result<std::result::Result<Vec<bool>, usize>> {
        let whole = |v: i64| match v {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        };
        let found: Vec<Option<bool>> = match self.reader(source, group, rows)? {
            ColumnReader::BoolColumnReader(r) if self.present() == 0 => {
                return Ok(Ok(dense(r, rows, 0, &false)?));
            }
            ColumnReader::BoolColumnReader(r) => {
                expand(r, rows, self.present(), |v| v.map_or(missing, |v| Some(*v)))?
            }
            ColumnReader::Int32ColumnReader(r) => {
                expand(r, rows, self.present(), |v| v.map_or(missing, |v| whole(i64::from(*v))))?
            }
            ColumnReader::Int64ColumnReader(r) => {
                expand(r, rows, self.present(), |v| v.map_or(missing, |v| whole(*v)))?
            }
            _ => return Err(changed(&self.name)),
        };
        Ok(match found.iter().position(Option::is_none) {
            Some(row) => Err(row),
            None => Ok(found.into_iter().flatten().collect()),
        })
    }

    /// Texts, and whole numbers as text; empty where there is none.
    pub(super) fn texts(&self, source: &Source, group: &RowGroupMetaData, rows: usize) -> Result<Texts> {
        if self.stored == Stored::Text
            && self.present() == 0
            && let Some(only) = only_text(&mut *self.pages(source, group, rows)?, rows)?
        {
            return Ok(Texts::One(only));
        }
        Ok(Texts::Each(match self.reader(source, group, rows)? {
            ColumnReader::ByteArrayColumnReader(r) => {
                dense(r, rows, self.present(), &ByteArray::from(Vec::new()))?
            }
            ColumnReader::Int32ColumnReader(r) => expand(r, rows, self.present(), number_text)?,
            ColumnReader::Int64ColumnReader(r) => expand(r, rows, self.present(), number_text)?,
            _ => return Err(changed(&self.name)),
        }))
    }
}

fn number_text<T: ToString>(value: Option<&T>) -> ByteArray {
    ByteArray::from(value.map_or_else(String::new, ToString::to_string).into_bytes())
}

fn changed(name: &str) -> ParquetError {
    ParquetError::General(format!("the column {name} changes its type"))
}

/// Texts of the rows of a group.
pub(super) enum Texts {
    /// All are the same.
    One(String),
    Each(Vec<ByteArray>),
}

/// The text that all rows of a column have, where its dictionary holds no other.
fn only_text(pages: &mut dyn PageReader, rows: usize) -> Result<Option<String>> {
    let Some(Page::DictionaryPage { buf, num_values: 1, .. }) = pages.get_next_page()? else {
        return Ok(None);
    };
    let text = match buf.split_first_chunk::<4>() {
        Some((length, text)) if u32::from_le_bytes(*length) as usize == text.len() => text,
        _ => return Ok(None),
    };
    let Ok(text) = std::str::from_utf8(text) else { return Ok(None) };
    let mut seen = 0;
    while let Some(page) = pages.get_next_page()? {
        let by_dictionary = matches!(page.encoding(), Encoding::RLE_DICTIONARY | Encoding::PLAIN_DICTIONARY);
        if !by_dictionary {
            return Ok(None);
        }
        seen += page.num_values() as usize;
    }
    Ok((seen == rows).then(|| text.to_string()))
}

/// All values of a column, `missing` where there is none.
fn dense<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    present: i16,
    missing: &T::T,
) -> Result<Vec<T::T>> {
    if present > 0 {
        return expand(reader, rows, present, |v| v.unwrap_or(missing).clone());
    }
    let mut values = Vec::new();
    while values.len() < rows {
        let most = BATCH.min(rows - values.len());
        if reader.read_records(most, None, None, &mut values)?.0 == 0 {
            return Err(fewer());
        }
    }
    Ok(values)
}

/// The same, with what is made of each.
fn expand<T: DataType, V>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    present: i16,
    value: impl Fn(Option<&T::T>) -> V,
) -> Result<Vec<V>> {
    let mut all = Vec::new();
    while all.len() < rows {
        let (mut there, mut levels) = (Vec::new(), Vec::new());
        let most = BATCH.min(rows - all.len());
        let (records, _, _) = reader.read_records(most, Some(&mut levels), None, &mut there)?;
        if records == 0 {
            return Err(fewer());
        }
        if present == 0 {
            all.extend(there.iter().map(|v| value(Some(v))));
            continue;
        }
        let mut there = there.iter();
        for level in levels {
            let is_there = level == present;
            all.push(value(if is_there { there.next() } else { None }));
        }
    }
    Ok(all)
}

fn fewer() -> ParquetError {
    ParquetError::EOF("fewer rows than the file says".to_string())
}
