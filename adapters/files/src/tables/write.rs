//! Writing Parquet: with fixed settings, so that the same table is the same bytes everywhere.

use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};
use vice_core::error::DataError;

use super::{Column, Values};
use crate::atomic::{self, Overwrite};

/// The file says who made it, and not which version of the library.
pub(crate) const CREATED_BY: &str = "vice";
pub(crate) const ZSTD_LEVEL: i32 = 3;

/// Takes rows: the columns of the heading again, all of one length.
pub type Rows<'a> = dyn FnMut(&[Column]) -> io::Result<()> + 'a;

/// Writes a file with columns of these names and kinds, of the rows that `fill` hands over. If that fails there is no
/// file.
///
/// # Errors
/// That of `fill`, or [`DataError`] with the path if it cannot be written.
pub fn write<T, E: From<DataError>>(
    path: &Path,
    heading: &[Column],
    fill: impl FnOnce(&mut Rows<'_>) -> Result<T, E>,
) -> Result<T, E> {
    let wrong = |e: ParquetError| DataError::new("cannot be written").at(path).because(e);
    let schema = schema(heading).map_err(wrong)?;
    let settings = settings(heading).map_err(wrong)?;
    atomic::write_and_return(path, Overwrite::Replace, |out| {
        let mut file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(settings)).map_err(wrong)?;
        let value = fill(&mut |columns| {
            if columns.iter().all(|(_, values)| values.is_empty()) {
                return Ok(());
            }
            row_group(&mut file, columns).map_err(io::Error::other)
        })?;
        file.finish().map_err(wrong)?;
        Ok(value)
    })
}

fn row_group<W: Write + Send>(
    file: &mut SerializedFileWriter<W>,
    columns: &[Column],
) -> Result<(), ParquetError> {
    let mut group = file.next_row_group()?;
    for (_, values) in columns {
        let mut column = group
            .next_column()?
            .ok_or_else(|| ParquetError::General("a column more than the file has".to_string()))?;
        match values {
            Values::Text(values) => {
                let bytes = |text: &Arc<str>| ByteArray::from(text.as_bytes().to_vec());
                write_values::<ByteArrayType, _>(column.typed(), values, bytes)?;
            }
            Values::Numbers(values) => write_values::<DoubleType, _>(column.typed(), values, |v| *v)?,
            Values::Counts(values) => write_values::<Int64Type, _>(column.typed(), values, |v| *v)?,
        }
        column.close()?;
    }
    group.close()?;
    Ok(())
}

fn schema(heading: &[Column]) -> Result<Type, ParquetError> {
    let fields = heading.iter().map(|(name, values)| field(name, values)).collect::<Result<_, _>>()?;
    Type::group_type_builder("vice").with_fields(fields).build()
}

fn field(name: &str, values: &Values) -> Result<Arc<Type>, ParquetError> {
    let physical = match values {
        Values::Text(_) => Physical::BYTE_ARRAY,
        Values::Numbers(_) => Physical::DOUBLE,
        Values::Counts(_) => Physical::INT64,
    };
    let logical = matches!(values, Values::Text(_)).then_some(LogicalType::String);
    let builder = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
    Ok(Arc::new(builder.with_logical_type(logical).build()?))
}

fn settings(columns: &[Column]) -> Result<WriterProperties, ParquetError> {
    let mut settings = WriterProperties::builder()
        .set_created_by(CREATED_BY.to_string())
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(ZSTD_LEVEL)?))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_dictionary_enabled(true);
    for (name, values) in columns {
        let encoding = match values {
            Values::Text(_) => continue,
            // Bytes of doubles in turn: the first ones are much alike, the last ones are not.
            Values::Numbers(_) => Encoding::BYTE_STREAM_SPLIT,
            Values::Counts(_) => Encoding::DELTA_BINARY_PACKED,
        };
        let path = ColumnPath::from(name.as_str());
        settings =
            settings.set_column_dictionary_enabled(path.clone(), false).set_column_encoding(path, encoding);
    }
    Ok(settings.build())
}

fn write_values<T: DataType, V>(
    column: &mut parquet::column::writer::ColumnWriterImpl<'_, T>,
    values: &[Option<V>],
    value: impl Fn(&V) -> T::T,
) -> Result<(), ParquetError> {
    let there: Vec<T::T> = values.iter().flatten().map(value).collect();
    let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
    column.write_batch(&there, Some(&levels), None)?;
    Ok(())
}
