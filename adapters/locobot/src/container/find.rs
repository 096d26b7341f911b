//! Which files a path stands for: one recording, the parts of one, or several recordings.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::suspicion::Suspicion;
use vice_files::elsewhere;

use super::{db3, mcap, ros1, unpack};
use crate::names::list;

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

/// The kind of a file, and whether it is compressed as a whole.
pub(super) fn kind_of(path: &Path) -> DataResult<(Kind, bool)> {
    let head = match head(path)? {
        Some(head) => head,
        None => {
            let mut head = Vec::new();
            File::open(path)
                .and_then(|f| f.take(16).read_to_end(&mut head))
                .map_err(|e| DataError::new("cannot be read").because(e))?;
            head
        }
    };
    if let Some(kind) = kind_of_head(&head) {
        return Ok((kind, false));
    }
    if head.starts_with(unpack::ZSTD_MAGIC) {
        let packed = || DataError::new("the file is compressed as a whole").hint("unpack it with `zstd -d`");
        let inside = unpack::head(path, 16).map_err(|e| packed().because(e))?;
        let nothing = || packed().because(DataError::new("what is in it is no recording"));
        return kind_of_head(&inside).map(|kind| (kind, true)).ok_or_else(nothing);
    }
    match head.is_empty() {
        // All of it may be in the log.
        true if unpack::has_log(path) => Ok((Kind::Sqlite, false)),
        true => Err(DataError::new("the file is empty")),
        false => Err(DataError::new("is no ROS 1 bag, MCAP file or sqlite3 data base")),
    }
}

/// The first bytes of a file that lies elsewhere; `None` where it is here.
fn head(path: &Path) -> DataResult<Option<Vec<u8>>> {
    let Some(file) = elsewhere::find(path)? else { return Ok(None) };
    let mut head = vec![0; file.size_bytes().min(16) as usize];
    file.read_at(0, &mut head)?;
    Ok(Some(head))
}

/// Whether a file is a picture by its name, into which nobody looks for a recording.
fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|e| ["png", "jpg", "jpeg"].iter().any(|p| e.eq_ignore_ascii_case(p)))
}

fn kind_of_head(head: &[u8]) -> Option<Kind> {
    let magics: [(&[u8], Kind); 3] =
        [(ros1::MAGIC, Kind::Ros1), (mcap::MAGIC, Kind::Mcap), (db3::MAGIC, Kind::Sqlite)];
    magics.into_iter().find(|(magic, _)| head.starts_with(magic)).map(|(_, kind)| kind)
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
        head(path).map(drop)?;
        let parent = path.parent().filter(|p| p.join(METADATA).is_file());
        if !is_recording(path) {
            return Ok(Vec::new());
        }
        // A file of a rosbag2 folder: its description says whether messages are compressed.
        // That other files of it are missing is no reason not to read this one.
        let described = parent.and_then(|folder| described(folder).ok()?.found());
        let compressed_messages = described.is_some_and(|d| d.compressed_messages);
        return Ok(vec![Found { files: vec![path.to_path_buf()], compressed_messages, notes: Vec::new() }]);
    }
    for file in entries(path).iter().filter(|file| !is_picture(file)) {
        // Who cannot be reached now is no other format.
        head(file).map(drop)?;
    }
    let description = described(path)?;
    if let Description::Of(found) = description {
        return Ok(vec![found]);
    }
    if OTHER_DATA_SETS.iter().any(|name| path.join(name).exists()) {
        return Ok(Vec::new());
    }
    let mut found: Vec<Found> = Vec::new();
    for file in recordings(path) {
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
    if let Description::Useless(why) = description {
        for recording in &mut found {
            recording.notes.push(Suspicion::new("metadata-left-aside", "", format!("{why}: left aside")));
        }
    }
    for folder in entries(path).into_iter().filter(|p| p.is_dir()) {
        match described(&folder)? {
            Description::Of(described) => found.push(described),
            // A recorder that was killed before it wrote any description.
            Description::None | Description::Useless(_) => {}
        }
    }
    found.sort_by(|a, b| a.files.cmp(&b.files));
    Ok(found)
}

/// The recordings of a folder, parts in their order; of one that is there packed and unpacked the latter.
fn recordings(folder: &Path) -> Vec<PathBuf> {
    let all = entries(folder).into_iter().filter(|p| p.is_file() && !is_picture(p) && is_recording(p));
    let mut files: Vec<PathBuf> = all.collect();
    // Sorted by name, the unpacked one comes first.
    files.sort_by_key(|p| (split_name(p), p.clone()));
    files.dedup_by_key(|p| split_name(p));
    files
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
        // What a compressed file or a log holds is not looked into for this; the names are those of rosbag2.
        Ok((Kind::Sqlite, packed)) => {
            let named = unpack::unpacked_name(&path.to_string_lossy()).ends_with(".db3");
            (named && (packed || unpack::has_log(path))) || (!packed && db3::is_rosbag2(path))
        }
        Ok(_) => true,
        Err(_) => false,
    }
}

/// A name without the number at its end, `run_10.bag` as `(run.bag, 10)`, so that parts sort as numbers.
fn split_name(path: &Path) -> (String, Option<u64>) {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = unpack::unpacked_name(&name);
    let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
    let number = stem.rsplit_once('_').and_then(|(name, n)| Some((name.to_string(), n.parse().ok()?)));
    match number {
        Some((name, part)) => (format!("{name}.{ending}"), Some(part)),
        None => (format!("{stem}.{ending}"), None),
    }
}

/// What a folder's `metadata.yaml` says.
enum Description {
    /// There is none, or it is of something else.
    None,
    /// It cannot be used, and why.
    Useless(String),
    Of(Found),
}

impl Description {
    fn found(self) -> Option<Found> {
        match self {
            Self::Of(found) => Some(found),
            Self::None | Self::Useless(_) => None,
        }
    }
}

/// The recording that a folder's `metadata.yaml` describes, with the parts that it does not list.
fn described(folder: &Path) -> DataResult<Description> {
    let path = folder.join(METADATA);
    if !path.is_file() {
        return Ok(Description::None);
    }
    let metadata: Metadata = match vice_files::yaml::read(&path) {
        Ok(metadata) => metadata,
        // A metadata.yaml of something else is not our business; a recorder that crashed leaves an empty one.
        Err(e) => return Ok(Description::Useless(e.to_string())),
    };
    let information = metadata.rosbag2_bagfile_information;
    let mode = information.compression_mode.to_ascii_lowercase();
    if mode == "message" && information.compression_format != "zstd" {
        let problem = format!("unknown compression `{}`", information.compression_format);
        return Err(DataError::new(problem).at(&path).hint("known: zstd"));
    }
    let mut files: Vec<PathBuf> = Vec::new();
    for name in &information.relative_file_paths {
        let file = locate(folder, name).ok_or_else(|| {
            let there: Vec<String> = recordings(folder).iter().map(|p| file_name(p)).collect();
            let problem = format!("names {name}, which is missing");
            DataError::of_kind(ErrorKind::Missing, problem)
                .at(&path)
                .hint(format!("there are: {}; without {METADATA} they are read as they are", list(&there)))
        })?;
        if !files.contains(&file) {
            files.push(file);
        }
    }
    if files.is_empty() {
        return Ok(Description::Useless(format!("{} lists no file", path.display())));
    }
    let notes = add_unlisted(folder, &mut files).into_iter().collect();
    Ok(Description::Of(Found { files, compressed_messages: mode == "message", notes }))
}

/// The file that a description names, wherever the recorder was started, and packed or unpacked since.
fn locate(folder: &Path, name: &str) -> Option<PathBuf> {
    let in_folder = |name: &str| {
        let near = folder.join(Path::new(name).file_name().unwrap_or_default());
        let named = vice_files::paths::safe_join(folder, name).ok().filter(|p| p.is_file());
        named.or_else(|| near.is_file().then_some(near))
    };
    in_folder(name).or_else(|| unpack::other_names(name).iter().find_map(|other| in_folder(other)))
}

/// Adds the parts that a recorder wrote after the description: it was killed before it could list them.
fn add_unlisted(folder: &Path, files: &mut Vec<PathBuf>) -> Option<Suspicion> {
    let listed: Vec<(String, Option<u64>)> = files.iter().map(|p| split_name(p)).collect();
    let unlisted: Vec<PathBuf> =
        recordings(folder).into_iter().filter(|p| !listed.contains(&split_name(p))).collect();
    let is_part = |p: &&PathBuf| {
        let (stem, part) = split_name(p);
        part.is_some() && listed.iter().any(|(s, _)| *s == stem)
    };
    let (parts, others): (Vec<&PathBuf>, Vec<&PathBuf>) = unlisted.iter().partition(is_part);
    files.extend(parts.iter().map(|p| (*p).clone()));
    // Read in the order in which they were written, which is that of their numbers.
    if !parts.is_empty() && listed.iter().all(|(stem, part)| part.is_some() && *stem == listed[0].0) {
        files.sort_by_key(|p| split_name(p));
    }
    let names = |paths: &[&PathBuf]| list(&paths.iter().map(|p| file_name(p)).collect::<Vec<_>>());
    let mut said = Vec::new();
    if !parts.is_empty() {
        said.push(format!("{} not listed, but a part of the recording: read as well", names(&parts)));
    }
    if !others.is_empty() {
        said.push(format!("{} not listed and of another name: left out", names(&others)));
    }
    (!said.is_empty()).then(|| {
        let about = folder.join(METADATA).display().to_string();
        Suspicion::new("files-not-listed", about, said.join("; "))
            .advice("a recorder that was killed lists its last files no more; `ros2 bag reindex` lists them")
            .times(unlisted.len() as u64)
    })
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
