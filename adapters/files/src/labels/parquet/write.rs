//! Writing labels as Parquet, with fixed settings: the same labels are the same bytes everywhere.

use std::io::Write;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{ColumnPath, Type};
use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelSet, Observation, ObservationList};

use super::{CAMERA, DATASET, SCHEMA};
use crate::atomic::{self, Overwrite};
use crate::labels::LABELS_SCHEMA;
use crate::tables::{CREATED_BY, ZSTD_LEVEL};

/// A point of so many labels has row groups of its own; others share them until they are so many.
const GROUP_ROWS: usize = 1 << 14;
/// Most rows of a group.
const MOST_ROWS: usize = 1 << 20;

/// Labels of a row group, by point.
type Group<'a> = Vec<(&'a str, &'a ObservationList, Range<usize>)>;

/// Writes all of the labels or nothing.
///
/// # Errors
/// [`DataError`] if the file cannot be written or may not be replaced.
pub(in crate::labels) fn write_parquet(
    path: &Path,
    labels: &LabelSet,
    overwrite: Overwrite,
) -> DataResult<()> {
    let wrong = |e: ParquetError| DataError::new("cannot be written").at(path).because(e);
    let columns = Columns::of(labels);
    let (schema, settings) = (columns.schema().map_err(wrong)?, settings(labels).map_err(wrong)?);
    atomic::write_and_return(path, overwrite, |out: &mut (dyn Write + Send)| {
        let mut file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(settings)).map_err(wrong)?;
        for group in groups(labels) {
            let mut writer = file.next_row_group().map_err(wrong)?;
            columns.write(&mut writer, &group).map_err(wrong)?;
            writer.close().map_err(wrong)?;
        }
        file.finish().map_err(wrong)?;
        Ok(())
    })
}

fn groups(labels: &LabelSet) -> Vec<Group<'_>> {
    let mut groups: Vec<Group<'_>> = Vec::new();
    // Rows of the last group, as long as more may come to it.
    let mut open = None;
    for point in labels.points() {
        let (name, all, count) = (point.name.as_str(), &point.observations, point.observations.len());
        if count >= GROUP_ROWS {
            let parts = (0..count).step_by(MOST_ROWS).map(|from| from..count.min(from + MOST_ROWS));
            groups.extend(parts.map(|part| vec![(name, all, part)]));
            open = None;
            continue;
        }
        let rows = count + open.unwrap_or(0);
        match groups.last_mut().filter(|_| open.is_some()) {
            Some(group) => group.push((name, all, 0..count)),
            None => groups.push(vec![(name, all, 0..count)]),
        }
        open = (rows < GROUP_ROWS).then_some(rows);
    }
    groups
}

/// Which of the columns that few labels have are written.
struct Columns {
    confidence: bool,
    tracker_version: bool,
    seeded: bool,
}

impl Columns {
    fn of(labels: &LabelSet) -> Self {
        let any = |has: fn(&Observation) -> bool| {
            labels.points().iter().flat_map(|p| &p.observations).any(|o| has(&o))
        };
        Self {
            confidence: any(|o| o.provenance.confidence.is_some()),
            tracker_version: any(|o| o.provenance.tracker_version.is_some()),
            seeded: any(|o| o.provenance.seeded),
        }
    }

    fn schema(&self) -> Result<Type> {
        const REQUIRED: Repetition = Repetition::REQUIRED;
        const OPTIONAL: Repetition = Repetition::OPTIONAL;
        let mut fields = vec![
            field("point", Physical::BYTE_ARRAY, REQUIRED)?,
            field("timestamp_ns", Physical::INT64, REQUIRED)?,
            field("u_px", Physical::DOUBLE, REQUIRED)?,
            field("v_px", Physical::DOUBLE, REQUIRED)?,
            field("keyframe", Physical::BOOLEAN, REQUIRED)?,
            field("source", Physical::BYTE_ARRAY, REQUIRED)?,
            field("occluded", Physical::BOOLEAN, REQUIRED)?,
            field("uncertain", Physical::BOOLEAN, REQUIRED)?,
        ];
        if self.confidence {
            fields.push(field("confidence", Physical::DOUBLE, OPTIONAL)?);
        }
        if self.tracker_version {
            fields.push(field("tracker_version", Physical::INT64, OPTIONAL)?);
        }
        if self.seeded {
            fields.push(field("seeded", Physical::BOOLEAN, REQUIRED)?);
        }
        Type::group_type_builder("labels").with_fields(fields).build()
    }

    fn write<W: Write + Send>(
        &self,
        writer: &mut SerializedRowGroupWriter<'_, W>,
        group: &Group<'_>,
    ) -> Result<()> {
        let points = group.iter().flat_map(|(name, _, part)| {
            let name = ByteArray::from(name.as_bytes().to_vec());
            std::iter::repeat_n(name, part.len())
        });
        let all = || group.iter().flat_map(|(_, all, part)| all.some(part.clone()));
        column::<ByteArrayType, _>(writer, points)?;
        column::<Int64Type, _>(writer, all().map(|o| o.stamp.as_nanos()))?;
        column::<DoubleType, _>(writer, all().map(|o| o.px.u))?;
        column::<DoubleType, _>(writer, all().map(|o| o.px.v))?;
        column::<BoolType, _>(writer, all().map(|o| o.keyframe))?;
        column::<ByteArrayType, _>(writer, all().map(|o| ByteArray::from(o.source.name())))?;
        column::<BoolType, _>(writer, all().map(|o| o.occluded))?;
        column::<BoolType, _>(writer, all().map(|o| o.uncertain))?;
        if self.confidence {
            optional::<DoubleType, _>(writer, all().map(|o| o.provenance.confidence))?;
        }
        if self.tracker_version {
            optional::<Int64Type, _>(writer, all().map(|o| o.provenance.tracker_version.map(i64::from)))?;
        }
        if self.seeded {
            column::<BoolType, _>(writer, all().map(|o| o.provenance.seeded))?;
        }
        Ok(())
    }
}

fn field(name: &str, physical: Physical, repetition: Repetition) -> Result<Arc<Type>> {
    let logical = (physical == Physical::BYTE_ARRAY).then_some(LogicalType::String);
    let builder = Type::primitive_type_builder(name, physical).with_repetition(repetition);
    Ok(Arc::new(builder.with_logical_type(logical).build()?))
}

fn settings(labels: &LabelSet) -> Result<WriterProperties> {
    let said = [(DATASET, &labels.dataset), (CAMERA, &labels.camera)];
    let said = said.into_iter().filter_map(|(key, value)| Some((key, value.clone()?)));
    let said = std::iter::once((SCHEMA, LABELS_SCHEMA.to_string())).chain(said);
    let said = said.map(|(key, value)| KeyValue::new(key.to_string(), value));
    let mut settings = WriterProperties::builder()
        .set_created_by(CREATED_BY.to_string())
        .set_key_value_metadata(Some(said.collect()))
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(ZSTD_LEVEL)?))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_dictionary_enabled(true)
        .set_data_page_row_count_limit(MOST_ROWS)
        .set_max_row_group_row_count(Some(MOST_ROWS));
    for (name, encoding) in [
        ("timestamp_ns", Encoding::DELTA_BINARY_PACKED),
        ("u_px", Encoding::PLAIN),
        ("v_px", Encoding::PLAIN),
        ("confidence", Encoding::PLAIN),
        ("tracker_version", Encoding::DELTA_BINARY_PACKED),
    ] {
        let path = ColumnPath::from(name);
        settings =
            settings.set_column_dictionary_enabled(path.clone(), false).set_column_encoding(path, encoding);
    }
    for name in ["u_px", "v_px"] {
        settings = settings.set_column_compression(ColumnPath::from(name), Compression::UNCOMPRESSED);
    }
    Ok(settings.build())
}

fn column<T: DataType, W: Write + Send>(
    writer: &mut SerializedRowGroupWriter<'_, W>,
    values: impl Iterator<Item = T::T>,
) -> Result<()> {
    write_values::<T, W>(writer, &values.collect::<Vec<_>>(), None)
}

fn optional<T: DataType, W: Write + Send>(
    writer: &mut SerializedRowGroupWriter<'_, W>,
    values: impl Iterator<Item = Option<T::T>>,
) -> Result<()> {
    let values: Vec<Option<T::T>> = values.collect();
    let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
    let there: Vec<T::T> = values.into_iter().flatten().collect();
    write_values::<T, W>(writer, &there, Some(&levels))
}

fn write_values<T: DataType, W: Write + Send>(
    writer: &mut SerializedRowGroupWriter<'_, W>,
    values: &[T::T],
    levels: Option<&[i16]>,
) -> Result<()> {
    let missing = || ParquetError::General("a column more than the file has".to_string());
    let mut column = writer.next_column()?.ok_or_else(missing)?;
    column.typed::<T>().write_batch(values, levels, None)?;
    column.close()
}
