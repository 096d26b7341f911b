//! LAS and LAZ files, as laser scanners and surveyors have them: the points of a scan, metres.
//!
//! They store whole numbers with a scale and an offset for each axis, so that coordinates of a map lose nothing; they are
//! handed on in double precision.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};

use las::{PointDataBuilder, Reader};
use vice_core::error::{DataError, DataResult};

use crate::ply::PointSink;

/// Points that are decoded at once.
const PIECE_POINTS: u64 = 1 << 16;

/// Reads the points of a file that is `length` bytes long.
pub(crate) fn read_points(mut file: File, length: Option<u64>, sink: &mut impl PointSink) -> DataResult<()> {
    if let Some(length) = length {
        check_records(&mut file, length)?;
        check_chunks(&mut file, length)?;
    }
    let mut reader = checked("the header", || Reader::new(BufReader::new(file)))?;
    let header = reader.header();
    let promised = header.number_of_points();
    let format = header.point_format();
    // What compression saves is not known, and the promise then not believed.
    let at_most =
        length.filter(|_| !format.is_compressed).map(|bytes| bytes / u64::from(format.len()).max(1));
    let scales = [header.transforms().x, header.transforms().y, header.transforms().z];
    if let Some(scale) = scales.iter().map(|t| t.scale).find(|scale| !(scale.is_finite() && *scale > 0.0)) {
        return Err(DataError::new(format!("the header's scale of a coordinate is {scale}")));
    }
    sink.expect(promised, at_most)?;
    let mut piece = PointDataBuilder::new().for_header(reader.header()).build();
    let mut found = 0;
    while found < promised {
        let count = (promised - found).min(PIECE_POINTS);
        let got = checked(&format!("after {found} of {promised} points"), || {
            reader.fill_points(count, &mut piece)
        })?;
        if got == 0 {
            return Err(DataError::new(format!("the file ends after {found} of {promised} points")));
        }
        for ((x, y), z) in piece.x().zip(piece.y()).zip(piece.z()) {
            sink.double([x, y, z])?;
        }
        found += got;
    }
    Ok(())
}

/// Holds the numbers of points and records that a header announces against the length of the file: the decoder multiplies
/// them as they are. What is no header is for the decoder to refuse.
fn check_records(file: &mut File, length: u64) -> DataResult<()> {
    /// Bytes of a record's own header, before the points and after them.
    const RECORD: u64 = 54;
    const EXTENDED_RECORD: u64 = 60;
    let mut header = Vec::new();
    let failed = |e: std::io::Error| DataError::new("cannot be read").because(e);
    file.by_ref().take(375).read_to_end(&mut header).map_err(failed)?;
    file.rewind().map_err(failed)?;
    let bytes = |at: usize, count: usize| {
        let mut word = [0; 8];
        word[..count].copy_from_slice(header.get(at..at + count)?);
        Some(u64::from_le_bytes(word))
    };
    let is_compressed = bytes(104, 1).is_none_or(|format| format & 0x80 != 0);
    let large = bytes(25, 1).is_some_and(|minor| minor >= 4);
    let size = if is_compressed { 0 } else { bytes(105, 2).unwrap_or(0) };
    let mut promised = vec![("points", bytes(107, 4), size), ("records", bytes(100, 4), RECORD)];
    if large {
        promised.push(("points", bytes(247, 8), size));
        promised.push(("records after the points", bytes(243, 4), EXTENDED_RECORD));
    }
    for (what, count, each) in promised {
        let count = count.unwrap_or(0);
        // No laser has measured so many points, whatever they are packed to.
        if count.saturating_mul(each) > length || count > 1 << 40 {
            return Err(DataError::new(format!(
                "the header promises {count} {what}, in a file of {length} bytes"
            ))
            .hint("the file is cut off, or no LAS file"));
        }
    }
    if large {
        let (start, count) = (bytes(235, 8).unwrap_or(0), bytes(243, 4).unwrap_or(0));
        check_extended(file, start, count, length)?;
        file.rewind().map_err(failed)?;
    }
    Ok(())
}

/// Holds the length of each record after the points against what is left of the file.
fn check_extended(file: &mut File, mut at: u64, count: u64, length: u64) -> DataResult<()> {
    for _ in 0..count {
        let mut head = [0; 60];
        if file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut head)).is_err() {
            return Err(DataError::new("a record after the points is cut off").byte(at));
        }
        // After two reserved bytes, the name of its user and its number.
        let mut size = [0; 8];
        size.copy_from_slice(&head[20..28]);
        let size = u64::from_le_bytes(size);
        if size > length.saturating_sub(at + 60) {
            let problem = format!("a record after the points claims {size} bytes, in a file of {length}");
            return Err(DataError::new(problem).byte(at));
        }
        at += 60 + size;
    }
    Ok(())
}

/// Holds the number of chunks of a LAZ file against its length: the decoder takes memory for as many as the file says, and a
/// process that asks for more than there is cannot be stopped from ending. What cannot be found is for the decoder to miss.
fn check_chunks(file: &mut File, length: u64) -> DataResult<()> {
    /// Where the header says at which byte the points start, and the format of a point, whose highest bit is that of LAZ.
    const POINTS_AT: u64 = 96;
    const FORMAT_AT: u64 = 104;
    let mut bytes =
        |at: u64, into: &mut [u8]| file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(into));
    let mut chunks = || -> std::io::Result<Option<(u64, u32)>> {
        let (mut long, mut short, mut format) = ([0; 8], [0; 4], [0]);
        bytes(FORMAT_AT, &mut format)?;
        if format[0] & 0x80 == 0 {
            return Ok(None);
        }
        bytes(POINTS_AT, &mut short)?;
        bytes(u64::from(u32::from_le_bytes(short)), &mut long)?;
        if i64::from_le_bytes(long) == -1 {
            // Written without going back: the place stands at the end.
            bytes(length.saturating_sub(8), &mut long)?;
        }
        let table = u64::from_le_bytes(long);
        // After the version of the table.
        bytes(table.saturating_add(4), &mut short)?;
        Ok(Some((table, u32::from_le_bytes(short))))
    };
    let found = chunks().ok().flatten();
    file.rewind().map_err(|e| DataError::new("cannot be read").because(e))?;
    match found {
        Some((table, chunks)) if u64::from(chunks) > length => {
            Err(DataError::new(format!("{chunks} chunks are announced in a file of {length} bytes"))
                .byte(table))
        }
        _ => Ok(()),
    }
}

/// What the decoder makes; bytes that are none of a compressed file may bring it to stop in its own code.
fn checked<T>(place: &str, decode: impl FnOnce() -> las::Result<T>) -> DataResult<T> {
    match catch_unwind(AssertUnwindSafe(decode)) {
        Ok(Ok(made)) => Ok(made),
        Ok(Err(error)) => {
            Err(DataError::new(format!("the LAS or LAZ file cannot be read: {place}")).because(error))
        }
        Err(_) => Err(DataError::new(format!("the LAS or LAZ file cannot be decoded: {place}"))
            .hint("its bytes are damaged; copy it again, or repack it with laszip")),
    }
}

#[cfg(test)]
mod tests {
    use las::{Builder, Point, Transform, Vector, Writer};

    use crate::cloud::{CloudOptions, read_scan_points};

    /// A file of points that a map has, written by the crate itself.
    fn file(name: &str, points: usize) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        let mut builder = Builder::from((1, 4));
        builder.point_format.is_compressed = name.ends_with("laz");
        let axis = |offset| Transform { scale: 0.001, offset };
        builder.transforms = Vector { x: axis(461_000.0), y: axis(5_428_000.0), z: axis(300.0) };
        let mut writer = Writer::from_path(&path, builder.into_header().unwrap()).unwrap();
        for i in 0..points {
            let t = i as f64;
            let (x, y, z) = (461_234.0 + 0.001 * t, 5_428_765.5 - 0.002 * t, 312.0 + (t % 7.0));
            writer.write_point(Point { x, y, z, ..Default::default() }).unwrap();
        }
        writer.close().unwrap();
        (folder, path)
    }

    #[test]
    fn coordinates_of_a_map_keep_their_millimetres() {
        for name in ["scan.las", "scan.laz"] {
            let (_folder, path) = file(name, 100_000);
            let scan = read_scan_points(&path, &CloudOptions::default()).unwrap();
            assert_eq!(scan.points.len(), 100_000, "{name}");
            let [x, y, z] = std::array::from_fn(|i| scan.origin_m[i] + f64::from(scan.points[99_999][i]));
            assert!((x - 461_333.999).abs() < 1e-4 && (y - 5_428_565.502).abs() < 1e-4, "{name}: {x} {y}");
            assert!((z - 316.0).abs() < 1e-6, "{name}: {z}");
            assert!(scan.suspicions.is_empty(), "{name}");
        }
    }

    #[test]
    fn a_table_of_chunks_is_counted_against_the_file() {
        let (_folder, path) = file("scan.laz", 5000);
        let mut bytes = std::fs::read(&path).unwrap();
        let word =
            |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let points = word(&bytes, 96);
        let table = word(&bytes, points);
        bytes[table + 4..table + 8].copy_from_slice(&u32::MAX.to_le_bytes());
        std::fs::write(&path, &bytes).unwrap();
        let error = read_scan_points(&path, &CloudOptions::default()).map(|s| s.points.len()).unwrap_err();
        assert!(error.to_string().contains("4294967295 chunks are announced in a file of"), "{error}");
    }

    #[test]
    fn damaged_files_are_an_error_and_no_more() {
        for name in ["scan.las", "scan.laz"] {
            let (_folder, path) = file(name, 5000);
            let whole = std::fs::read(&path).unwrap();
            for cut in [4, 100, 300, whole.len() / 2, whole.len() - 20] {
                std::fs::write(&path, &whole[..cut]).unwrap();
                let error = read_scan_points(&path, &CloudOptions::default()).map(|s| s.points.len());
                assert!(error.is_err(), "{name} cut to {cut}: {error:?}");
            }
            for place in (0..whole.len()).step_by(whole.len() / 60) {
                let mut damaged = whole.clone();
                damaged[place] ^= 0xff;
                std::fs::write(&path, &damaged).unwrap();
                // An error or other points, but an answer.
                let _ =
                    read_scan_points(&path, &CloudOptions { max_bytes: Some(1 << 26), ..Default::default() });
            }
        }
    }
}
