//! PLY files: the points of a scan, or a mesh.
//!
//! Text and both binary orders, any order and type of properties, lists, other elements. Read as a stream: nothing
//! is allocated because a header claims it.

mod header;
mod number;
mod rows;
mod source;
#[cfg(test)]
mod tests;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use vice_core::error::{DataError, DataResult};

use header::{Element, Header, Kind};
pub(crate) use rows::PointSink;
use rows::Rows;
pub(crate) use source::Source;

/// Reads the points of a PLY file, metres.
pub(crate) fn read_points(path: &Path, sink: &mut impl PointSink) -> DataResult<()> {
    let (file, length) = open(path)?;
    points_from(file, length, sink).map_err(|e| e.at(path))
}

/// Reads points and faces of a PLY file; a face is a polygon of places in the list of points, counted from 0.
pub(crate) fn read_mesh(
    path: &Path,
    points: &mut impl PointSink,
    face: impl FnMut(&[i64]) -> DataResult<()>,
) -> DataResult<()> {
    let (file, length) = open(path)?;
    mesh_from(file, length, points, face).map_err(|e| e.at(path))
}

fn points_from(reader: impl Read, length: Option<u64>, sink: &mut impl PointSink) -> DataResult<()> {
    let (header, mut rows) = begin(reader, length)?;
    let vertex = needed(&header, "vertex")?;
    for element in &header.elements[..vertex] {
        rows.skip(element)?;
    }
    rows.points(&header.elements[vertex], sink)
}

fn mesh_from(
    reader: impl Read,
    length: Option<u64>,
    points: &mut impl PointSink,
    mut face: impl FnMut(&[i64]) -> DataResult<()>,
) -> DataResult<()> {
    let (header, mut rows) = begin(reader, length)?;
    let (vertex, faces) = (needed(&header, "vertex")?, needed(&header, "face")?);
    check_faces(&header.elements[faces])?;
    for (i, element) in header.elements.iter().enumerate().take(vertex.max(faces) + 1) {
        if i == vertex {
            rows.points(element, points)?;
        } else if i == faces {
            rows.list_rows(element, |row| face(&row.corners))?;
        } else {
            rows.skip(element)?;
        }
    }
    Ok(())
}

/// Opens a file; its length is known where it is a regular one.
pub(crate) fn open(path: &Path) -> DataResult<(File, Option<u64>)> {
    let failed = |e: std::io::Error| DataError::new("cannot be opened").because(e).at(path);
    let file = File::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    if metadata.is_dir() {
        return Err(DataError::new("is a folder, not a file of points").at(path));
    }
    Ok((file, metadata.is_file().then_some(metadata.len())))
}

fn begin<R: Read>(reader: R, length: Option<u64>) -> DataResult<(Header, Rows<R>)> {
    let mut source = Source::new(reader, length);
    let header = Header::read(&mut source)?;
    let rows = Rows { source, layout: header.layout, line: header.lines };
    Ok((header, rows))
}

fn needed(header: &Header, name: &str) -> DataResult<usize> {
    header.index_of(name).ok_or_else(|| {
        let names: Vec<&str> = header.elements.iter().map(|e| e.name.as_str()).collect();
        DataError::new(format!("the PLY file has no element `{name}`"))
            .hint(format!("it has {}", if names.is_empty() { "none".to_string() } else { names.join(", ") }))
    })
}

fn check_faces(element: &Element) -> DataResult<()> {
    let corners = element.index_of("vertex_indices").or_else(|| element.index_of("vertex_index"));
    match corners.map(|c| element.properties[c].kind) {
        Some(Kind::List { item, .. }) if item.is_integer() => Ok(()),
        Some(_) => Err(DataError::new("the corners of a `face` are not a list of integers")),
        None => Err(DataError::new("`face` has no list `vertex_indices` or `vertex_index`")),
    }
}
