//! Reading flat Parquet files, whoever wrote them.

use std::cell::Cell;
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::file::metadata::ParquetMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};
use vice_core::budget::Budget;
use vice_core::error::{DataError, DataResult, ErrorKind};

use super::{Column, Values};

/// Values that are read at a time.
const BATCH: usize = 1 << 16;

/// All columns of a file.
///
/// # Errors
/// [`DataError`] with the path if it is no Parquet file, is damaged, or holds more than text and numbers.
pub fn read(path: &Path) -> DataResult<Vec<Column>> {
    let file = File::open(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file").at(path),
        _ => DataError::new("cannot be read").at(path).because(e),
    })?;
    // What a damaged file claims may end in a panic of the library.
    let found = catch_unwind(AssertUnwindSafe(|| columns(file)));
    let broken = || DataError::of_kind(ErrorKind::Corrupt, "is no Parquet file, or a damaged one").at(path);
    match found {
        Ok(Ok(columns)) => Ok(columns),
        Ok(Err(ParquetError::External(error))) => match error.downcast::<DataError>() {
            Ok(error) => Err(error.at(path)),
            Err(error) => Err(broken().because(error)),
        },
        Ok(Err(error)) => Err(broken().because(error)),
        Err(_) => Err(broken()),
    }
}

fn columns(file: File) -> Result<Vec<Column>, ParquetError> {
    let bytes = file.metadata()?.len();
    let reader = SerializedFileReader::new(file)?;
    let metadata = reader.metadata();
    let mut columns: Vec<Column> = Vec::new();
    for described in metadata.file_metadata().schema_descr().columns() {
        if described.max_rep_level() > 0 || described.path().parts().len() != 1 {
            let problem = format!("the column {} is a list or a table", described.path());
            return Err(ParquetError::NYI(problem));
        }
        let none = match described.physical_type() {
            parquet::basic::Type::BYTE_ARRAY => Values::Text(vec![]),
            parquet::basic::Type::FLOAT | parquet::basic::Type::DOUBLE => Values::Numbers(vec![]),
            parquet::basic::Type::INT32 | parquet::basic::Type::INT64 | parquet::basic::Type::BOOLEAN => {
                Values::Counts(vec![])
            }
            other => {
                return Err(ParquetError::NYI(format!("the column {} is of type {other}", described.path())));
            }
        };
        columns.push((described.name().to_string(), none));
    }
    check_counts(metadata, bytes)?;
    let budget = Budget::in_use();
    let usual_text = FREE_TEXT_BYTES.max(bytes.saturating_mul(MOST_TEXT_TIMES));
    let text_bytes = Cell::new(0_u64);
    let text = |b: &ByteArray| {
        text_bytes.set(text_bytes.get() + b.len() as u64);
        // What is too much is counted to its end and not held.
        let held = text_bytes.get() <= budget.most(usual_text);
        std::str::from_utf8(b.data()).ok().filter(|_| held).map(Arc::from)
    };
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        for (index, (_, values)) in columns.iter_mut().enumerate() {
            let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(usize::MAX);
            match (group.get_column_reader(index)?, values) {
                (ColumnReader::ByteArrayColumnReader(r), Values::Text(into)) => {
                    append(r, rows, into, text)?;
                    budget.check(text_bytes.get(), "bytes of text", usual_text).map_err(external)?;
                }
                (ColumnReader::DoubleColumnReader(r), Values::Numbers(into)) => {
                    append(r, rows, into, |v| Some(*v))?;
                }
                (ColumnReader::FloatColumnReader(r), Values::Numbers(into)) => {
                    append(r, rows, into, |v| Some(f64::from(*v)))?;
                }
                (ColumnReader::Int64ColumnReader(r), Values::Counts(into)) => {
                    append(r, rows, into, |v| Some(*v))?;
                }
                (ColumnReader::Int32ColumnReader(r), Values::Counts(into)) => {
                    append(r, rows, into, |v| Some(i64::from(*v)))?;
                }
                (ColumnReader::BoolColumnReader(r), Values::Counts(into)) => {
                    append(r, rows, into, |v| Some(i64::from(*v)))?;
                }
                _ => return Err(ParquetError::General("a column changes its type".to_string())),
            }
        }
    }
    Ok(columns)
}

/// Rows that any file may hold, and most that a byte of a larger one may stand for: run-length encoding needs no bytes
/// of its own for a row.
const FREE_ROWS: u64 = 1 << 20;
const MOST_ROWS_PER_BYTE: u64 = 64;
/// Bytes of text that any file may hold, and how many times its size those of a larger one may be: a dictionary holds
/// each text once.
const FREE_TEXT_BYTES: u64 = 64 << 20;
const MOST_TEXT_TIMES: u64 = 64;

/// Holds the number of rows against the size of the file.
fn check_counts(metadata: &ParquetMetaData, bytes: u64) -> Result<(), ParquetError> {
    let rows = metadata.row_groups().iter().fold(0_u64, |sum, group| {
        // A negative number is none.
        sum.saturating_add(u64::try_from(group.num_rows()).unwrap_or(u64::MAX))
    });
    let usual = FREE_ROWS.max(bytes.saturating_mul(MOST_ROWS_PER_BYTE));
    Budget::in_use().check(rows, &format!("rows in {bytes} bytes"), usual).map_err(external)
}

fn external(error: DataError) -> ParquetError {
    ParquetError::External(Box::new(error))
}

fn append<T: DataType, V>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    into: &mut Vec<Option<V>>,
    value: impl Fn(&T::T) -> Option<V>,
) -> Result<(), ParquetError> {
    let wanted = into.len() + rows;
    while into.len() < wanted {
        let (mut there, mut levels) = (Vec::new(), Vec::new());
        let most = BATCH.min(wanted - into.len());
        let (records, values, _) = reader.read_records(most, Some(&mut levels), None, &mut there)?;
        if records == 0 {
            return Err(ParquetError::EOF("fewer rows than the file says".to_string()));
        }
        let mut there = there.iter();
        if levels.is_empty() {
            // A column without missing values.
            into.extend(there.by_ref().take(values).map(&value));
            continue;
        }
        for level in levels {
            into.push(if level > 0 { there.next().and_then(&value) } else { None });
        }
    }
    Ok(())
}
