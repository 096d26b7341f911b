//! The bytes of a file, here or elsewhere.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use vice_core::error::{DataError, DataResult, one_line};
use vice_files::elsewhere::{self, Ranged};

/// A file by its bytes.
pub(super) struct Bytes {
    place: Place,
    len: u64,
    /// Why bytes that are elsewhere could not be had, the first time. What is left out then is no damage of the file.
    failure: Mutex<Option<DataError>>,
}

enum Place {
    Here(Mutex<File>),
    Elsewhere(Arc<dyn Ranged>),
}

impl Bytes {
    /// The file at `place`.
    pub(super) fn open(place: &Path) -> DataResult<Self> {
        let failed = |e: std::io::Error| DataError::new("cannot be read").because(e);
        let (place, len) = match elsewhere::find(place)? {
            Some(file) => {
                let len = file.size_bytes();
                (Place::Elsewhere(file), len)
            }
            None => {
                let file = File::open(place).map_err(failed)?;
                let len = file.metadata().map_err(failed)?.len();
                (Place::Here(Mutex::new(file)), len)
            }
        };
        Ok(Self { place, len, failure: Mutex::default() })
    }

    pub(super) const fn len(&self) -> u64 {
        self.len
    }

    /// Whether each read is a request to somewhere else, so that little is better than much.
    pub(super) const fn is_elsewhere(&self) -> bool {
        matches!(self.place, Place::Elsewhere(_))
    }

    pub(super) fn read_at(&self, offset: u64, bytes: &mut [u8]) -> DataResult<()> {
        match &self.place {
            Place::Here(file) => {
                let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
                file.seek(SeekFrom::Start(offset))
                    .and_then(|_| file.read_exact(bytes))
                    .map_err(|e| DataError::new("cannot be read").byte(offset).because(e))
            }
            Place::Elsewhere(file) => file.read_at(offset, bytes).map_err(|e| self.note(e)),
        }
    }

    pub(super) fn read_vec(&self, offset: u64, len: u64) -> DataResult<Vec<u8>> {
        match &self.place {
            Place::Here(file) => {
                // Where a block lies inside the file was checked when it was found, so that this is no empty claim.
                let mut bytes = Vec::with_capacity(len as usize);
                let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
                file.seek(SeekFrom::Start(offset))
                    .and_then(|_| (&mut *file).take(len).read_to_end(&mut bytes))
                    .map_err(|e| DataError::new("cannot be read").byte(offset).because(e))?;
                Ok(bytes)
            }
            Place::Elsewhere(file) => {
                let len = len.min(self.len.saturating_sub(offset));
                let mut bytes = vec![0; len as usize];
                file.read_at(offset, &mut bytes).map_err(|e| self.note(e))?;
                Ok(bytes)
            }
        }
    }

    /// Says what is going to be read.
    pub(super) fn will_read(&self, ranges: &[Range<u64>]) -> DataResult<()> {
        match &self.place {
            Place::Here(_) => Ok(()),
            Place::Elsewhere(file) => file.will_read(ranges).map_err(|e| self.note(e)),
        }
    }

    fn note(&self, error: DataError) -> DataError {
        let again = DataError::of_kind(error.kind(), one_line(&error));
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        again
    }

    /// An error where bytes could not be had from elsewhere, whatever was made of that.
    pub(super) fn all_had(&self) -> DataResult<()> {
        match self.failure.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}
