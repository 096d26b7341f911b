//! Numbers and texts as bytes between the program and the process of a plugin: little endian, lengths in front.

use std::path::{Path, PathBuf};

use crate::border::Fault;

/// Bytes that are being made.
#[derive(Default)]
pub(super) struct Writer(pub(super) Vec<u8>);

/// Bytes that are being read. What a length claims is held against what is there.
pub(super) struct Reader<'a>(pub(super) &'a [u8]);

/// What crosses: written by one process, read and checked by the other.
pub(super) trait Carried: Sized {
    /// Adds it.
    fn put(&self, out: &mut Writer);
    /// Reads it.
    fn take(from: &mut Reader<'_>) -> Result<Self, Fault>;
}

impl Writer {
    pub(super) fn put(&mut self, value: &impl Carried) -> &mut Self {
        value.put(self);
        self
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.put(&(bytes.len() as u64));
        self.0.extend_from_slice(bytes);
        self
    }

    pub(super) fn list<T: Carried>(&mut self, list: &[T]) -> &mut Self {
        self.put(&(list.len() as u64));
        list.iter().for_each(|value| value.put(self));
        self
    }
}

impl<'a> Reader<'a> {
    pub(super) fn get<T: Carried>(&mut self) -> Result<T, Fault> {
        T::take(self)
    }

    fn take_bytes(&mut self, length: usize) -> Result<&'a [u8], Fault> {
        let (bytes, rest) = self
            .0
            .split_at_checked(length)
            .ok_or_else(|| format!("its answer ends {} bytes early", length - self.0.len()))?;
        self.0 = rest;
        Ok(bytes)
    }

    pub(super) fn bytes(&mut self) -> Result<&'a [u8], Fault> {
        let length: u64 = self.get()?;
        self.take_bytes(usize::try_from(length).unwrap_or(usize::MAX))
    }

    pub(super) fn list<T: Carried>(&mut self) -> Result<Vec<T>, Fault> {
        let count: u64 = self.get()?;
        // Each takes a byte at least; memory grows with what was read.
        if count > self.0.len() as u64 {
            return Err(format!("its answer announces {count} values in {} bytes", self.0.len()));
        }
        (0..count).map(|_| self.get()).collect()
    }

    /// That nothing is left.
    pub(super) fn end(self) -> Result<(), Fault> {
        match self.0.len() {
            0 => Ok(()),
            left => Err(format!("its answer has {left} bytes too many")),
        }
    }
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Carried for $number {
            fn put(&self, out: &mut Writer) {
                out.0.extend_from_slice(&self.to_le_bytes());
            }

            fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
                let bytes = from.take_bytes(size_of::<$number>())?;
                Ok(Self::from_le_bytes(bytes.try_into().unwrap_or_default()))
            }
        }
    )*};
}
numbers!(u8, i32, u32, u64, i64, f32, f64);

impl Carried for bool {
    fn put(&self, out: &mut Writer) {
        out.put(&u8::from(*self));
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        match from.get::<u8>()? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(format!("its answer has {other} where yes or no is expected")),
        }
    }
}

impl Carried for String {
    fn put(&self, out: &mut Writer) {
        out.bytes(self.as_bytes());
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        Self::from_utf8(from.bytes()?.to_vec()).map_err(|_| "a text of its answer is not UTF-8".to_string())
    }
}

impl Carried for PathBuf {
    fn put(&self, out: &mut Writer) {
        out.bytes(Path::as_os_str(self).as_encoded_bytes());
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        vice_abi::path_from_bytes(from.bytes()?)
            .ok_or_else(|| "a path of its answer is not UTF-8".to_string())
    }
}

impl<T: Carried, const N: usize> Carried for [T; N] {
    fn put(&self, out: &mut Writer) {
        self.iter().for_each(|value| value.put(out));
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        let values: Vec<T> = (0..N).map(|_| from.get()).collect::<Result<_, _>>()?;
        values.try_into().map_err(|_| "its answer ends early".to_string())
    }
}

impl<T: Carried> Carried for Option<T> {
    fn put(&self, out: &mut Writer) {
        out.put(&self.is_some());
        if let Some(value) = self {
            value.put(out);
        }
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, Fault> {
        if from.get()? { from.get().map(Some) } else { Ok(None) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again_and_no_length_is_believed() {
        let mut out = Writer::default();
        out.put(&7_u32).put(&"name".to_string()).put(&Some([1.5_f64, -2.0])).put(&true).list(&[1_i64, 2, 3]);
        let bytes = out.0;
        let mut reader = Reader(&bytes);
        assert_eq!((reader.get(), reader.get::<String>()), (Ok(7_u32), Ok("name".to_string())));
        assert_eq!((reader.get::<Option<[f64; 2]>>(), reader.get()), (Ok(Some([1.5, -2.0])), Ok(true)));
        assert_eq!(reader.list::<i64>(), Ok(vec![1, 2, 3]));
        assert_eq!(reader.end(), Ok(()));
        for length in 0..bytes.len() {
            let mut cut = Reader(&bytes[..length]);
            let all = |r: &mut Reader<'_>| -> Result<(), Fault> {
                r.get::<u32>()?;
                r.get::<String>()?;
                r.get::<Option<[f64; 2]>>()?;
                r.get::<bool>()?;
                r.list::<i64>().map(drop)
            };
            assert!(all(&mut cut).is_err(), "{length}");
        }
        let huge = u64::MAX.to_le_bytes();
        assert!(Reader(&huge).bytes().unwrap_err().contains("early"));
        assert!(Reader(&huge).list::<u8>().unwrap_err().contains("announces"));
        assert!(Reader(&[2]).get::<bool>().is_err());
        assert!(Reader(&[1, 2]).end().is_err());
    }
}
