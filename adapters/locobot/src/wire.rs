//! Reading serialised messages: ROS 1 and CDR through one reader, so that each message is described once.
//!
//! ROS 1 packs values without padding, little-endian. CDR (ROS 2) starts with four bytes that give the byte order,
//! aligns each value to its own size counted from there, and ends strings with a zero.
//!
//! The crates for CDR (`cdr` 0.2.4, `cdr-encoding`) go through serde into owned values; here one pass borrows strings
//! and pixels, refuses lengths beyond the message, and reads both encodings.

use vice_core::time::Stamp;

use crate::container::Encoding;

/// Why a message cannot be decoded; offsets count from the start of the message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct WireError(pub(crate) String);

impl std::fmt::Display for WireError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for WireError {}

pub(crate) type WireResult<T> = Result<T, WireError>;

/// A place in a message.
#[derive(Clone, Debug)]
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    cdr: bool,
    big_endian: bool,
}

macro_rules! number {
    ($name:ident, $type:ty) => {
        pub(crate) fn $name(&mut self) -> WireResult<$type> {
            let bytes = self.aligned(size_of::<$type>())?.try_into().unwrap_or_default();
            Ok(if self.big_endian { <$type>::from_be_bytes(bytes) } else { <$type>::from_le_bytes(bytes) })
        }
    };
}

impl<'a> Reader<'a> {
    /// Starts at the first value of a message.
    ///
    /// # Errors
    /// [`WireError`] if the encapsulation is not that of plain CDR.
    pub(crate) fn new(bytes: &'a [u8], encoding: Encoding) -> WireResult<Self> {
        match (encoding, bytes) {
            (Encoding::Ros1, _) => Ok(Self { bytes, at: 0, cdr: false, big_endian: false }),
            (Encoding::Cdr, [0, order @ (0 | 1), _, _, content @ ..]) => {
                Ok(Self { bytes: content, at: 0, cdr: true, big_endian: *order == 0 })
            }
            (Encoding::Cdr, [a, b, ..]) => {
                Err(WireError(format!("the CDR encapsulation {a:02x} {b:02x} is not the plain one")))
            }
            (Encoding::Cdr, _) => Err(WireError("the message is too short for CDR".to_string())),
            (Encoding::Other, _) => Err(WireError("the message is neither ROS 1 nor CDR".to_string())),
        }
    }

    fn take(&mut self, len: usize) -> WireResult<&'a [u8]> {
        let end = self.at.checked_add(len).filter(|end| *end <= self.bytes.len());
        let Some(end) = end else {
            let (at, have) = (self.at, self.bytes.len());
            return Err(WireError(format!("{len} bytes at {at} run over the message's end at {have}")));
        };
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn aligned(&mut self, size: usize) -> WireResult<&'a [u8]> {
        if self.cdr {
            self.at = self.at.next_multiple_of(size);
        }
        self.take(size)
    }

    number!(u8, u8);
    number!(u32, u32);
    number!(i32, i32);
    number!(f64, f64);

    /// `N` doubles.
    pub(crate) fn f64s<const N: usize>(&mut self) -> WireResult<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Ok(values)
    }

    /// A list of doubles.
    pub(crate) fn f64_list(&mut self) -> WireResult<Vec<f64>> {
        let n = self.count(8)?;
        (0..n).map(|_| self.f64()).collect()
    }

    /// The length of a list, held against what the message has left for elements of at least `size` bytes.
    pub(crate) fn count(&mut self, size: usize) -> WireResult<usize> {
        let n = self.u32()? as usize;
        let left = self.bytes.len() - self.at;
        if n > left / size {
            return Err(WireError(format!("a list claims {n} elements where {left} bytes are left")));
        }
        Ok(n)
    }

    /// A string.
    pub(crate) fn str(&mut self) -> WireResult<&'a str> {
        let n = self.count(1)?;
        let bytes = self.take(n)?;
        let bytes = if self.cdr { bytes.strip_suffix(&[0]).unwrap_or(bytes) } else { bytes };
        std::str::from_utf8(bytes).map_err(|_| WireError("a string is not UTF-8".to_string()))
    }

    /// A list of bytes.
    pub(crate) fn bytes(&mut self) -> WireResult<&'a [u8]> {
        let n = self.count(1)?;
        self.take(n)
    }

    /// `std_msgs/Header`: stamp and frame.
    pub(crate) fn header(&mut self) -> WireResult<Header<'a>> {
        if !self.cdr {
            self.u32()?; // The sequence number, which ROS 2 dropped.
        }
        let secs = if self.cdr { i64::from(self.i32()?) } else { i64::from(self.u32()?) };
        let nanos = i64::from(self.u32()?);
        let stamp = Stamp::from_nanos(secs * 1_000_000_000 + nanos);
        // Frames of ROS 1 could start with a slash, which means nothing.
        Ok(Header { stamp, frame: self.str()?.trim_start_matches('/') })
    }
}

/// `std_msgs/Header`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Header<'a> {
    /// When it was measured.
    pub(crate) stamp: Stamp,
    /// In which frame.
    pub(crate) frame: &'a str,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn padding_is_skipped_in_cdr_only() {
        let cdr = [0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f];
        let mut reader = Reader::new(&cdr, Encoding::Cdr).unwrap();
        assert_eq!((reader.u8(), reader.f64()), (Ok(7), Ok(1.0)));
        let ros1 = [7, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f];
        let mut reader = Reader::new(&ros1, Encoding::Ros1).unwrap();
        assert_eq!((reader.u8(), reader.f64()), (Ok(7), Ok(1.0)));
        let big = [0, 0, 0, 0, 0, 0, 0, 3, b'a', b'b', 0];
        assert_eq!(Reader::new(&big, Encoding::Cdr).unwrap().str(), Ok("ab"));
        assert!(Reader::new(&[0, 7, 0, 0], Encoding::Cdr).unwrap_err().0.contains("00 07"));
        assert!(Reader::new(&[0], Encoding::Cdr).is_err());
    }

    #[test]
    fn a_length_is_no_reason_to_take_memory() {
        let huge = [0xff, 0xff, 0xff, 0xff, 1, 2];
        let mut reader = Reader::new(&huge, Encoding::Ros1).unwrap();
        assert!(reader.clone().f64_list().unwrap_err().0.contains("claims 4294967295 elements"));
        assert!(reader.str().is_err());
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..64), ros1 in any::<bool>()) {
            let encoding = if ros1 { Encoding::Ros1 } else { Encoding::Cdr };
            if let Ok(mut reader) = Reader::new(&bytes, encoding) {
                let _ = reader.header();
                let _ = reader.f64_list();
                let _ = reader.str();
                let _ = reader.f64s::<9>();
            }
        }
    }
}
