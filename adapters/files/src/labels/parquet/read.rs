//! Reading labels from Parquet, whoever wrote it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader, RowGroupMetaData};
use rayon::prelude::*;
use vice_core::budget::Budget;
use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::label::{Marks, Observation, ObservationList, ObservationSource, Provenance};
use vice_core::time::Stamp;

use super::columns::{Column, Stored, Texts};
use super::source::Source;
use super::{CAMERA, DATASET, SCHEMA};
use crate::columns::TimeUnit;
use crate::labels::by_camera::ByCamera;
use crate::labels::csv_columns;
use crate::labels::csv_file::{OCCLUDED, UNCERTAIN};
use crate::labels::json_file::check_schema;
use crate::labels::{LabelFile, label_error, no_labels};
use crate::leniency::Leniency;

/// Row groups that are decoded before their labels are taken: enough for all threads, few enough for the memory.
const GROUPS_AT_A_TIME: usize = 16;
/// Rows that any file may hold, and most that a byte of a larger one may stand for: no two labels are the same.
const FREE_ROWS: u64 = 1 << 20;
const MOST_ROWS_PER_BYTE: u64 = 8;
/// Stands for no version of a tracker.
const NO_VERSION: i64 = -1;
/// Stands for no stamp.
const NO_STAMP: i64 = i64::MIN;
/// What data frames call the number of a row.
const ROW_NUMBER: &str = "__index_level_0__";

/// Reads labels, or those of the named points only.
///
/// # Errors
/// [`DataError`] if it is no Parquet file, is damaged, lacks a column or has one of another type, and with the row where a
/// label cannot be one.
pub(in crate::labels) fn read_parquet(path: &Path, wanted: Option<&[String]>) -> DataResult<LabelFile> {
    read_source(&Source::open(path)?, wanted)
}

/// The same of a file in memory.
pub(in crate::labels) fn read_parquet_bytes(bytes: &[u8]) -> DataResult<LabelFile> {
    read_source(&Source::of_bytes(bytes), None)
}

fn read_source(source: &Source, wanted: Option<&[String]>) -> DataResult<LabelFile> {
    let metadata = guarded(|| ParquetMetaDataReader::new().parse_and_finish(source))?;
    let file = metadata.file_metadata();
    let said = |key: &str| {
        let pairs = file.key_value_metadata()?;
        pairs.iter().find(|pair| pair.key == key)?.value.clone()
    };
    if let Some(schema) = said(SCHEMA) {
        check_schema(Some(&schema))?;
    }
    let rows = check_counts(&metadata, source)?;
    let (table, unknown) = Table::find(&metadata)?;
    let mut into = Into {
        labels: ByCamera::default(),
        camera: said(CAMERA).unwrap_or_default(),
        lenient: Leniency::new(),
        kept: 0,
        row: 0,
        unit: table.unit,
        wanted,
    };
    let groups = metadata.row_groups();
    for some in groups.chunks(GROUPS_AT_A_TIME) {
        let decoded: Vec<DataResult<Group>> =
            some.par_iter().map(|group| guarded(|| table.group(source, group, wanted))).collect();
        for group in decoded {
            into.take(&table, group?)?;
        }
    }
    if rows == 0 {
        return Err(no_labels());
    }
    into.lenient.check(into.kept, "pixel")?;
    let mut read = into.labels.finish(label_error)?;
    for labels in std::iter::once(&mut read.labels).chain(&mut read.of_other_cameras) {
        labels.dataset = said(DATASET);
    }
    read.suspicions = into.lenient.suspicions("");
    read.suspicions.extend(unknown.unknown_said());
    Ok(read)
}

/// What the library makes of a file, whose damage may end in a panic of the library.
fn guarded<T>(read: impl FnOnce() -> Result<T>) -> DataResult<T> {
    let broken = || DataError::of_kind(ErrorKind::Corrupt, "is no Parquet file, or a damaged one");
    match catch_unwind(AssertUnwindSafe(read)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(ParquetError::External(error))) => match error.downcast::<DataError>() {
            Ok(error) => Err(*error),
            Err(error) => Err(broken().because(error)),
        },
        Ok(Err(error)) => Err(broken().because(error)),
        Err(_) => Err(broken()),
    }
}

/// The number of rows, where all that say it agree and the file can hold them.
fn check_counts(metadata: &ParquetMetaData, source: &Source) -> DataResult<u64> {
    use parquet::file::reader::Length;
    let corrupt = |problem: String| DataError::of_kind(ErrorKind::Corrupt, problem);
    let said = metadata.file_metadata().num_rows();
    let mut rows = 0_u64;
    for group in metadata.row_groups() {
        let of_group = u64::try_from(group.num_rows())
            .map_err(|_| corrupt(format!("a row group says that it has {} rows", group.num_rows())))?;
        rows = rows.saturating_add(of_group);
    }
    if u64::try_from(said) != Ok(rows) {
        return Err(corrupt(format!("the file says that it has {said} rows, its row groups say {rows}")));
    }
    let usual = FREE_ROWS.max(source.len().saturating_mul(MOST_ROWS_PER_BYTE));
    Budget::in_use().check(rows, &format!("labels in {} bytes", source.len()), usual)?;
    Ok(rows)
}

/// Which columns hold what.
struct Table {
    point: Column,
    stamp: Column,
    /// `None` until the first row shows it.
    unit: Option<TimeUnit>,
    u_px: Column,
    v_px: Column,
    keyframe: Column,
    source: Option<Column>,
    flags: Option<Column>,
    camera: Option<Column>,
    occluded: Option<Column>,
    uncertain: Option<Column>,
    confidence: Option<Column>,
    tracker_version: Option<Column>,
    seeded: Option<Column>,
}

impl Table {
    /// By the names of the columns, as those of CSV.
    fn find(metadata: &ParquetMetaData) -> DataResult<(Self, csv_columns::Columns)> {
        use Stored::{Flag, Real, Text, Whole};
        let described = metadata.file_metadata().schema_descr().columns();
        let names: Vec<String> = described.iter().map(|c| c.path().string()).collect();
        if let Some(name) = names.iter().enumerate().find(|(i, n)| names[..*i].contains(n)) {
            return Err(DataError::new(format!("the column {} appears twice", name.1)));
        }
        let mut found = csv_columns::Columns::find(names.iter().map(String::as_str))?;
        let column = |index: usize, allowed: &[Stored]| Column::new(index, described[index].clone(), allowed);
        let other =
            |index: Option<usize>, allowed: &[Stored]| index.map(|index| column(index, allowed)).transpose();
        let unknown = &mut found.unknown;
        unknown.retain(|name| name != ROW_NUMBER);
        let mut named = |name: &str, allowed: &[Stored]| {
            unknown.retain(|n| n != name);
            other(names.iter().position(|n| n == name), allowed)
        };
        let (occluded, uncertain) = (named("occluded", &[Flag, Whole])?, named("uncertain", &[Flag, Whole])?);
        let confidence = named("confidence", &[Real, Whole])?;
        let tracker_version = named("tracker_version", &[Whole])?;
        let seeded = named("seeded", &[Flag, Whole])?;
        let stamp = column(found.timestamp, &[Whole]).map_err(|error| {
            error.hint("stamps are whole numbers: a double cannot hold a nanosecond of today")
        })?;
        let table = Self {
            point: column(found.point, &[Text, Whole])?,
            unit: stamp.ticks.or(found.unit()),
            stamp,
            u_px: column(found.u_px, &[Real, Whole])?,
            v_px: column(found.v_px, &[Real, Whole])?,
            keyframe: column(found.keyframe, &[Flag, Whole])?,
            source: other(found.source, &[Text])?,
            flags: other(found.flags, &[Text])?,
            camera: other(found.camera, &[Text])?,
            occluded,
            uncertain,
            confidence,
            tracker_version,
            seeded,
        };
        Ok((table, found))
    }

    /// A row group as columns; without all but its length where it holds none of the wanted points.
    fn group(&self, source: &Source, group: &RowGroupMetaData, wanted: Option<&[String]>) -> Result<Group> {
        let rows = usize::try_from(group.num_rows()).unwrap_or(usize::MAX);
        if rows == 0 {
            return Ok(Group::default());
        }
        let points = self.point.texts(source, group, rows)?;
        if let (Texts::One(name), Some(wanted)) = (&points, wanted)
            && !wanted.contains(name)
        {
            return Ok(Group { rows, ..Group::default() });
        }
        let texts =
            |column: &Option<Column>| column.as_ref().map(|c| c.texts(source, group, rows)).transpose();
        let mut wrong = None;
        let mut flags = |column: &Column, missing: Option<bool>| -> Result<Vec<bool>> {
            let found = column.flags(source, group, rows, missing)?;
            Ok(found.unwrap_or_else(|row| {
                wrong.get_or_insert((row, column.name.clone()));
                Vec::new()
            }))
        };
        let keyframe = flags(&self.keyframe, None)?;
        let mut marks = |column: &Option<Column>| column.as_ref().map(|c| flags(c, Some(false))).transpose();
        let (occluded, uncertain) = (marks(&self.occluded)?, marks(&self.uncertain)?);
        let seeded = marks(&self.seeded)?;
        let version = |c: &Column| c.wholes(source, group, rows, NO_VERSION);
        let group = Group {
            rows,
            points: Some(points),
            stamps: self.stamp.wholes(source, group, rows, NO_STAMP)?,
            u_px: self.u_px.reals(source, group, rows)?,
            v_px: self.v_px.reals(source, group, rows)?,
            keyframe,
            sources: texts(&self.source)?,
            flags: texts(&self.flags)?,
            cameras: texts(&self.camera)?,
            occluded,
            uncertain,
            confidence: self.confidence.as_ref().map(|c| c.reals(source, group, rows)).transpose()?,
            tracker_version: self.tracker_version.as_ref().map(version).transpose()?,
            seeded,
            wrong,
            plain: None,
        };
        Ok(if self.unit == Some(TimeUnit::Nanos) { group.into_plain() } else { group })
    }
}

/// The columns of a row group.
#[derive(Default)]
struct Group {
    rows: usize,
    points: Option<Texts>,
    stamps: Vec<i64>,
    u_px: Vec<f64>,
    v_px: Vec<f64>,
    keyframe: Vec<bool>,
    sources: Option<Texts>,
    flags: Option<Texts>,
    cameras: Option<Texts>,
    occluded: Option<Vec<bool>>,
    uncertain: Option<Vec<bool>>,
    confidence: Option<Vec<f64>>,
    tracker_version: Option<Vec<i64>>,
    seeded: Option<Vec<bool>>,
    /// A row whose value is neither yes nor no, and its column.
    wrong: Option<(usize, String)>,
    /// The labels of the one point that it holds, where there is nothing to be said of any of them.
    plain: Option<(String, ObservationList)>,
}

impl Group {
    /// With its columns as the labels of one point, where they are that and nothing in them asks for a closer look.
    fn into_plain(mut self) -> Self {
        let Some(Texts::One(name)) = &self.points else { return self };
        let no_flags = self.flags.as_ref().is_none_or(|f| matches!(f, Texts::One(text) if text.is_empty()));
        let source = match &self.sources {
            None => Some(ObservationSource::default()),
            Some(Texts::One(name)) => ObservationSource::from_name(name),
            Some(Texts::Each(_)) => None,
        };
        let is_finite = |all: &[f64]| all.iter().all(|v| v.is_finite());
        let plain = self.wrong.is_none()
            && no_flags
            && !name.is_empty()
            && self.cameras.as_ref().is_none_or(|c| matches!(c, Texts::One(_)))
            && self.confidence.is_none()
            && self.tracker_version.is_none()
            && is_finite(&self.u_px)
            && is_finite(&self.v_px)
            && !self.stamps.contains(&NO_STAMP);
        let Some(source) = source.filter(|_| plain) else { return self };
        let name = name.clone();
        let mut each =
            Observation { source, ..Observation::manual(Stamp::from_nanos(0), Pixel::new(0.0, 0.0)) };
        let is = |marks: &Option<Vec<bool>>, row: usize| marks.as_ref().is_some_and(|m| m[row]);
        let marks = (0..self.rows).map(|row| {
            each.keyframe = self.keyframe[row];
            (each.occluded, each.uncertain) = (is(&self.occluded, row), is(&self.uncertain, row));
            each.provenance.seeded = is(&self.seeded, row);
            Marks::of(&each)
        });
        let marks = marks.collect();
        let stamps = std::mem::take(&mut self.stamps).into_iter().map(Stamp::from_nanos).collect();
        let pixels = [std::mem::take(&mut self.u_px), std::mem::take(&mut self.v_px)];
        self.plain = ObservationList::from_columns(stamps, pixels, marks).map(|list| (name, list));
        self
    }
}

/// Where labels are taken in.
struct Into<'a> {
    labels: ByCamera,
    /// The camera that the file names for all labels.
    camera: String,
    lenient: Leniency,
    kept: usize,
    /// Rows before this group.
    row: u64,
    unit: Option<TimeUnit>,
    wanted: Option<&'a [String]>,
}

impl Into<'_> {
    fn take(&mut self, table: &Table, mut group: Group) -> DataResult<()> {
        if let Some((name, list)) = group.plain.take() {
            self.lenient.rows(group.rows as u64);
            self.row += group.rows as u64;
            self.kept += group.rows;
            let camera = match &group.cameras {
                Some(Texts::One(camera)) if !camera.is_empty() => camera,
                _ => &self.camera,
            };
            return self.labels.of(camera).append(&name, list).map_err(label_error);
        }
        let before = self.row;
        let at = |row: usize, problem: String| {
            DataError::new(format!("row {}: {problem}", before + row as u64 + 1))
        };
        self.lenient.rows(group.rows as u64);
        self.row += group.rows as u64;
        let Some(points) = &group.points else {
            self.kept += group.rows;
            return Ok(());
        };
        if let Some((row, column)) = &group.wrong {
            return Err(at(*row, format!("{column} is neither yes nor no")));
        }
        for row in 0..group.rows {
            let name =
                text(points, row).ok_or_else(|| at(row, format!("{} is no UTF-8 text", table.point.name)))?;
            if self.wanted.is_some_and(|w| !w.iter().any(|w| w == name)) {
                self.kept += 1;
                continue;
            }
            let ticks = group.stamps[row];
            if ticks == NO_STAMP {
                return Err(at(row, format!("{} is missing", table.stamp.name)));
            }
            let stamp = self
                .stamp(ticks)
                .ok_or_else(|| at(row, format!("{} {ticks} does not fit a time stamp", table.stamp.name)))?;
            let px = Pixel::new(group.u_px[row], group.v_px[row]);
            let keyframe = group.keyframe[row];
            if !keyframe && (px.u.is_nan() || px.v.is_nan()) {
                self.lenient.gap(before + row as u64 + 1);
                continue;
            }
            let source = match group.sources.as_ref().map(|s| text(s, row)) {
                None | Some(Some("")) => ObservationSource::default(),
                Some(name) => name.and_then(ObservationSource::from_name).ok_or_else(|| {
                    at(row, format!("source: `{}` is not known", name.unwrap_or("(no UTF-8)")))
                        .hint("known: manual, auto, detected, interpolated")
                })?,
            };
            let is = |marks: &Option<Vec<bool>>| marks.as_ref().is_some_and(|m| m[row]);
            let (mut occluded, mut uncertain) = (is(&group.occluded), is(&group.uncertain));
            if let Some(flags) = &group.flags {
                for flag in text(flags, row).unwrap_or("(no UTF-8)").split(['+', '|']).map(str::trim) {
                    match flag {
                        "" => {}
                        OCCLUDED => occluded = true,
                        UNCERTAIN => uncertain = true,
                        other => {
                            return Err(at(row, format!("flags: `{other}` is not known"))
                                .hint("known: occluded, uncertain, joined by +"));
                        }
                    }
                }
            }
            let version = group.tracker_version.as_ref().map_or(NO_VERSION, |v| v[row]);
            let tracker_version = match version {
                NO_VERSION => None,
                version => Some(
                    u32::try_from(version)
                        .map_err(|_| at(row, format!("tracker_version: {version} is none")))?,
                ),
            };
            let provenance = Provenance {
                confidence: group.confidence.as_ref().map(|c| c[row]).filter(|c| !c.is_nan()),
                tracker_version,
                seeded: is(&group.seeded),
            };
            let observation = Observation {
                source,
                keyframe,
                occluded,
                uncertain,
                provenance,
                ..Observation::manual(stamp, px)
            };
            let camera = match group.cameras.as_ref().map(|c| text(c, row)) {
                None | Some(Some("")) => &self.camera,
                Some(name) => name.ok_or_else(|| at(row, "camera is no UTF-8 text".to_string()))?,
            };
            self.labels.of(camera).push(name, observation).map_err(|e| at(row, e.to_string()))?;
            self.kept += 1;
        }
        Ok(())
    }

    /// A stamp in the unit of its column, which the first one shows where its name does not.
    fn stamp(&mut self, ticks: i64) -> Option<Stamp> {
        let by_size = || match TimeUnit::of_magnitude(ticks as f64) {
            // Labels are in nanoseconds, which those of a simulation count from zero.
            TimeUnit::Seconds => TimeUnit::Nanos,
            shown => shown,
        };
        let nanos = match *self.unit.get_or_insert_with(by_size) {
            TimeUnit::Seconds => ticks.checked_mul(1_000_000_000),
            TimeUnit::Millis => ticks.checked_mul(1_000_000),
            TimeUnit::Micros => ticks.checked_mul(1_000),
            TimeUnit::Nanos => Some(ticks),
        };
        nanos.map(Stamp::from_nanos)
    }
}

/// The text of a row; `None` where it is none.
fn text(texts: &Texts, row: usize) -> Option<&str> {
    match texts {
        Texts::One(text) => Some(text),
        Texts::Each(all) => std::str::from_utf8(all[row].data()).ok(),
    }
}
