//! PLY files: the points of a scan.

mod header;

use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::path::Path;

use ply_rs::parser::{Parser, Reader};
use ply_rs::ply::{Property, PropertyAccess, PropertyAccessResult};
use vice_core::error::{DataError, DataResult};

use header::{Header, Kind};

/// A row of the vertex element.
struct Vertex([f64; 3]);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self([f64::NAN; 3])
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            _ => return PropertyAccessResult::Ignored,
        };
        self.0[axis] = match property {
            Property::Char(v) => v.into(),
            Property::UChar(v) => v.into(),
            Property::Short(v) => v.into(),
            Property::UShort(v) => v.into(),
            Property::Int(v) => v.into(),
            Property::UInt(v) => v.into(),
            Property::Float(v) => v.into(),
            Property::Double(v) => v,
            _ => return PropertyAccessResult::Ignored,
        };
        PropertyAccessResult::Set
    }
}

/// Reads the points of a PLY file, metres.
pub(crate) fn read_points(path: &Path) -> DataResult<Vec<[f64; 3]>> {
    let failed = |e: std::io::Error| DataError::new("cannot be read").because(e).at(path);
    let mut reader = BufReader::new(File::open(path).map_err(failed)?);
    let header = Header::read(&mut reader).map_err(|e| e.at(path))?;
    let vertex = header
        .index_of("vertex")
        .map(|i| &header.elements[i])
        .ok_or_else(|| DataError::new("the PLY file has no element `vertex`").at(path))?;
    for name in ["x", "y", "z"] {
        match vertex.index_of(name).map(|i| vertex.properties[i].kind) {
            Some(Kind::One(_)) => {}
            Some(Kind::List { .. }) => {
                return Err(
                    DataError::new(format!("`{name}` of the vertices is a list, not a number")).at(path)
                );
            }
            None => return Err(DataError::new(format!("the vertices have no property `{name}`")).at(path)),
        }
    }
    reader.seek(SeekFrom::Start(0)).map_err(failed)?;
    let broken = |e: ply_rs::parser::ParseError| {
        DataError::new("the PLY file is cut off or broken").because(e).at(path)
    };
    let parser = Parser::<Vertex>::new();
    let mut reader = Reader::new(reader);
    let header = parser.read_header(&mut reader).map_err(broken)?;
    for (name, element) in &header.elements {
        let rows = parser.read_payload_for_element(&mut reader, element, &header).map_err(broken)?;
        if name == "vertex" {
            return Ok(rows.into_iter().map(|v| v.0).collect());
        }
    }
    Ok(Vec::new())
}
