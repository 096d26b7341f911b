//! PCD files of the Point Cloud Library: the points of a scan, as text, binary or compressed.
//!
//! `VIEWPOINT` says from where a scan was taken; as the library itself does, points are left as they are.

mod header;
mod lzf;
mod rows;

use std::io::Read;

use vice_core::error::{DataError, DataResult};

use crate::ply::PointSink;
use header::{Data, Header};

/// Reads the points of a PCD file, metres.
pub(crate) fn read_points(
    reader: impl Read,
    length: Option<u64>,
    sink: &mut impl PointSink,
) -> DataResult<()> {
    let mut source = crate::ply::Source::new(reader, length);
    let header = Header::read(&mut source)?;
    let at_most = match header.data {
        Data::Binary => source.remaining().map(|bytes| bytes / header.point_bytes.max(1) as u64),
        // A run of three bytes makes 264 at most.
        Data::Compressed => {
            source.remaining().map(|bytes| bytes.saturating_mul(88) / header.point_bytes.max(1) as u64)
        }
        Data::Ascii => None,
    };
    sink.expect(header.points, at_most)?;
    match header.data {
        Data::Ascii => rows::text(&mut source, &header, sink),
        Data::Binary => rows::binary(&mut source, &header, sink),
        Data::Compressed => rows::compressed(&mut source, &header, sink),
    }
}

fn ends_early(found: u64, promised: u64, at: u64) -> DataError {
    DataError::new(format!("the file ends after {found} of {promised} points")).byte(at)
}

#[cfg(test)]
mod tests;
