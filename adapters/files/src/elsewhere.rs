//! Files that lie elsewhere and are read by ranges.
//!
//! A data set of which not all is here is a folder in which empty files stand for what is elsewhere: what looks at names
//! finds them, and the few readers of large files ask [`find`] for the bytes.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use vice_core::error::DataResult;

/// A file that is read by ranges.
pub trait Ranged: Send + Sync {
    /// Bytes of the file.
    fn size_bytes(&self) -> u64;

    /// Fills `bytes` from `offset` on.
    ///
    /// # Errors
    /// [`DataError`](vice_core::error::DataError) if the file ends before that, cannot be reached, or is not what it was when it was opened.
    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> DataResult<()>;

    /// Says what is going to be read, so that it can be fetched at once. Only time depends on it.
    ///
    /// # Errors
    /// As [`Ranged::read_at`].
    fn will_read(&self, _ranges: &[Range<u64>]) -> DataResult<()> {
        Ok(())
    }
}

/// The files of a folder that are not here.
pub trait Elsewhere: Send + Sync {
    /// The file for which an empty one stands; `None` where the one that is here is the file itself.
    ///
    /// # Errors
    /// [`DataError`](vice_core::error::DataError) if it cannot be reached.
    fn open(&self, path: &Path) -> DataResult<Option<Arc<dyn Ranged>>>;

    /// Puts the file itself in the place of the empty one, for programs that read it by its path.
    ///
    /// # Errors
    /// [`DataError`](vice_core::error::DataError) if it cannot be fetched.
    fn bring(&self, path: &Path) -> DataResult<()>;
}

static FOLDERS: Mutex<BTreeMap<PathBuf, Weak<dyn Elsewhere>>> = Mutex::new(BTreeMap::new());

fn folders() -> MutexGuard<'static, BTreeMap<PathBuf, Weak<dyn Elsewhere>>> {
    FOLDERS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Says who has the files of a folder; it holds as long as `files` is kept. Where somebody has them already, it is that
/// one who is given back.
pub fn mount(folder: &Path, files: Arc<dyn Elsewhere>) -> Arc<dyn Elsewhere> {
    let mut folders = folders();
    folders.retain(|_, files| files.strong_count() > 0);
    if let Some(there) = folders.get(folder).and_then(Weak::upgrade) {
        return there;
    }
    folders.insert(folder.to_path_buf(), Arc::downgrade(&files));
    files
}

fn owner(path: &Path) -> Option<Arc<dyn Elsewhere>> {
    let folders = folders();
    if folders.is_empty() {
        return None;
    }
    path.ancestors().find_map(|folder| folders.get(folder)?.upgrade())
}

/// The file for which an empty one stands; `None` where the path is of a file that is here.
///
/// # Errors
/// [`DataError`](vice_core::error::DataError) if it cannot be reached.
pub fn find(path: &Path) -> DataResult<Option<Arc<dyn Ranged>>> {
    owner(path).map_or(Ok(None), |files| files.open(path))
}

/// Makes sure that a file can be read by its path.
///
/// # Errors
/// [`DataError`](vice_core::error::DataError) if it lies elsewhere and cannot be fetched.
pub fn bring(path: &Path) -> DataResult<()> {
    owner(path).map_or(Ok(()), |files| files.bring(path))
}

/// All bytes of a file that lies elsewhere; `None` where it is here.
///
/// # Errors
/// [`DataError`](vice_core::error::DataError) if it cannot be read.
pub fn read(path: &Path) -> DataResult<Option<Vec<u8>>> {
    let Some(file) = find(path)? else { return Ok(None) };
    let mut bytes = vec![0; file.size_bytes() as usize];
    file.read_at(0, &mut bytes)?;
    Ok(Some(bytes))
}

/// A file that lies elsewhere, for what reads and seeks.
pub struct Reader {
    file: Arc<dyn Ranged>,
    at: u64,
}

impl Reader {
    /// From the beginning of a file.
    pub fn new(file: Arc<dyn Ranged>) -> Self {
        Self { file, at: 0 }
    }
}

impl Read for Reader {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let left = self.file.size_bytes().saturating_sub(self.at);
        let len = bytes.len().min(usize::try_from(left).unwrap_or(usize::MAX));
        if len == 0 {
            return Ok(0);
        }
        self.file.read_at(self.at, &mut bytes[..len]).map_err(io::Error::other)?;
        self.at += len as u64;
        Ok(len)
    }
}

impl Seek for Reader {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let (from, by) = match to {
            SeekFrom::Start(at) => (at, 0),
            SeekFrom::Current(by) => (self.at, by),
            SeekFrom::End(by) => (self.file.size_bytes(), by),
        };
        let before = || io::Error::new(io::ErrorKind::InvalidInput, "a place before the beginning");
        self.at = from.checked_add_signed(by).ok_or_else(before)?;
        Ok(self.at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Word;

    impl Ranged for Word {
        fn size_bytes(&self) -> u64 {
            3
        }

        fn read_at(&self, offset: u64, bytes: &mut [u8]) -> DataResult<()> {
            bytes.copy_from_slice(&b"abc"[offset as usize..offset as usize + bytes.len()]);
            Ok(())
        }
    }

    struct Words;

    impl Elsewhere for Words {
        fn open(&self, path: &Path) -> DataResult<Option<Arc<dyn Ranged>>> {
            Ok(path.ends_with("word").then(|| Arc::new(Word) as Arc<dyn Ranged>))
        }

        fn bring(&self, _: &Path) -> DataResult<()> {
            Ok(())
        }
    }

    #[test]
    fn it_is_read_and_sought_like_a_file() {
        let mut reader = Reader::new(Arc::new(Word));
        let mut text = String::new();
        assert_eq!(reader.seek(SeekFrom::End(-2)).unwrap(), 1);
        reader.read_to_string(&mut text).unwrap();
        assert_eq!(text, "bc");
        assert!(reader.seek(SeekFrom::Current(-9)).is_err());
        reader.seek(SeekFrom::Start(7)).unwrap();
        assert_eq!(reader.read(&mut [0; 4]).unwrap(), 0, "behind the end there is nothing");
    }

    #[test]
    fn a_folder_is_elsewhere_as_long_as_somebody_has_it() {
        let folder = Path::new("/no/such/folder/of/words");
        let held = mount(folder, Arc::new(Words));
        let again = mount(folder, Arc::new(Words));
        assert!(Arc::ptr_eq(&held, &again), "one owner a folder");
        assert_eq!(read(&folder.join("deep/word")).unwrap().unwrap(), b"abc");
        assert!(read(&folder.join("here")).unwrap().is_none());
        assert!(find(Path::new("/no/such/folder/of")).unwrap().is_none());
        drop((held, again));
        assert!(find(&folder.join("word")).unwrap().is_none());
    }
}
