//! Depth images of one camera: 16 bit PNGs in `lossless.tar`, which is indexed and never unpacked, or in `images/`.
//!
//! A count is 50 m / 2^16, along the optical axis.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use tar::{Archive, EntryType};
use vice_core::dataset::DepthImage;
use vice_core::error::{DataError, DataResult};
use vice_core::time::{Span, Stamp};
use vice_files::{image_file, paths};
use vice_video::{check_count, read_stamps};

use crate::layout::{STAMPS, pictures};

/// Metres that a count is worth.
pub(crate) const METRES_PER_COUNT: f64 = 50.0 / 65536.0;

/// A depth camera.
#[derive(Debug)]
pub(crate) struct DepthFrames {
    folder: PathBuf,
    opened: OnceLock<Opened>,
}

#[derive(Debug)]
struct Opened {
    stamps: Arc<[Stamp]>,
    pictures: Pictures,
}

#[derive(Debug)]
enum Pictures {
    Tar { path: PathBuf, entries: Vec<Entry> },
    Files(Vec<PathBuf>),
}

/// A file in an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Entry {
    name: String,
    at: u64,
    bytes: u64,
}

impl DepthFrames {
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self { folder, opened: OnceLock::new() }
    }

    /// Whether there is anything to read.
    pub(crate) fn is_there(&self) -> bool {
        self.folder.join("lossless.tar").is_file() || self.folder.join("images").is_dir()
    }

    /// The depth image nearest to a stamp and at most `reach` away; `None` where there is none.
    ///
    /// # Errors
    /// [`DataError`] if the archive, the stamps or the image cannot be used, or the image has another size.
    pub(crate) fn nearest(
        &self,
        stamp: Stamp,
        reach: Span,
        size: (u32, u32),
    ) -> DataResult<Option<DepthImage>> {
        let Opened { stamps, pictures } = self.opened()?;
        let after = stamps.partition_point(|s| *s < stamp);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten().filter(|i| *i < stamps.len());
        let Some(index) = near.min_by_key(|i| stamps[*i].since(stamp).abs()) else { return Ok(None) };
        if stamps[index].since(stamp).abs() > reach {
            return Ok(None);
        }
        let (bytes, source) = match pictures {
            Pictures::Files(files) => (image_file::read_bytes(&files[index])?, files[index].clone()),
            Pictures::Tar { path, entries } => {
                let entry = &entries[index];
                (read_entry(path, entry)?, path.join(&entry.name))
            }
        };
        let image = image_file::decode_depth_png(&bytes, stamps[index], METRES_PER_COUNT)
            .map_err(|e| e.at(&source))?;
        if (image.width(), image.height()) != size {
            let ((width, height), (expected_width, expected_height)) =
                ((image.width(), image.height()), size);
            return Err(DataError::new(format!(
                "is {width}x{height} pixels, the camera's are {expected_width}x{expected_height}"
            ))
            .at(&source));
        }
        Ok(Some(image))
    }

    fn opened(&self) -> DataResult<&Opened> {
        if let Some(opened) = self.opened.get() {
            return Ok(opened);
        }
        let stamps_path = self.folder.join(STAMPS);
        let stamps = read_stamps(&stamps_path)?;
        let (images, path) = (self.folder.join("images"), self.folder.join("lossless.tar"));
        let files = pictures(&images, &["png"]);
        let pictures = if files.is_empty() && path.is_file() {
            let entries = index(&path).map_err(|e| e.at(&path))?;
            check_count(&stamps_path, stamps.len(), &path, entries.len())?;
            Pictures::Tar { path, entries }
        } else {
            check_count(&stamps_path, stamps.len(), &images, files.len())?;
            Pictures::Files(files)
        };
        Ok(self.opened.get_or_init(|| Opened { stamps, pictures }))
    }
}

/// PNGs of an archive in the order of their numbers, found by walking its headers.
///
/// # Errors
/// [`DataError`] with the byte offset for a name that climbs out, a link or device, or an archive that is cut off.
fn index(path: &Path) -> DataResult<Vec<Entry>> {
    let failed = |e: std::io::Error| DataError::new("is no tar archive that can be read").because(e);
    let file = File::open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    let mut entries = Vec::new();
    let mut archive = Archive::new(file);
    let mut end = 0;
    for entry in archive.entries_with_seek().map_err(failed)? {
        let entry = entry.map_err(|e| failed(e).byte(end))?;
        let (at, bytes) = (entry.raw_file_position(), entry.size());
        let header = entry.raw_header_position();
        end = at.saturating_add(bytes);
        let name = String::from_utf8(entry.path_bytes().into_owned())
            .map_err(|_| DataError::new("holds a file name that is not UTF-8").byte(header))?;
        paths::check_relative(&name).map_err(|e| DataError::new(e.problem().to_string()).byte(header))?;
        match entry.header().entry_type() {
            EntryType::Directory | EntryType::XGlobalHeader => continue,
            EntryType::Regular | EntryType::Continuous => {}
            _ => {
                return Err(DataError::new(format!("`{name}` is a link or a device, not a file"))
                    .byte(header)
                    .hint("the archive is not one of the data set's"));
            }
        }
        if end > length {
            let there = length.saturating_sub(at);
            return Err(
                DataError::new(format!("is cut off: `{name}` has {bytes} bytes, {there} are there")).byte(at)
            );
        }
        let base = name.rsplit('/').next().unwrap_or_default();
        if !base.starts_with('.') && base.to_ascii_lowercase().ends_with(".png") {
            entries.push(Entry { name, at, bytes });
        }
    }
    entries.sort_by(|a, b| (a.name.len(), &a.name).cmp(&(b.name.len(), &b.name)));
    Ok(entries)
}

fn read_entry(path: &Path, entry: &Entry) -> DataResult<Vec<u8>> {
    let failed = |e: std::io::Error| DataError::new("cannot be read").at(path).byte(entry.at).because(e);
    let mut file = File::open(path).map_err(failed)?;
    file.seek(SeekFrom::Start(entry.at)).map_err(failed)?;
    // The index has checked that the archive is long enough; should it have shrunk, less is read.
    let mut bytes = Vec::new();
    file.take(entry.bytes).read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests;
