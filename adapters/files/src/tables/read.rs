//! Reading flat Parquet files, whoever wrote them.

use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
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
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group)?;
        for (index, (_, values)) in columns.iter_mut().enumerate() {
            // A file of a few bytes can claim any number of rows: run-length encoding needs none of its own.
            let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(usize::MAX);
            let most = usize::try_from(bytes).unwrap_or(usize::MAX).saturating_mul(MOST_ROWS_PER_BYTE);
            if rows > most {
                return Err(ParquetError::General(format!("{bytes} bytes claim to hold {rows} rows")));
            }
            match (group.get_column_reader(index)?, values) {
                (ColumnReader::ByteArrayColumnReader(r), Values::Text(into)) => {
                    append(r, rows, into, |b: &ByteArray| std::str::from_utf8(b.data()).ok().map(Arc::from))?;
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

/// Most rows that a byte of a file may stand for before it is taken for a bomb.
const MOST_ROWS_PER_BYTE: usize = 10_000;

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
