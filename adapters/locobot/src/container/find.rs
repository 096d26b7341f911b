//! Which files a path stands for: one recording, the parts of one, or several recordings.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use vice_core::error::{DataError, DataResult};
use vice_core::suspicion::Suspicion;

use super::{db3, mcap, ros1};

/// The file that describes a rosbag2 folder.
const METADATA: &str = "metadata.yaml";
/// Names in a folder of which a bag is but a by-product: the folder is a data set of another format.
const OTHER_DATA_SETS: [&str; 3] = ["mav0", "groundTruthPoses.csv", "rgb.txt"];

/// What a file is, by its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Ros1,
    Mcap,
    Sqlite,
}

/// The kind of a file.
pub(super) fn kind_of(path: &Path) -> DataResult<Kind> {
    let mut head = Vec::new();
    File::open(path)
        .and_then(|f| f.take(16).read_to_end(&mut head))
        .map_err(|e| DataError::new("cannot be read").because(e))?;
    if head.starts_with(ros1::MAGIC) {
        Ok(Kind::Ros1)
    } else if head.starts_with(mcap::MAGIC) {
        Ok(Kind::Mcap)
    } else if head.starts_with(db3::MAGIC) {
        Ok(Kind::Sqlite)
    } else if head.is_empty() {
        Err(DataError::new("the file is empty"))
    } else if head.starts_with(&[0x28, 0xb5, 0x2f, 0xfd]) {
        Err(DataError::new("the file is compressed as a whole").hint("unpack it with `zstd -d`"))
    } else {
        Err(DataError::new("is no ROS 1 bag, MCAP file or sqlite3 data base"))
    }
}

/// A recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Found {
    /// Its files in order.
    pub(crate) files: Vec<PathBuf>,
    /// Each message is compressed with zstd, as rosbag2 can do.
    pub(crate) compressed_messages: bool,
    /// What is strange about the folder.
    pub(crate) notes: Vec<Suspicion>,
}

#[derive(Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Information,
}

#[derive(Deserialize)]
struct Information {
    #[serde(default)]
    relative_file_paths: Vec<String>,
    #[serde(default)]
    compression_format: String,
    #[serde(default)]
    compression_mode: String,
}

/// The recordings that a path stands for; none where it is of another format.
///
/// # Errors
/// [`DataError`] if a `metadata.yaml` cannot be used.
pub(crate) fn find(path: &Path) -> DataResult<Vec<Found>> {
    if !path.is_dir() {
        let parent = path.parent().filter(|p| p.join(METADATA).is_file());
        if !is_recording(path) {
            return Ok(Vec::new());
        }
        // A file of a rosbag2 folder: its description says whether messages are compressed.
        // That other files of it are missing is no reason not to read this one.
        let described = parent.and_then(|folder| described(folder).ok().flatten());
        let compressed_messages = described.is_some_and(|d| d.compressed_messages);
        return Ok(vec![Found { files: vec![path.to_path_buf()], compressed_messages, notes: Vec::new() }]);
    }
    if let Some(found) = described(path)? {
        return Ok(vec![found]);
    }
    if OTHER_DATA_SETS.iter().any(|name| path.join(name).exists()) {
        return Ok(Vec::new());
    }
    let mut files: Vec<PathBuf> =
        entries(path).into_iter().filter(|p| p.is_file() && is_recording(p)).collect();
    files.sort_by_key(|p| split_name(p));
    let mut found: Vec<Found> = Vec::new();
    for file in files {
        let (stem, part) = split_name(&file);
        let last = found.last_mut().filter(|f| {
            let before = f.files.last().map(|p| split_name(p));
            part.is_some() && before.is_some_and(|(s, p)| s == stem && p.is_some())
        });
        match last {
            Some(last) => last.files.push(file),
            None => found.push(Found { files: vec![file], ..Found::default() }),
        }
    }
    for folder in entries(path).into_iter().filter(|p| p.is_dir()) {
        found.extend(described(&folder)?);
    }
    found.sort_by(|a, b| a.files.cmp(&b.files));
    Ok(found)
}

/// The entries of a folder by name; none where it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let read = std::fs::read_dir(folder);
    let mut paths: Vec<PathBuf> = read.into_iter().flatten().flatten().map(|e| e.path()).collect();
    paths.sort();
    paths
}

/// Whether a file has a fitting ending and the first bytes of a recording.
fn is_recording(path: &Path) -> bool {
    match kind_of(path) {
        Ok(Kind::Sqlite) => db3::is_rosbag2(path),
        Ok(_) => true,
        Err(_) => false,
    }
}

/// A name without the number at its end, `run_10.bag` as `(run.bag, 10)`, so that parts sort as numbers.
fn split_name(path: &Path) -> (String, Option<u64>) {
    let text = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let (stem, ending) = (text(path.file_stem()), text(path.extension()));
    let number = stem.rsplit_once('_').and_then(|(name, n)| Some((name.to_string(), n.parse().ok()?)));
    match number {
        Some((name, part)) => (format!("{name}.{ending}"), Some(part)),
        None => (format!("{stem}.{ending}"), None),
    }
}

/// The recording that a folder's `metadata.yaml` describes.
fn described(folder: &Path) -> DataResult<Option<Found>> {
    let path = folder.join(METADATA);
    if !path.is_file() {
        return Ok(None);
    }
    let metadata: Metadata = match vice_files::yaml::read(&path) {
        Ok(metadata) => metadata,
        // A metadata.yaml of something else is not our business; a recorder that crashed leaves an empty one.
        Err(e) => {
            tracing::warn!("{e}: left aside");
            return Ok(None);
        }
    };
    let information = metadata.rosbag2_bagfile_information;
    let mode = information.compression_mode.to_ascii_lowercase();
    if mode == "message" && information.compression_format != "zstd" {
        let problem = format!("unknown compression `{}`", information.compression_format);
        return Err(DataError::new(problem).at(&path).hint("known: zstd"));
    }
    let mut files = Vec::new();
    for name in &information.relative_file_paths {
        // Old recorders wrote paths from where they were started.
        let near = folder.join(Path::new(name).file_name().unwrap_or_default());
        let named = vice_files::paths::safe_join(folder, name).ok().filter(|p| p.is_file());
        let file = named.or_else(|| near.is_file().then_some(near));
        let file = file.ok_or_else(|| DataError::new(format!("names {name}, which is missing")).at(&path))?;
        files.push(file);
    }
    if files.is_empty() {
        return Ok(None);
    }
    Ok(Some(Found { files, compressed_messages: mode == "message", notes: Vec::new() }))
}
