//! Containers: ROS 1 bags, MCAP and rosbag2 sqlite3 behind one reader, which knows nothing of what messages mean.
//!
//! A recording is walked once from its first to its last record ([`Recording::scan`]); messages are read again one by
//! one where they are asked for ([`Recording::read`]). The walk does not need the index that a recorder writes when it
//! is stopped properly, so a recording that was cut off reads like any other, as far as it goes.

mod ahead;
mod block;
mod bytes;
mod claims;
mod db3;
mod find;
mod indexed;
mod mcap;
mod mcap_index;
mod ros1;
mod unpack;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;

pub(crate) use find::{Found, find};

/// Bytes of a message that [`Want::Head`] promises, where the message has as many.
pub(crate) const HEAD_BYTES: usize = 1024;
/// Bytes beyond which a message is refused.
pub(crate) const MAX_MESSAGE_BYTES: u64 = 1 << 30;

/// How the messages of a topic are serialised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// ROS 1.
    Ros1,
    /// ROS 2: CDR with its four byte encapsulation.
    Cdr,
    /// Something else, which is listed but not read.
    Other,
}

impl Encoding {
    fn from_name(name: &str) -> Self {
        match name {
            "ros1" => Self::Ros1,
            "cdr" => Self::Cdr,
            _ => Self::Other,
        }
    }
}

/// A topic: several connections of the same name and type are one.
#[derive(Clone, Debug)]
pub(crate) struct Topic {
    /// Its name, such as `/odom`.
    pub(crate) name: String,
    /// Type of its messages in the short form, such as `nav_msgs/Odometry`.
    pub(crate) kind: String,
    /// How they are serialised.
    pub(crate) encoding: Encoding,
    /// The name that the recording has for that, such as `cdr` or `json`.
    pub(crate) format: String,
    /// How many there are.
    pub(crate) count: u64,
    /// Record times of the earliest and the latest.
    pub(crate) recorded: Option<(Stamp, Stamp)>,
}

impl Topic {
    /// Whether it has messages, in an encoding that is read.
    pub(crate) fn is_read(&self) -> bool {
        self.count > 0 && self.encoding != Encoding::Other
    }

    fn note(&mut self, recorded: Stamp, count: u64) {
        self.count += count;
        let (first, last) = self.recorded.unwrap_or((recorded, recorded));
        self.recorded = Some((first.min(recorded), last.max(recorded)));
    }
}

/// Where a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Locator {
    /// Which file of the recording.
    pub(crate) file: u32,
    /// Which block of the file; unused in a data base.
    block: u32,
    /// Offset of the first byte in the block, or the row of a data base.
    at: u64,
    /// Bytes; unused in a data base.
    bytes: u32,
}

/// What a visitor wants of a topic's messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Want {
    /// Only to be counted.
    Nothing,
    /// The first [`HEAD_BYTES`].
    Head,
    /// All bytes.
    All,
}

/// A message as a visitor sees it.
pub(crate) struct Message<'a> {
    /// Its topic, an index into [`Scan::topics`].
    pub(crate) topic: usize,
    /// How it is serialised.
    pub(crate) encoding: Encoding,
    /// When it was recorded, which is later than when it was measured.
    pub(crate) recorded: Stamp,
    /// What was asked for.
    pub(crate) bytes: &'a [u8],
    /// Where it is.
    pub(crate) locator: Locator,
}

/// Sees the messages of a recording in the order in which they were written.
pub(crate) trait Visitor {
    /// Asked once a topic that can be read, before its first message.
    fn want(&mut self, topic: usize, info: &Topic) -> Want;
    /// A message of a topic that is wanted.
    fn message(&mut self, message: &Message<'_>);
}

/// What a walk found beside messages.
#[derive(Debug, Default)]
pub(crate) struct Scan {
    /// All topics, in the order in which they were first seen.
    pub(crate) topics: Vec<Topic>,
    /// Damage that was passed over, one line each with the byte.
    pub(crate) damage: Vec<String>,
    by_name: HashMap<(String, String, String), usize>,
    wants: Vec<Want>,
}

impl Scan {
    /// The index of a topic; `kind` may be in the long form of ROS 2, `nav_msgs/msg/Odometry`.
    fn topic(&mut self, name: &str, kind: &str, format: &str, visitor: &mut dyn Visitor) -> usize {
        let kind = kind.replace("/msg/", "/");
        let key = (name.to_string(), kind, format.to_string());
        if let Some(&topic) = self.by_name.get(&key) {
            return topic;
        }
        let topic = self.topics.len();
        let encoding = Encoding::from_name(format);
        let (name, kind, format) = key.clone();
        let info = Topic { name, kind, encoding, format, count: 0, recorded: None };
        let readable = encoding != Encoding::Other;
        self.wants.push(if readable { visitor.want(topic, &info) } else { Want::Nothing });
        self.topics.push(info);
        self.by_name.insert(key, topic);
        topic
    }

    fn damaged(&mut self, error: &DataError) {
        self.damage.push(error.to_string());
    }
}

/// The bytes of a message, alone or as a part of the block they were decompressed with.
pub(crate) enum Payload {
    Alone(Vec<u8>),
    Part { block: Arc<Vec<u8>>, from: usize, to: usize },
}

impl Payload {
    /// The bytes.
    pub(crate) fn bytes(&self) -> &[u8] {
        match self {
            Self::Alone(bytes) => bytes,
            Self::Part { block, from, to } => &block[*from..*to],
        }
    }
}

/// One file.
trait Container: Send + Sync {
    fn scan(&self, file: u32, scan: &mut Scan, visitor: &mut dyn Visitor) -> DataResult<()>;
    fn read(&self, locator: &Locator) -> DataResult<Payload>;
    /// The byte of the file that names a message in an error.
    fn byte(&self, locator: &Locator) -> Option<u64>;
}

/// A recording of one or several files, read as one.
pub(crate) struct Recording {
    files: Vec<(PathBuf, Box<dyn Container>)>,
    /// Files that had to be copied to be read, until the recording is closed.
    _copies: Vec<unpack::Copy>,
    /// What was damaged already when the files were opened.
    damage: Vec<String>,
}

impl Recording {
    /// Opens what [`find`] found.
    pub(crate) fn open(found: &Found) -> DataResult<Self> {
        let mut files: Vec<(PathBuf, Box<dyn Container>)> = Vec::new();
        let (mut copies, mut damage) = (Vec::new(), Vec::new());
        for path in &found.files {
            let (kind, packed) = find::kind_of(path).map_err(|e| e.at(path))?;
            let mut copy = if packed { Some(unpack::unpack(path)?) } else { None };
            if kind == find::Kind::Sqlite && !packed && unpack::has_log(path) {
                let log = unpack::log_of(path);
                match unpack::with_log(path) {
                    Ok(merged) => {
                        copy = Some(merged);
                        let problem =
                            "the recorder was not stopped properly: what is here is read with the data base";
                        damage.push(DataError::new(problem).at(log).to_string());
                    }
                    Err(e) => damage.push(
                        DataError::new(format!(
                            "what sqlite had not merged into the data base is not read: {e}"
                        ))
                        .at(&log)
                        .hint("open a copy once with sqlite3 to merge it")
                        .to_string(),
                    ),
                }
            }
            let problem = copy.as_ref().and_then(|copy| copy.damage.as_deref());
            damage.extend(problem.map(|problem| DataError::new(problem).at(path).to_string()));
            // What is said is said of the file that the user has.
            let place = copy.as_ref().map_or(path.as_path(), |copy| copy.path.as_path());
            let container: Box<dyn Container> = match kind {
                find::Kind::Ros1 => Box::new(ros1::open(path, place)?),
                find::Kind::Mcap => Box::new(mcap::open(path, place)?),
                find::Kind::Sqlite => {
                    Box::new(db3::Db3::open(path, place, found.compressed_messages, copy.is_some())?)
                }
            };
            files.push((path.clone(), container));
            copies.extend(copy);
        }
        Ok(Self { files, _copies: copies, damage })
    }

    /// Walks all files.
    ///
    /// Damage inside is passed over and kept in [`Scan::damage`].
    ///
    /// # Errors
    /// [`DataError`] if a file cannot be read at all.
    pub(crate) fn scan(&self, visitor: &mut dyn Visitor) -> DataResult<Scan> {
        let mut scan = Scan { damage: self.damage.clone(), ..Scan::default() };
        for (file, (path, container)) in (0_u32..).zip(&self.files) {
            container.scan(file, &mut scan, visitor).map_err(|e| e.at(path))?;
        }
        Ok(scan)
    }

    /// Reads a message.
    ///
    /// # Errors
    /// [`DataError`] with the byte if its block is damaged.
    pub(crate) fn read(&self, locator: &Locator) -> DataResult<Payload> {
        let (path, container) = &self.files[locator.file as usize];
        container.read(locator).map_err(|e| e.at(path))
    }

    /// Adds file and byte of a message to an error.
    pub(crate) fn place(&self, locator: &Locator, error: DataError) -> DataError {
        let (path, container) = &self.files[locator.file as usize];
        match container.byte(locator) {
            Some(byte) => error.at(path).byte(byte),
            None => error.at(path),
        }
    }

    /// The files.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &Path> {
        self.files.iter().map(|(path, _)| path.as_path())
    }
}

#[cfg(test)]
mod elsewhere_tests;
#[cfg(test)]
mod tests;
