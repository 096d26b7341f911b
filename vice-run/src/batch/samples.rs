//! The scored samples of a run as Parquet: one row a label, pose stream and depth source.
//!
//! About 25 bytes a row, where a line of JSON takes 200.

use std::path::Path;
use std::sync::Arc;

use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::evaluate::SampleSink;
use vice_core::result::{PointName, Sample};
use vice_core::time::Stamp;

use super::key::Key;
use super::store::Store;
use crate::error::RunResult;
use crate::result::ResultDocument;
use vice_files::tables::{self, Column, Values};

/// Rows that are held before they are written.
const GROUP_ROWS: usize = 1 << 17;

/// Names of the columns, in their order; pixels with the centre of the first one at (0, 0).
const TEXTS: [&str; 3] = ["stream", "depth", "point"];
const STAMP: &str = "timestamp_ns";
const PIXELS: [&str; 5] = ["label_u_px", "label_v_px", "tracked_u_px", "tracked_v_px", "error_px"];

/// The samples of a pose stream with a depth source.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PartSamples {
    pub(super) stream: Arc<str>,
    pub(super) depth: Arc<str>,
    pub(super) samples: Vec<Sample>,
}

/// Rows that are still to be written.
#[derive(Default)]
struct Rows {
    texts: [Vec<Option<Arc<str>>>; 3],
    stamps: Vec<Option<i64>>,
    pixels: [Vec<Option<f64>>; 5],
}

impl Rows {
    fn add(&mut self, stream: &Arc<str>, depth: &Arc<str>, sample: &Sample) {
        let Sample { point, timestamp_ns, label_px, tracked_px, error_px } = sample;
        for (column, text) in self.texts.iter_mut().zip([stream, depth, &point.0]) {
            column.push(Some(Arc::clone(text)));
        }
        self.stamps.push(Some(timestamp_ns.as_nanos()));
        let pixels = [label_px.u, label_px.v, tracked_px.u, tracked_px.v, *error_px];
        for (column, value) in self.pixels.iter_mut().zip(pixels) {
            column.push(Some(value));
        }
    }

    /// The columns; what is left is empty.
    fn take(&mut self) -> Vec<Column> {
        let Self { texts, stamps, pixels } = std::mem::take(self);
        let texts = TEXTS.into_iter().zip(texts.map(Values::Text));
        let stamps = [(STAMP, Values::Counts(stamps))];
        let pixels = PIXELS.into_iter().zip(pixels.map(Values::Numbers));
        texts.chain(stamps).chain(pixels).map(|(name, values)| (name.to_string(), values)).collect()
    }
}

/// Makes the file of what `evaluate` hands to its sink. If that fails there is no file.
pub(super) fn write<T>(
    path: &Path,
    evaluate: impl FnOnce(&mut SampleSink<'_>) -> RunResult<T>,
) -> RunResult<T> {
    tables::write(path, &Rows::default().take(), |add| {
        let mut rows = Rows::default();
        let value = evaluate(&mut |stream, depth, samples| {
            let (stream, depth) = (Arc::from(stream), Arc::from(depth));
            for sample in samples {
                rows.add(&stream, &depth, sample);
                if rows.stamps.len() == GROUP_ROWS {
                    add(&rows.take())?;
                }
            }
            Ok(())
        })?;
        add(&rows.take())?;
        Ok(value)
    })
}

/// The same of a document that holds its samples.
pub(super) fn write_kept(path: &Path, document: &ResultDocument) -> RunResult<()> {
    write(path, |sink| {
        for part in &document.pixel {
            sink(&part.stream, &part.depth, &part.samples)?;
        }
        Ok(())
    })
}

/// The samples of a run, with the columns before them that tell runs apart.
pub(super) fn write_named(from: &Path, to: &Path, names: &[(&str, &str)]) -> RunResult<()> {
    let table = tables::read(from)?;
    let rows = table.first().map_or(0, |(_, values)| values.len());
    let named = names.iter().map(|(column, name)| {
        let name: Arc<str> = Arc::from(*name);
        ((*column).to_string(), Values::Text(vec![Some(name); rows]))
    });
    let table: Vec<Column> = named.chain(table).collect();
    tables::write(to, &table, |add| Ok(add(&table)?))
}

/// Reads what [`write()`] wrote.
///
/// # Errors
/// [`DataError`] with the path if it is no such file.
pub(super) fn read(path: &Path) -> DataResult<Vec<PartSamples>> {
    let table = tables::read(path)?;
    let wrong = || DataError::of_kind(ErrorKind::Corrupt, "is no table of samples").at(path);
    let rows = Columns::of(&table).ok_or_else(wrong)?;
    let mut parts: Vec<PartSamples> = Vec::new();
    for at in 0..rows.stamps.len() {
        let (stream, depth, sample) = rows.row(at).ok_or_else(wrong)?;
        match parts.last_mut() {
            Some(part) if part.stream == stream && part.depth == depth => part.samples.push(sample),
            _ => parts.push(PartSamples { stream, depth, samples: vec![sample] }),
        }
    }
    // The points of a part come one after the other, but not always its parts.
    parts.sort_by(|a, b| (&a.stream, &a.depth).cmp(&(&b.stream, &b.depth)));
    parts.dedup_by(|later, first| {
        let same = later.stream == first.stream && later.depth == first.depth;
        if same {
            first.samples.append(&mut later.samples);
        }
        same
    });
    Ok(parts)
}

/// Where samples come from.
#[derive(Clone, Copy)]
pub(super) enum Samples<'a> {
    /// Nowhere: there is only a table of results.
    None,
    /// The folder of a batch, where they were kept.
    Store(&'a Store),
}

impl Samples<'_> {
    /// The samples of a run; nothing where they were not kept or cannot be read.
    pub(super) fn of(&self, key: &str) -> Option<Vec<PartSamples>> {
        let Self::Store(store) = self else { return None };
        // A table of results may have been written by anybody: its keys are no paths.
        if !key.chars().all(|c| c.is_ascii_alphanumeric() || c == '-') {
            return None;
        }
        read(&store.samples_path(&Key::named(key))).ok()
    }
}

/// The columns of a table of samples, all of one length.
struct Columns<'a> {
    texts: [&'a [Option<Arc<str>>]; 3],
    stamps: &'a [Option<i64>],
    pixels: [&'a [Option<f64>]; 5],
}

impl<'a> Columns<'a> {
    fn of(table: &'a [Column]) -> Option<Self> {
        let find = |name: &str| table.iter().find(|(n, _)| n == name).map(|(_, values)| values);
        let mut found = Self { texts: [&[]; 3], stamps: &[], pixels: [&[]; 5] };
        for (into, name) in found.texts.iter_mut().zip(TEXTS) {
            let Values::Text(values) = find(name)? else { return None };
            *into = values;
        }
        let Values::Counts(stamps) = find(STAMP)? else { return None };
        found.stamps = stamps;
        for (into, name) in found.pixels.iter_mut().zip(PIXELS) {
            let Values::Numbers(values) = find(name)? else { return None };
            *into = values;
        }
        Some(found)
    }

    fn row(&self, at: usize) -> Option<(Arc<str>, Arc<str>, Sample)> {
        let text = |column: usize| self.texts[column].get(at)?.clone();
        let pixel = |column: usize| *self.pixels[column].get(at)?;
        let sample = Sample {
            point: PointName(text(2)?),
            timestamp_ns: Stamp::from_nanos(self.stamps[at]?),
            label_px: Pixel::new(pixel(0)?, pixel(1)?),
            tracked_px: Pixel::new(pixel(2)?, pixel(3)?),
            error_px: pixel(4)?,
        };
        Some((text(0)?, text(1)?, sample))
    }
}

#[cfg(test)]
#[cfg(feature = "parquet")]
mod tests {
    use super::*;
    use crate::report::testing::{document, part, sample};

    #[test]
    fn samples_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.parquet");
        let made = document(vec![
            part("b", &[sample("x", 1, 0.1 + 0.2), sample("y", 2, 3.5)]),
            part("a", &[sample("x", 1, 7.0)]),
        ]);
        write_kept(&path, &made).unwrap();
        let found = read(&path).unwrap();
        let names: Vec<&str> = found.iter().map(|p| &*p.stream).collect();
        assert_eq!(names, ["a", "b"]);
        assert_eq!(found[1].samples, made.pixel[0].samples);
        let named = folder.path().join("n.parquet");
        write_named(&path, &named, &[("run_id", "r")]).unwrap();
        assert_eq!(tables::read(&named).unwrap()[0].0, "run_id");
        assert_eq!(read(&named).unwrap(), found);
        std::fs::write(&path, "no table").unwrap();
        assert!(read(&path).unwrap_err().to_string().contains("is no Parquet file"));
    }

    #[test]
    fn a_row_takes_25_bytes() {
        // Labels at hundredths of a pixel, as a tracker writes them; where they are carried nobody chose.
        let mut random = vice_core::random::SplitMix::new(1);
        let samples: Vec<Sample> = (0..4 * 300)
            .map(|i| {
                let (u, v) = (f64::from(i % 7519) / 100.0, f64::from(i * 37 % 4801) / 100.0);
                let tracked = Pixel::new(u + random.normal(), v + random.normal());
                let label_px = Pixel::new(u, v);
                Sample {
                    point: PointName(["a", "b", "c", "d"][i as usize / 300].into()),
                    timestamp_ns: Stamp::from_nanos(
                        1_403_715_273_262_142_976 + i64::from(i % 300) * 100_000_000,
                    ),
                    label_px,
                    tracked_px: tracked,
                    error_px: label_px.distance_px(tracked),
                }
            })
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.parquet");
        let streams = ["a", "b", "c", "d"].map(|stream| part(stream, &samples));
        write_kept(&path, &document(streams.to_vec())).unwrap();
        let bytes = std::fs::metadata(&path).unwrap().len() as usize;
        println!("{} bytes a row", bytes as f64 / (4.0 * samples.len() as f64));
        assert!(bytes < 40 * 4 * samples.len(), "{bytes}");
    }
}
