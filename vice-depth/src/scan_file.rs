//! Files of points, told apart by their first bytes.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use vice_core::error::{DataError, DataResult, ErrorKind};

use crate::pcd;
use crate::ply::{self, PointSink};

/// Comments before the first word of a PCD file that are looked at.
const LOOKED_AT: usize = 512;

/// Reads the points of a PLY, PCD, LAS or LAZ file, metres.
pub(crate) fn read_points(path: &Path, sink: &mut impl PointSink) -> DataResult<()> {
    let failed = |e: std::io::Error| DataError::new("cannot be opened").because(e).at(path);
    let mut head = Vec::new();
    let (mut file, length) = ply::open(path)?;
    file.by_ref().take(LOOKED_AT as u64).read_to_end(&mut head).map_err(failed)?;
    if is_pcd(&head) {
        file.seek(SeekFrom::Start(0)).map_err(failed)?;
        return pcd::read_points(file, length, sink).map_err(|e| e.at(path));
    }
    if head.starts_with(b"LASF") {
        file.seek(SeekFrom::Start(0)).map_err(failed)?;
        return read_las(file, length, sink).map_err(|e| e.at(path));
    }
    let bare = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&head);
    if !bare.starts_with(b"ply") {
        return Err(DataError::of_kind(
            ErrorKind::Unsupported,
            "is no file of points that is known: PLY, PCD, LAS or LAZ",
        )
        .hint("CloudCompare, Open3D and PDAL write these")
        .at(path));
    }
    ply::read_points(path, sink)
}

/// Comments, and then the first line of a PCD header.
fn is_pcd(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    if text.starts_with("# .PCD") {
        return true;
    }
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
    first.is_some_and(|line| ["VERSION ", "FIELDS "].iter().any(|word| line.starts_with(word)))
}

#[cfg(feature = "las")]
fn read_las(file: File, length: Option<u64>, sink: &mut impl PointSink) -> DataResult<()> {
    crate::las::read_points(file, length, sink)
}

#[cfg(not(feature = "las"))]
fn read_las(_: File, _: Option<u64>, _: &mut impl PointSink) -> DataResult<()> {
    Err(DataError::of_kind(ErrorKind::Unsupported, "is a LAS or LAZ file, which this build does not read")
        .hint("build with the feature `las`, or convert it to PLY or PCD"))
}
