//! The header of a PCD file.

use std::io::{BufRead, Read};

use vice_core::error::{DataError, DataResult, ErrorKind};

use crate::ply::Source;

/// A line of a header that is longer is none.
const MAX_LINE_BYTES: u64 = 1 << 16;
/// A point that is larger is none.
const MAX_POINT_BYTES: usize = 1 << 16;

/// How the points are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Data {
    Ascii,
    Binary,
    Compressed,
}

/// A number's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    F32,
    F64,
    /// Signed, of so many bytes.
    Signed(usize),
    /// Unsigned, of so many bytes.
    Unsigned(usize),
}

impl Scalar {
    pub(super) const fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
            Self::Signed(n) | Self::Unsigned(n) => n,
        }
    }

    /// The number that starts with these bytes, which are at least [`Scalar::bytes`].
    pub(super) fn of(self, bytes: &[u8]) -> f64 {
        let mut eight = [0_u8; 8];
        let n = self.bytes();
        eight[..n].copy_from_slice(&bytes[..n]);
        let bits = u64::from_le_bytes(eight);
        match self {
            Self::F32 => f64::from(f32::from_bits(bits as u32)),
            Self::F64 => f64::from_bits(bits),
            Self::Unsigned(_) => bits as f64,
            Self::Signed(_) => {
                let unused = 64 - 8 * n as u32;
                ((bits << unused) as i64 >> unused) as f64
            }
        }
    }
}

/// Where a coordinate is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Axis {
    pub(super) scalar: Scalar,
    /// Bytes of a point before it.
    pub(super) offset: usize,
    /// Words of a row of text before it.
    pub(super) word: usize,
}

/// What a header says that is needed.
#[derive(Clone, Debug)]
pub(super) struct Header {
    pub(super) axes: [Axis; 3],
    pub(super) point_bytes: usize,
    pub(super) words: usize,
    pub(super) points: u64,
    pub(super) data: Data,
    /// Lines of the header.
    pub(super) lines: u64,
}

impl Header {
    pub(super) fn read<R: Read>(source: &mut Source<R>) -> DataResult<Self> {
        let mut lines = 0;
        let (mut fields, mut sizes, mut types, mut counts) = (Vec::new(), Vec::new(), Vec::new(), None);
        let (mut width, mut height, mut points) = (None, None, None);
        loop {
            lines += 1;
            let line = next_line(source).map_err(|e| e.line(lines))?;
            let Some(line) = line else {
                return Err(DataError::new("the header of the PCD file has no end: no line DATA").line(lines));
            };
            let mut words = line.split_whitespace();
            let Some(key) = words.next().filter(|key| !key.starts_with('#')) else { continue };
            let rest: Vec<&str> = words.collect();
            let whole = |text: &str| {
                text.parse::<u64>()
                    .map_err(|_| DataError::new(format!("{key} {text} is no whole number")).line(lines))
            };
            let one = || {
                rest.first().copied().ok_or_else(|| DataError::new(format!("{key} says nothing")).line(lines))
            };
            match key {
                "VERSION" | "VIEWPOINT" => {}
                "FIELDS" | "COLUMNS" => fields = rest.iter().map(|f| (*f).to_string()).collect(),
                "SIZE" => sizes = rest.iter().map(|s| whole(s)).collect::<DataResult<Vec<u64>>>()?,
                "TYPE" => types = rest.iter().map(|t| (*t).to_string()).collect(),
                "COUNT" => counts = Some(rest.iter().map(|c| whole(c)).collect::<DataResult<Vec<u64>>>()?),
                "WIDTH" => width = Some(whole(one()?)?),
                "HEIGHT" => height = Some(whole(one()?)?),
                "POINTS" => points = Some(whole(one()?)?),
                "DATA" => {
                    let data = match one()? {
                        "ascii" => Data::Ascii,
                        "binary" => Data::Binary,
                        "binary_compressed" => Data::Compressed,
                        other => {
                            return Err(DataError::of_kind(
                                ErrorKind::Unsupported,
                                format!("DATA {other} is not known; known: ascii, binary, binary_compressed"),
                            )
                            .line(lines));
                        }
                    };
                    let size = match (width, height) {
                        (Some(w), Some(h)) => Some(w.saturating_mul(h)),
                        _ => None,
                    };
                    let points = match (points, size) {
                        (Some(points), Some(size)) if points != size => {
                            return Err(DataError::of_kind(
                                ErrorKind::Contradictory,
                                format!("POINTS {points} is not WIDTH times HEIGHT, {size}"),
                            ));
                        }
                        (Some(points), _) | (None, Some(points)) => points,
                        (None, None) => {
                            return Err(DataError::new("the header has neither POINTS nor WIDTH and HEIGHT"));
                        }
                    };
                    let counts = counts.unwrap_or_else(|| vec![1; fields.len()]);
                    return Self::new(&fields, &sizes, &types, &counts, points, data, lines);
                }
                other => {
                    return Err(
                        DataError::new(format!("`{}` is no line of a PCD header", shown(other))).line(lines)
                    );
                }
            }
        }
    }

    fn new(
        fields: &[String],
        sizes: &[u64],
        types: &[String],
        counts: &[u64],
        points: u64,
        data: Data,
        lines: u64,
    ) -> DataResult<Self> {
        if fields.is_empty() || [sizes.len(), types.len(), counts.len()].iter().any(|n| *n != fields.len()) {
            return Err(DataError::new(format!(
                "FIELDS, SIZE, TYPE and COUNT have {}, {}, {} and {} entries",
                fields.len(),
                sizes.len(),
                types.len(),
                counts.len()
            )));
        }
        let mut axes = [None; 3];
        let (mut offset, mut word) = (0_usize, 0_usize);
        for (i, name) in fields.iter().enumerate() {
            let size = usize::try_from(sizes[i]).unwrap_or(usize::MAX);
            let count = usize::try_from(counts[i]).unwrap_or(usize::MAX);
            if let Some(axis) = ["x", "y", "z"].iter().position(|axis| axis == name) {
                let scalar = match (types[i].as_str(), size) {
                    ("F", 4) => Scalar::F32,
                    ("F", 8) => Scalar::F64,
                    ("I", 1 | 2 | 4 | 8) => Scalar::Signed(size),
                    ("U", 1 | 2 | 4 | 8) => Scalar::Unsigned(size),
                    (kind, _) => {
                        return Err(DataError::new(format!(
                            "the field {name} has TYPE {kind} and SIZE {size}"
                        )));
                    }
                };
                if count != 1 {
                    return Err(DataError::new(format!("the field {name} has COUNT {count}")));
                }
                axes[axis] = Some(Axis { scalar, offset, word });
            }
            offset = offset.saturating_add(size.saturating_mul(count));
            word = word.saturating_add(count);
        }
        if offset > MAX_POINT_BYTES || word > MAX_POINT_BYTES {
            return Err(DataError::new(format!("a point of {offset} bytes is none")));
        }
        let [Some(x), Some(y), Some(z)] = axes else {
            return Err(DataError::new("the PCD file has no fields x, y and z")
                .hint(format!("it has {}", shown(&fields.join(", ")))));
        };
        Ok(Self { axes: [x, y, z], point_bytes: offset, words: word, points, data, lines })
    }
}

/// A name of a file as it may be shown.
fn shown(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).take(60).collect()
}

/// The next line without its end; `None` at the end of the file.
pub(super) fn next_line<R: Read>(source: &mut Source<R>) -> DataResult<Option<String>> {
    let mut bytes = Vec::new();
    let mut limited = source.by_ref().take(MAX_LINE_BYTES);
    limited.read_until(b'\n', &mut bytes).map_err(|e| DataError::new("cannot be read").because(e))?;
    if bytes.is_empty() {
        return Ok(None);
    }
    if bytes.len() as u64 == MAX_LINE_BYTES {
        return Err(DataError::new("a line is longer than 64 KiB"));
    }
    Ok(Some(String::from_utf8_lossy(&bytes).trim_end().to_string()))
}
