//! Hashes of what is read, so that a run is known to be the same.
//!
//! A file up to [`WHOLE_BYTES`] is hashed whole. A larger one is hashed by its size and [`BLOCKS`] blocks spread over it,
//! the first and the last among them: a recording has its index there. An image is hashed by its size, its first and its
//! last bytes, where PNG keeps its checksums; an evaluation decodes none but those of depth. What lies elsewhere is not
//! read: its hash is of its address and of what the server says of it.

use std::collections::BTreeMap;
use std::fs::{self, File, Metadata};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use vice_core::error::{DataError, DataResult};
use vice_files::address::is_address;
use vice_files::atomic::{self, Overwrite};

use crate::place;
use crate::text::hex;

/// Largest file that is hashed whole.
const WHOLE_BYTES: u64 = 64 << 20;
/// Blocks of a larger file.
const BLOCKS: u64 = 32;
const BLOCK_BYTES: u64 = 64 << 10;
/// First and last bytes of an image.
const IMAGE_BYTES: u64 = 4 << 10;
/// Images by the endings of their names.
const IMAGES: [&str; 8] = ["png", "jpg", "jpeg", "pgm", "ppm", "bmp", "tif", "tiff"];
/// Folders inside of folders that are looked into.
const DEEPEST: usize = 12;
/// A file that was changed so shortly ago may change again within the same tick of the clock.
const FRESH: Duration = Duration::from_secs(2);

/// The hash of a file or folder.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Content {
    pub(super) hash: String,
    /// Whether a recording in it was too large to be read whole.
    pub(super) sampled: bool,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Known {
    size: u64,
    modified_ns: u64,
    content: Content,
}

/// What is not there.
fn missing() -> Content {
    Content { hash: "missing".to_string(), sampled: false }
}

/// Hashes that are known, by path, size and time of the last change.
#[derive(Debug, Default)]
pub struct Hashes {
    files: Mutex<BTreeMap<String, Known>>,
    /// What was looked at in this process: a folder that a hundred runs name is walked once.
    seen: Mutex<BTreeMap<PathBuf, Arc<Mutex<Option<Content>>>>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Hashes {
    /// Those that were kept, or none where there is no such file or it is none: it spares time only.
    pub fn read(path: &Path) -> Self {
        let files =
            fs::read(path).ok().and_then(|text| serde_json::from_slice(&text).ok()).unwrap_or_default();
        Self { files: Mutex::new(files), seen: Mutex::default() }
    }

    /// Keeps them.
    ///
    /// # Errors
    /// [`DataError`] if the file cannot be written.
    pub fn write(&self, path: &Path) -> DataResult<()> {
        let files = locked(&self.files);
        atomic::write(path, Overwrite::Replace, |out| Ok(serde_json::to_writer(out, &*files)?))
    }

    /// The hash of a file, or of all files below a folder. What is not there has one, too.
    pub(super) fn of(&self, path: &Path) -> DataResult<Content> {
        let slot = Arc::clone(locked(&self.seen).entry(path.to_path_buf()).or_default());
        let mut slot = locked(&slot);
        if let Some(content) = &*slot {
            return Ok(content.clone());
        }
        if is_address(path) {
            let known = place::identity(path)?;
            let content = known.map_or_else(missing, |(hash, certain)| Content { hash, sampled: !certain });
            *slot = Some(content.clone());
            return Ok(content);
        }
        let failed = |e: io::Error| DataError::new("cannot be read").at(path).because(e);
        let content = match fs::metadata(path) {
            Ok(meta) if meta.is_dir() => self.folder(path).map_err(failed)?,
            Ok(meta) => self.file(path, &meta).map_err(failed)?,
            Err(_) => missing(),
        };
        *slot = Some(content.clone());
        Ok(content)
    }

    /// What makes two files the same scan: their content, or for one that is not hashed whole also where it lies.
    pub(super) fn identity(&self, path: &Path) -> Option<String> {
        let content = self.of(path).ok()?;
        if content.sampled {
            Some(format!("{} {}", content.hash, path.display()))
        } else {
            Some(content.hash)
        }
    }

    fn folder(&self, path: &Path) -> io::Result<Content> {
        let mut files = Vec::new();
        walk(path, DEEPEST, &mut files)?;
        files.sort_by(|a, b| a.0.cmp(&b.0));
        let (mut hasher, mut sampled) = (Sha256::new(), false);
        for (file, meta) in files {
            let content = self.file(&file, &meta)?;
            sampled |= content.sampled;
            let name = file.strip_prefix(path).unwrap_or(&file).to_string_lossy().into_owned();
            hasher.update(format!("{}\0{}\n", name, content.hash));
        }
        Ok(Content { hash: hex(&hasher.finalize()), sampled })
    }

    fn file(&self, path: &Path, meta: &Metadata) -> io::Result<Content> {
        let modified = meta.modified().unwrap_or(UNIX_EPOCH);
        let since = modified.duration_since(UNIX_EPOCH).unwrap_or_default();
        let (size, modified_ns) = (meta.len(), u64::try_from(since.as_nanos()).unwrap_or(u64::MAX));
        let name = path.canonicalize()?.to_str().map(str::to_string);
        if let Some(name) = &name {
            let files = locked(&self.files);
            let known = files.get(name).filter(|k| (k.size, k.modified_ns) == (size, modified_ns));
            if let Some(known) = known {
                return Ok(known.content.clone());
            }
        }
        let content = hashed(path, size)?;
        let settled = SystemTime::now().duration_since(modified).is_ok_and(|age| age > FRESH);
        if let Some(name) = name.filter(|_| settled) {
            locked(&self.files).insert(name, Known { size, modified_ns, content: content.clone() });
        }
        Ok(content)
    }
}

/// All files below a folder, links followed.
fn walk(folder: &Path, deepest: usize, files: &mut Vec<(PathBuf, Metadata)>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        // A link to nothing is nothing.
        let Ok(meta) = fs::metadata(&path) else { continue };
        if meta.is_file() {
            files.push((path, meta));
        } else if meta.is_dir() && deepest > 0 {
            walk(&path, deepest - 1, files)?;
        }
    }
    Ok(())
}

fn hashed(path: &Path, size: u64) -> io::Result<Content> {
    let mut file = File::open(path)?;
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let mut hasher = Sha256::new();
    let blocks: Vec<(u64, u64)> = if IMAGES.contains(&ending.as_str()) && size > 2 * IMAGE_BYTES {
        vec![(0, IMAGE_BYTES), (size - IMAGE_BYTES, IMAGE_BYTES)]
    } else if size > WHOLE_BYTES {
        (0..BLOCKS)
            .map(|k| ((size - BLOCK_BYTES) / (BLOCKS - 1) * k, BLOCK_BYTES))
            .chain([(size - BLOCK_BYTES, BLOCK_BYTES)])
            .collect()
    } else {
        vec![(0, size)]
    };
    hasher.update(format!("{size} {}\n", blocks.len()));
    let mut buffer = vec![0; BLOCK_BYTES as usize];
    for (at, length) in blocks {
        file.seek(SeekFrom::Start(at))?;
        let mut part = (&mut file).take(length);
        loop {
            match part.read(&mut buffer)? {
                0 => break,
                n => hasher.update(&buffer[..n]),
            }
        }
    }
    Ok(Content { hash: hex(&hasher.finalize()), sampled: size > WHOLE_BYTES })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_is_known_by_its_bytes_and_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        fs::create_dir(path.join("a")).unwrap();
        fs::write(path.join("a/x.csv"), "1").unwrap();
        let of = || Hashes::default().of(&path.join("a")).unwrap();
        let first = of();
        assert_eq!(of(), first);
        fs::write(path.join("a/x.csv"), "2").unwrap();
        assert_ne!(of(), first);
        fs::write(path.join("a/x.csv"), "1").unwrap();
        assert_eq!(of(), first);
        fs::rename(path.join("a/x.csv"), path.join("a/y.csv")).unwrap();
        assert_ne!(of(), first);
        assert_eq!(Hashes::default().of(&path.join("no")).unwrap().hash, "missing");
    }

    #[test]
    fn what_is_large_is_sampled_and_says_so() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large.bag");
        let file = File::create(&path).unwrap();
        file.set_len(WHOLE_BYTES + 12345).unwrap();
        let first = Hashes::default().of(&path).unwrap();
        assert!(first.sampled);
        file.set_len(WHOLE_BYTES + 12346).unwrap();
        assert_ne!(Hashes::default().of(&path).unwrap().hash, first.hash);
    }

    #[test]
    fn a_kept_hash_is_used_while_size_and_time_are_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let (path, kept) = (folder.path().join("x.csv"), folder.path().join("hashes.json"));
        fs::write(&path, "1").unwrap();
        let old = SystemTime::now() - Duration::from_secs(100);
        let set = |time| File::options().write(true).open(&path).unwrap().set_modified(time).unwrap();
        set(old);
        let hashes = Hashes::default();
        let first = hashes.of(&path).unwrap();
        hashes.write(&kept).unwrap();
        fs::write(&path, "2").unwrap();
        set(old);
        assert_eq!(Hashes::read(&kept).of(&path).unwrap(), first, "nothing tells that it changed");
        set(old + Duration::from_secs(1));
        assert_ne!(Hashes::read(&kept).of(&path).unwrap(), first);
    }
}
