//! ROS 1 bags, version 2.0 of the format: records of a header (fields `name=value`) and data.
//!
//! No crate reads them here. `rosbag` 0.6.3 (MIT or Apache-2.0, last release in 2024) maps the whole file into memory,
//! trusts the sizes in the headers, and refuses a bag without index, which is what a crashed recorder leaves behind.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;

use super::block::{Block, BlockFile, Compression, Records, Source, State};
use super::{
    Container, Encoding, HEAD_BYTES, Locator, MAX_MESSAGE_BYTES, Message, Payload, Scan, Visitor, Want,
};

/// What a bag starts with.
pub(super) const MAGIC: &[u8] = b"#ROSBAG V";
const VERSION: &[u8] = b"#ROSBAG V2.0\n";
/// Bytes beyond which a record's header is nonsense: it holds names and a few numbers.
const MAX_HEADER_BYTES: u32 = 1 << 16;

const OP_MESSAGE: u8 = 0x02;
const OP_BAG: u8 = 0x03;
const OP_CHUNK: u8 = 0x05;
const OP_CONNECTION: u8 = 0x07;

/// A bag and where its chunks are.
pub(super) struct Ros1 {
    path: PathBuf,
    file: Arc<BlockFile>,
    blocks: Vec<Block>,
    damage: Vec<DataError>,
}

/// Finds the chunks of a bag, which lies at `place` where it had to be unpacked.
pub(super) fn open(path: &Path, place: &Path) -> DataResult<Ros1> {
    let file = BlockFile::open(path, place)?;
    let mut source = file.window();
    let version = source.get(0, VERSION.len())?.unwrap_or_default();
    if version != VERSION {
        return Err(DataError::new("is not a bag of version 2.0")
            .at(path)
            .hint("`rosbag fix` converts older ones"));
    }
    let (mut blocks, mut damage) = (Vec::new(), Vec::new());
    let mut at = VERSION.len() as u64;
    let mut unindexed = false;
    let mut described: Option<(u64, u64)> = None;
    while at < file.len() {
        let record = match record(&mut source, at) {
            Ok(record) => record,
            Err(e) => {
                damage.push(e.at(path));
                break;
            }
        };
        let end = record.data_at.saturating_add(u64::from(record.data_len));
        let cut = end > file.len();
        match record.op {
            // The index repeats the connections, which helps where the chunk with the first mention is damaged.
            OP_CONNECTION if !cut => described = Some((described.map_or(at, |d| d.0), end)),
            OP_BAG => unindexed = record.index_pos == Some(0),
            OP_CHUNK => {
                let compression = Compression::from_name(&record.text).map_err(|e| e.at(path).byte(at))?;
                blocks.push(Block {
                    offset: record.data_at,
                    stored: u64::from(record.data_len).min(file.len() - record.data_at),
                    size: u64::from(record.size.unwrap_or(record.data_len)),
                    compression,
                    crc: None,
                    cut,
                    indexed: None,
                });
            }
            _ => {}
        }
        if cut {
            damage.push(
                DataError::new(format!("the bag is cut off in a record that should end at byte {end}"))
                    .at(path)
                    .byte(file.len()),
            );
        }
        at = end;
    }
    file.bytes.all_had().map_err(|e| e.at(path))?;
    if unindexed && damage.is_empty() {
        let problem = format!("the bag has no index: it was not closed; read up to byte {}", file.len());
        damage.push(DataError::new(problem).at(path).hint("`rosbag reindex` repairs it"));
    }
    if blocks.is_empty() {
        let cause = damage.into_iter().next();
        let error = DataError::new("the bag has no chunk of messages").at(path);
        return Err(match cause {
            Some(cause) => error.because(cause),
            None => error,
        });
    }
    if let Some((from, to)) = described {
        blocks.insert(0, Block::plain(from, to));
    }
    Ok(Ros1 { path: path.to_path_buf(), file, blocks, damage })
}

impl Container for Ros1 {
    fn scan(&self, file: u32, scan: &mut Scan, visitor: &mut dyn Visitor) -> DataResult<()> {
        self.damage.iter().for_each(|e| scan.damaged(e));
        self.file.scan(&self.blocks, &BagRecords, file, &self.path, scan, visitor)
    }

    fn read(&self, locator: &Locator) -> DataResult<Payload> {
        self.file.read(&self.blocks, locator)
    }

    fn byte(&self, locator: &Locator) -> Option<u64> {
        self.blocks.get(locator.block as usize).map(|b| b.offset)
    }
}

struct BagRecords;

impl Records for BagRecords {
    fn walk(
        &self,
        source: &mut dyn Source,
        (file, block): (u32, u32),
        state: &mut State,
        scan: &mut Scan,
        visitor: &mut dyn Visitor,
    ) -> DataResult<()> {
        let mut at = 0;
        while at < source.len() {
            let record = record(source, at)?;
            let end = record.data_at + u64::from(record.data_len);
            if end > source.len() {
                return Err(DataError::new(format!("a record should end at byte {end}")).byte(at));
            }
            let conn = record.conn.unwrap_or(u32::MAX);
            match record.op {
                OP_CONNECTION => {
                    let header = source.get(record.data_at, record.data_len as usize)?.unwrap_or_default();
                    let kind = fields(header).find(|f| f.0 == b"type").map(|f| text(f.1)).unwrap_or_default();
                    let topic = scan.topic(&record.text, &kind, "ros1", visitor);
                    state.topics.insert(conn, topic);
                }
                OP_MESSAGE => {
                    let Some(&topic) = state.topics.get(&conn) else {
                        state.orphans += 1;
                        at = end;
                        continue;
                    };
                    let recorded = record.time.unwrap_or_default();
                    scan.topics[topic].note(recorded, 1);
                    let len = match scan.wants[topic] {
                        Want::Nothing => None,
                        Want::Head => Some((record.data_len as usize).min(HEAD_BYTES)),
                        Want::All => Some(record.data_len as usize),
                    };
                    if let Some(len) = len.filter(|_| u64::from(record.data_len) <= MAX_MESSAGE_BYTES)
                        && let Some(bytes) = source.get(record.data_at, len)?
                    {
                        let locator = Locator { file, block, at: record.data_at, bytes: record.data_len };
                        visitor.message(&Message {
                            topic,
                            encoding: Encoding::Ros1,
                            recorded,
                            bytes,
                            locator,
                        });
                    }
                }
                _ => {}
            }
            at = end;
        }
        Ok(())
    }
}

/// The header of a record: the fields that are used here.
#[derive(Default)]
struct Record {
    op: u8,
    conn: Option<u32>,
    size: Option<u32>,
    index_pos: Option<u64>,
    time: Option<Stamp>,
    /// Topic of a connection or compression of a chunk.
    text: String,
    data_at: u64,
    data_len: u32,
}

fn record(source: &mut dyn Source, at: u64) -> DataResult<Record> {
    let cut = || DataError::new("cut off inside a record").byte(at);
    let header_len = word(source.get(at, 4)?).ok_or_else(cut)?;
    if header_len > MAX_HEADER_BYTES {
        return Err(DataError::new(format!("a record's header claims {header_len} bytes")).byte(at));
    }
    let header = source.get(at + 4, header_len as usize)?.ok_or_else(cut)?;
    let mut record = Record::default();
    let mut taken = 0;
    for (name, value) in fields(header) {
        taken += 4 + name.len() + 1 + value.len();
        match name {
            b"op" => record.op = value.first().copied().unwrap_or_default(),
            b"conn" => record.conn = word(Some(value)),
            b"size" => record.size = word(Some(value)),
            b"index_pos" => record.index_pos = value.try_into().ok().map(u64::from_le_bytes),
            b"topic" | b"compression" => record.text = text(value),
            b"time" => {
                record.time = value.first_chunk::<8>().map(|v| {
                    let (secs, nanos) = (word(Some(&v[..4])), word(Some(&v[4..])));
                    let nanos = i64::from(nanos.unwrap_or_default());
                    Stamp::from_nanos(i64::from(secs.unwrap_or_default()) * 1_000_000_000 + nanos)
                });
            }
            _ => {}
        }
    }
    if taken != header.len() || record.op == 0 {
        return Err(DataError::new("a record's header has wrong lengths").byte(at));
    }
    let len_at = at + 4 + u64::from(header_len);
    record.data_len = word(source.get(len_at, 4)?).ok_or_else(cut)?;
    record.data_at = len_at + 4;
    Ok(record)
}

/// The fields of a header; ends where one has a wrong length.
fn fields(mut header: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    std::iter::from_fn(move || {
        let len = word(header.get(..4))? as usize;
        let field = header.get(4..)?.get(..len)?;
        header = &header[4 + len..];
        let equals = field.iter().position(|b| *b == b'=')?;
        Some((&field[..equals], &field[equals + 1..]))
    })
}

fn word(bytes: Option<&[u8]>) -> Option<u32> {
    bytes.and_then(|b| b.try_into().ok()).map(u32::from_le_bytes)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
