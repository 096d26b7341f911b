//! The header of a PLY file: which elements follow, how many, and how their rows are laid out.
//!
//! The grammar is ply-rs's. Around it: a limit on how long a header may be before it is believed to be one, comments
//! in whatever encoding a scanner's software chose, and names that appear twice, which would shift every row.

use std::collections::HashSet;
use std::io::BufRead;

use ply_rs::parser::{Parser, Reader};
use ply_rs::ply::{DefaultElement, ElementDef, Encoding, PropertyType, ScalarType};
use vice_core::error::{DataError, DataResult};

/// A header longer than this is no header (1 MiB; real ones have a few hundred bytes).
const MAX_HEADER_BYTES: usize = 1 << 20;

/// U+FEFF in UTF-8.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// How rows are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Layout {
    /// Text, one row a line.
    Ascii,
    /// Binary, least significant byte first.
    LittleEndian,
    /// Binary, most significant byte first.
    BigEndian,
}

/// The type of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// Bytes of one number in a binary file.
    pub(crate) const fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(crate) const fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    fn of(scalar: &ScalarType) -> Self {
        match scalar {
            ScalarType::Char => Self::I8,
            ScalarType::UChar => Self::U8,
            ScalarType::Short => Self::I16,
            ScalarType::UShort => Self::U16,
            ScalarType::Int => Self::I32,
            ScalarType::UInt => Self::U32,
            ScalarType::Float => Self::F32,
            ScalarType::Double => Self::F64,
        }
    }
}

/// What a property holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// One number.
    One(Scalar),
    /// As many numbers as the count in front of them says.
    List { count: Scalar, item: Scalar },
}

/// A column of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Property {
    pub(crate) name: String,
    pub(crate) kind: Kind,
}

/// A kind of rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Element {
    pub(crate) name: String,
    /// As the header claims; nothing is allocated by it.
    pub(crate) count: u64,
    pub(crate) properties: Vec<Property>,
    /// What ply-rs reads its rows by.
    pub(crate) definition: ElementDef,
}

impl Element {
    /// Position of a property among the columns.
    pub(crate) fn index_of(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.name == name)
    }

    /// Bytes of a row of a binary file; `None` where lists make it vary.
    pub(crate) fn row_bytes(&self) -> Option<usize> {
        self.properties.iter().try_fold(0, |sum, p| match p.kind {
            Kind::One(scalar) => Some(sum + scalar.bytes()),
            Kind::List { .. } => None,
        })
    }

    /// Fewest bytes that a row can take.
    pub(crate) fn min_row_bytes(&self, layout: Layout) -> u64 {
        if layout == Layout::Ascii {
            // A digit and a separator for each column.
            return 2 * self.properties.len().max(1) as u64;
        }
        let bytes = |p: &Property| match p.kind {
            Kind::One(scalar) | Kind::List { count: scalar, .. } => scalar.bytes() as u64,
        };
        self.properties.iter().map(bytes).sum::<u64>()
    }
}

/// A header that has been read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Header {
    pub(crate) layout: Layout,
    pub(crate) elements: Vec<Element>,
    /// Offset of the first byte behind the header.
    pub(crate) bytes: u64,
    /// Lines of the header, the one with `end_header` included.
    pub(crate) lines: u64,
}

impl Header {
    /// Reads up to and including the line `end_header`.
    pub(crate) fn read(reader: &mut impl BufRead) -> DataResult<Self> {
        let (text, lines, passed) = read_text(reader)?;
        let bytes = text.len() as u64 + passed;
        let text = String::from_utf8_lossy(&text);
        let mut source = Reader::new(text.as_bytes());
        let parsed = Parser::<DefaultElement>::new().read_header(&mut source).map_err(|e| {
            let line = e.line().unwrap_or(1).max(1);
            let shown: String = text.lines().nth(line - 1).unwrap_or("").chars().take(60).collect();
            DataError::new(format!("`{shown}` is not what a PLY header has here")).line(line as u64)
        })?;
        check_names(&text)?;
        let layout = match parsed.encoding {
            Encoding::Ascii => Layout::Ascii,
            Encoding::BinaryBigEndian => Layout::BigEndian,
            Encoding::BinaryLittleEndian => Layout::LittleEndian,
        };
        let property = |p: &ply_rs::ply::PropertyDef| Property {
            name: p.name.clone(),
            kind: match &p.data_type {
                PropertyType::Scalar(scalar) => Kind::One(Scalar::of(scalar)),
                PropertyType::List(count, item) => {
                    Kind::List { count: Scalar::of(count), item: Scalar::of(item) }
                }
            },
        };
        let element = |e: &ElementDef| Element {
            name: e.name.clone(),
            count: e.count as u64,
            properties: e.properties.values().map(property).collect(),
            definition: e.clone(),
        };
        let elements: Vec<Element> = parsed.elements.values().map(element).collect();
        for p in elements.iter().flat_map(|e| &e.properties) {
            if let Kind::List { count, .. } = p.kind
                && !count.is_integer()
            {
                return Err(DataError::new(format!("the list `{}` is counted by a fraction", p.name)));
            }
        }
        Ok(Self { layout, elements, bytes, lines })
    }

    /// Position of an element.
    pub(crate) fn index_of(&self, name: &str) -> Option<usize> {
        self.elements.iter().position(|e| e.name == name)
    }
}

/// The text, its lines, and bytes that were passed over.
fn read_text(reader: &mut impl BufRead) -> DataResult<(Vec<u8>, u64, u64)> {
    let (mut text, mut lines, mut passed) = (Vec::new(), 0, 0);
    loop {
        let start = text.len();
        let limit = (MAX_HEADER_BYTES - start) as u64;
        let got = std::io::Read::take(&mut *reader, limit)
            .read_until(b'\n', &mut text)
            .map_err(|e| DataError::new("cannot be read").because(e))?;
        // Programs that treat a header as text write a byte-order mark in front of it.
        if text[start..].starts_with(BYTE_ORDER_MARK) {
            text.drain(start..start + BYTE_ORDER_MARK.len());
            passed += BYTE_ORDER_MARK.len() as u64;
        }
        let line = text[start..].trim_ascii();
        if start == 0 && line != b"ply" {
            return Err(DataError::new("not a PLY file: it does not begin with `ply`"));
        }
        lines += 1;
        if line == b"end_header" {
            return Ok((text, lines, passed));
        }
        if got == 0 {
            let problem =
                if limit == 0 { "no `end_header` in the first MiB" } else { "ends within its header" };
            return Err(DataError::new(problem).byte(text.len() as u64));
        }
    }
}

/// ply-rs keeps elements and properties by name: one that comes twice would be lost, and its bytes with it.
fn check_names(text: &str) -> DataResult<()> {
    let (mut elements, mut properties) = (HashSet::new(), HashSet::new());
    for (line, words) in (1_u64..).zip(text.lines().map(|l| l.split_ascii_whitespace().collect::<Vec<_>>())) {
        let (fresh, name) = match *words.as_slice() {
            ["element", name, ..] => {
                properties.clear();
                (elements.insert(name.to_owned()), name)
            }
            ["property", .., name] => (properties.insert(name.to_owned()), name),
            _ => continue,
        };
        if !fresh {
            return Err(DataError::new(format!("the {} `{name}` is declared twice", words[0])).line(line));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &[u8]) -> Result<Header, String> {
        Header::read(&mut &text[..]).map_err(|e| e.to_string())
    }

    #[test]
    fn columns_come_in_the_order_of_the_file() {
        let text = b"ply\r\nformat binary_big_endian 1.0\r\ncomment \xa9 a scanner\r\nelement camera 2\r\n\
            property uchar id\r\nelement vertex 1000000000000000000\r\nproperty double z\r\n\
            property list uchar float w\r\nproperty int16 x\r\nend_header\r\nrest";
        let header = read(text).unwrap();
        assert_eq!((header.layout, header.lines), (Layout::BigEndian, 10));
        assert_eq!(&text[header.bytes as usize..], b"rest");
        let vertex = &header.elements[header.index_of("vertex").unwrap()];
        assert_eq!(vertex.count, 1_000_000_000_000_000_000);
        assert_eq!((vertex.index_of("x"), vertex.index_of("y")), (Some(2), None));
        assert_eq!((vertex.row_bytes(), vertex.min_row_bytes(header.layout)), (None, 11));
        assert_eq!(header.elements[0].row_bytes(), Some(1));
    }

    #[test]
    fn what_is_no_header_is_named() {
        assert_eq!(read(b"").unwrap_err(), "not a PLY file: it does not begin with `ply`");
        assert_eq!(read(b"plyformat\n").unwrap_err(), "not a PLY file: it does not begin with `ply`");
        assert_eq!(read(b"ply\nformat ascii 1.0\n").unwrap_err(), "byte 21: ends within its header");
        assert!(
            read(b"ply\nformat ascii 1.0\nelement vertex -3\nend_header\n")
                .unwrap_err()
                .starts_with("line 3")
        );
        let too_many = b"ply\nformat ascii 1.0\nelement vertex 99999999999999999999999\nend_header\n";
        assert!(read(too_many).unwrap_err().starts_with("line 3"));
        assert!(read(b"ply\nformat mp3 1.0\nend_header\n").unwrap_err().starts_with("line 2"));
        let twice =
            b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty int x\nend_header\n";
        assert_eq!(read(twice).unwrap_err(), "line 5: the property `x` is declared twice");
        let endless = [b"ply\n".to_vec(), b"comment x\n".repeat(200_000)].concat();
        assert!(read(&endless).unwrap_err().contains("no `end_header` in the first MiB"));
    }
}
