//! The little of NumPy that a pickle of labels holds: element types and arrays of a few numbers.

/// Type of an array's elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dtype {
    kind: u8,
    size: usize,
    big_endian: bool,
}

impl Dtype {
    /// From NumPy's short code: `f8`, `i4`, `<u2`, `b1`.
    pub(super) fn from_code(code: &str) -> Option<Self> {
        let (order, code) = match code.as_bytes() {
            [order @ (b'<' | b'>' | b'|' | b'='), rest @ ..] => (*order, rest),
            rest => (b'<', rest),
        };
        let (kind, size) = match code {
            b"f4" => (b'f', 4),
            b"f8" => (b'f', 8),
            b"b1" => (b'b', 1),
            [kind @ (b'i' | b'u'), size @ (b'1' | b'2' | b'4' | b'8')] => (*kind, usize::from(size - b'0')),
            _ => return None,
        };
        Some(Self { kind, size, big_endian: order == b'>' })
    }

    /// The same type with the byte order that NumPy's state names.
    pub(super) fn with_order(self, order: &str) -> Option<Self> {
        match order {
            "<" | "|" | "=" => Some(Self { big_endian: false, ..self }),
            ">" => Some(Self { big_endian: true, ..self }),
            _ => None,
        }
    }

    /// Bytes that an element takes.
    pub(super) const fn size(self) -> usize {
        self.size
    }

    /// Whether elements are truth values.
    pub(super) const fn is_bool(self) -> bool {
        self.kind == b'b'
    }

    /// Whether elements are whole numbers.
    pub(super) const fn is_integer(self) -> bool {
        matches!(self.kind, b'i' | b'u')
    }

    /// An integer element; `None` past the end or where it does not fit.
    pub(super) fn integer(self, data: &[u8], index: usize) -> Option<i64> {
        let wide = self.widened(data, index)?;
        match (self.kind, self.size) {
            (b'i', 8) => Some(i64::from_le_bytes(wide)),
            (b'i', size) => {
                let shift = 64 - 8 * size as u32;
                Some((i64::from_le_bytes(wide) << shift) >> shift)
            }
            _ => i64::try_from(u64::from_le_bytes(wide)).ok(),
        }
    }

    /// An element as a double; `None` past the end.
    pub(super) fn float(self, data: &[u8], index: usize) -> Option<f64> {
        let wide = self.widened(data, index)?;
        match (self.kind, self.size) {
            (b'f', 4) => Some(f64::from(f32::from_le_bytes([wide[0], wide[1], wide[2], wide[3]]))),
            (b'f', _) => Some(f64::from_le_bytes(wide)),
            _ => self.integer(data, index).map(|i| i as f64),
        }
    }

    /// An element's bytes, lowest first, zeros above.
    fn widened(self, data: &[u8], index: usize) -> Option<[u8; 8]> {
        let from = index.checked_mul(self.size)?;
        let bytes = data.get(from..from.checked_add(self.size)?)?;
        let mut wide = [0; 8];
        wide[..self.size].copy_from_slice(bytes);
        if self.big_endian {
            wide[..self.size].reverse();
        }
        Some(wide)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_of_every_type_are_read() {
        let float = |code: &str, data: &[u8]| Dtype::from_code(code).unwrap().float(data, 0);
        assert_eq!(float("f8", &1.5_f64.to_le_bytes()), Some(1.5));
        assert_eq!(float(">f8", &1.5_f64.to_be_bytes()), Some(1.5));
        assert_eq!(float("<f4", &1.5_f32.to_le_bytes()), Some(1.5));
        assert_eq!(float("i8", &(-3_i64).to_le_bytes()), Some(-3.0));
        assert_eq!(float(">i2", &(-3_i16).to_be_bytes()), Some(-3.0));
        assert_eq!(float("i1", &[0xff]), Some(-1.0));
        assert_eq!(float("u1", &[0xff]), Some(255.0));
        assert_eq!(float("|b1", &[1]), Some(1.0));
        assert_eq!(float("f8", &[0; 7]), None, "cut off");
        assert_eq!(
            Dtype::from_code("i4").unwrap().integer(&[1, 0, 0, 0, 0xfe, 0xff, 0xff, 0xff], 1),
            Some(-2)
        );
        for unknown in ["O8", "U3", "c16", "f2", "i3", "", "<"] {
            assert_eq!(Dtype::from_code(unknown), None, "{unknown}");
        }
    }
}
