//! Where the bytes of a Parquet file come from: a file that is here, or one that is read by ranges.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use bytes::buf::Reader;
use bytes::{Buf, Bytes};
use parquet::errors::{ParquetError, Result};
use parquet::file::reader::{ChunkReader, Length};
use vice_core::error::{DataError, DataResult, ErrorKind};

use crate::elsewhere::{self, Ranged};

/// Most bytes that are handed over where the library does not say how many it wants: it wants the footer's eight.
const UNSAID: u64 = 1 << 16;

pub(super) struct Source {
    kind: Kind,
    size: u64,
}

enum Kind {
    Here(Mutex<File>),
    Memory(Bytes),
    Elsewhere(Arc<dyn Ranged>),
}

impl Source {
    pub(super) fn open(path: &Path) -> DataResult<Self> {
        if let Some(file) = elsewhere::find(path)? {
            return Ok(Self { size: file.size_bytes(), kind: Kind::Elsewhere(file) });
        }
        let failed = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::NotFound => DataError::of_kind(ErrorKind::Missing, "no such file"),
            _ => DataError::new("cannot be read").because(e),
        };
        let file = File::open(path).map_err(failed)?;
        let meta = file.metadata().map_err(failed)?;
        if !meta.is_file() {
            return Err(DataError::of_kind(ErrorKind::Unsupported, "is no ordinary file"));
        }
        Ok(Self { kind: Kind::Here(Mutex::new(file)), size: meta.len() })
    }

    /// What is in memory already.
    pub(super) fn of_bytes(bytes: &[u8]) -> Self {
        Self { size: bytes.len() as u64, kind: Kind::Memory(Bytes::copy_from_slice(bytes)) }
    }

    /// The bytes of a range, which must lie in the file.
    pub(super) fn read(&self, start: u64, length: u64) -> Result<Bytes> {
        if start.checked_add(length).is_none_or(|end| end > self.size) {
            let problem = format!("{length} bytes from {start} on in a file of {}", self.size);
            return Err(ParquetError::EOF(problem));
        }
        if let Kind::Memory(bytes) = &self.kind {
            // Within its size, which is a length in memory.
            return Ok(bytes.slice(start as usize..(start + length) as usize));
        }
        let mut bytes = vec![0; usize::try_from(length).unwrap_or(usize::MAX)];
        match &self.kind {
            Kind::Here(file) => {
                let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
                file.seek(SeekFrom::Start(start))?;
                file.read_exact(&mut bytes)?;
            }
            Kind::Memory(_) => {}
            Kind::Elsewhere(file) => {
                file.read_at(start, &mut bytes).map_err(|e| ParquetError::External(Box::new(e)))?;
            }
        }
        Ok(bytes.into())
    }
}

impl Length for Source {
    fn len(&self) -> u64 {
        self.size
    }
}

impl ChunkReader for Source {
    type T = Reader<Bytes>;

    fn get_read(&self, start: u64) -> Result<Self::T> {
        Ok(self.read(start, self.size.saturating_sub(start).min(UNSAID))?.reader())
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        self.read(start, length as u64)
    }
}

/// A part of a file in memory, under the places that it has in the file.
pub(super) struct Part {
    pub(super) start: u64,
    pub(super) bytes: Bytes,
}

impl Part {
    fn from(&self, start: u64) -> Result<Bytes> {
        let at = start.checked_sub(self.start).and_then(|at| usize::try_from(at).ok());
        match at.filter(|at| *at <= self.bytes.len()) {
            Some(at) => Ok(self.bytes.slice(at..)),
            None => Err(ParquetError::EOF(format!("byte {start} is outside of its column"))),
        }
    }
}

impl Length for Part {
    fn len(&self) -> u64 {
        self.start + self.bytes.len() as u64
    }
}

impl ChunkReader for Part {
    type T = Reader<Bytes>;

    fn get_read(&self, start: u64) -> Result<Self::T> {
        Ok(self.from(start)?.reader())
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        let bytes = self.from(start)?;
        if length > bytes.len() {
            return Err(ParquetError::EOF(format!(
                "{length} bytes of a column that has {} more",
                bytes.len()
            )));
        }
        Ok(bytes.slice(..length))
    }
}
