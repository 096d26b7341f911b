//! MCAP. Records are taken apart by the `mcap` crate (MIT, kept up by the format's authors); where they are in the file
//! is found here, since its readers want either the whole file in memory or the index at its end.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::records::{Record, op};
use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;

use super::block::{Block, BlockFile, Compression, Records, Source, State};
use super::indexed::Listed;
use super::mcap_index;
use super::unpack;
use super::{Container, HEAD_BYTES, Locator, MAX_MESSAGE_BYTES, Message, Payload, Scan, Visitor, Want};

/// What an MCAP file starts and ends with.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Bytes of a record before its content: the opcode and the length.
const PREFIX: u64 = 9;
/// Bytes of a message before its data: channel, sequence, log and publish time.
const MESSAGE_PREFIX: u64 = 22;
/// Bytes beyond which a schema or channel is nonsense.
const MAX_DESCRIPTION_BYTES: u64 = 16 << 20;

/// A file and where its chunks are.
pub(super) struct Mcap {
    path: PathBuf,
    file: Arc<BlockFile>,
    blocks: Vec<Block>,
    damage: Option<DataError>,
}

/// Finds the chunks of a file; messages outside of chunks are taken as chunks without compression.
///
/// The file lies at `place` where it had to be unpacked.
pub(super) fn open(path: &Path, place: &Path) -> DataResult<Mcap> {
    let file = BlockFile::open(path, place)?;
    // Here a walk is as quick as the index, and finds more.
    let known = if file.bytes.is_elsewhere() { mcap_index::chunks(&file)? } else { BTreeMap::new() };
    let mut source = file.window();
    if source.get(0, MAGIC.len())? != Some(MAGIC) {
        return Err(DataError::new("is not an MCAP file").at(path));
    }
    let mut blocks: Vec<Block> = Vec::new();
    let mut loose: Option<u64> = None;
    let mut damage = None;
    let mut at = MAGIC.len() as u64;
    let (mut closed, mut in_summary) = (false, false);
    while !closed {
        if let Some(chunk) = known.get(&at) {
            if let Some(from) = loose.take() {
                blocks.push(Block::plain(from, at));
            }
            blocks.push(chunk.block.clone());
            at = chunk.end;
            continue;
        }
        let Some((opcode, len)) = prefix(&mut source, at)? else {
            let problem = "the file is cut off: it was not closed or not copied to its end";
            damage = Some(DataError::new(problem).at(path).byte(at));
            break;
        };
        let end = at.saturating_add(PREFIX).saturating_add(len);
        let cut = end > file.len();
        if cut {
            let problem = format!("the file is cut off in a record that should end at byte {end}");
            damage = Some(DataError::new(problem).at(path).byte(file.len()));
        }
        let in_run = matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE);
        if in_run && !cut {
            loose.get_or_insert(at);
        } else if let Some(from) = loose.take() {
            // The summary repeats schemas and channels, which helps where the chunk with the first mention is damaged.
            let place = if in_summary { 0 } else { blocks.len() };
            blocks.insert(place, Block::plain(from, at));
        }
        match opcode {
            0 => {
                damage = Some(DataError::new("a record without a kind").at(path).byte(at));
                break;
            }
            op::CHUNK => match chunk(&mut source, at + PREFIX, len) {
                // Of one that lies elsewhere only parts are fetched, which its check sum is not of.
                Ok(block) if file.bytes.is_elsewhere() && block.compression == Compression::None => {
                    blocks.push(Block { crc: None, ..block });
                }
                Ok(block) => blocks.push(block),
                Err(e) => damage = Some(e.at(path).byte(at)),
            },
            op::DATA_END => in_summary = true,
            op::FOOTER => closed = true,
            _ => {}
        }
        if cut {
            break;
        }
        at = end;
    }
    if let Some(from) = loose {
        blocks.push(Block::plain(from, at));
    }
    if blocks.is_empty() {
        let error = DataError::new("the file has no messages").at(path);
        return Err(match damage {
            Some(cause) => error.because(cause),
            None => error,
        });
    }
    file.bytes.all_had()?;
    Ok(Mcap { path: path.to_path_buf(), file, blocks, damage })
}

impl Container for Mcap {
    fn scan(&self, file: u32, scan: &mut Scan, visitor: &mut dyn Visitor) -> DataResult<()> {
        self.damage.iter().for_each(|e| scan.damaged(e));
        self.file.scan(&self.blocks, &McapRecords, file, &self.path, scan, visitor)
    }

    fn read(&self, locator: &Locator) -> DataResult<Payload> {
        let payload = self.file.read(&self.blocks, locator)?;
        let plain = unpack::message(payload.bytes(), MAX_MESSAGE_BYTES);
        let plain = plain.map_err(|e| DataError::new("a compressed message is damaged").because(e))?;
        Ok(plain.map_or(payload, Payload::Alone))
    }

    fn byte(&self, locator: &Locator) -> Option<u64> {
        self.blocks.get(locator.block as usize).map(|b| b.offset)
    }
}

/// Opcode and length of the record at `at`; `None` at the end of the file.
fn prefix(source: &mut dyn Source, at: u64) -> DataResult<Option<(u8, u64)>> {
    let bytes: Option<[u8; 9]> = source.get(at, PREFIX as usize)?.and_then(|b| b.try_into().ok());
    Ok(bytes.map(|[opcode, len @ ..]| (opcode, u64::from_le_bytes(len))))
}

/// The chunk whose content starts at `at`: start and end time, size, check sum, compression and length, then records.
fn chunk(source: &mut dyn Source, at: u64, len: u64) -> DataResult<Block> {
    let wrong = || DataError::new("a chunk's header has wrong lengths");
    let long = |bytes: &[u8]| bytes.try_into().ok().map(u64::from_le_bytes);
    let short = |bytes: &[u8]| bytes.try_into().ok().map(u32::from_le_bytes);
    let head = source.get(at, 32)?.ok_or_else(wrong)?;
    let size = long(&head[16..24]).ok_or_else(wrong)?;
    let crc = short(&head[24..28]).ok_or_else(wrong)?;
    let name = short(&head[28..32]).ok_or_else(wrong)?;
    if name > 64 {
        return Err(wrong());
    }
    let rest = source.get(at + 32, name as usize + 8)?.ok_or_else(wrong)?;
    let (name_bytes, stored) = rest.split_at(name as usize);
    let stored = long(stored).ok_or_else(wrong)?;
    let compression = Compression::from_name(&String::from_utf8_lossy(name_bytes))?;
    let head_len = 40 + u64::from(name);
    if len.checked_sub(head_len) != Some(stored) {
        return Err(wrong());
    }
    let offset = at + head_len;
    let there = source.len().saturating_sub(offset);
    let cut = stored > there;
    let crc = (crc != 0 && !cut).then_some(crc);
    Ok(Block { offset, stored: stored.min(there), size, compression, crc, cut, indexed: None })
}

struct McapRecords;

impl Records for McapRecords {
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
            let Some((opcode, len)) = prefix(source, at)? else {
                return Err(DataError::new("cut off inside a record").byte(at));
            };
            let content = at + PREFIX;
            let end = content.saturating_add(len);
            if end > source.len() {
                return Err(DataError::new(format!("a record should end at byte {end}")).byte(at));
            }
            match opcode {
                op::SCHEMA | op::CHANNEL if len <= MAX_DESCRIPTION_BYTES => {
                    let body = source.get(content, len as usize)?.unwrap_or_default();
                    describe(opcode, body, state, scan, visitor).map_err(|e| e.byte(at))?;
                }
                op::MESSAGE => {
                    let wrong = || DataError::new("a message's header has wrong lengths").byte(at);
                    let data = len.checked_sub(MESSAGE_PREFIX).ok_or_else(wrong)?;
                    let head = source.get(content, MESSAGE_PREFIX as usize)?.ok_or_else(wrong)?;
                    let Ok(Record::Message { header, .. }) = mcap::parse_record(opcode, head) else {
                        return Err(wrong());
                    };
                    let Some(&topic) = state.topics.get(&u32::from(header.channel_id)) else {
                        state.orphans += 1;
                        at = end;
                        continue;
                    };
                    let recorded = Stamp::from_nanos(i64::try_from(header.log_time).unwrap_or(i64::MAX));
                    scan.topics[topic].note(recorded, 1);
                    let wanted = match scan.wants[topic] {
                        Want::Nothing => None,
                        Want::Head => Some(data.min(HEAD_BYTES as u64)),
                        Want::All => Some(data),
                    };
                    if let Some(wanted) = wanted.filter(|_| data <= MAX_MESSAGE_BYTES)
                        && let Some(bytes) = source.get(content + MESSAGE_PREFIX, wanted as usize)?
                    {
                        let in_budget = state.beyond_usual <= unpack::most_beyond_usual();
                        let plain = match in_budget && bytes.starts_with(unpack::ZSTD_MAGIC) {
                            true => {
                                let all =
                                    source.get(content + MESSAGE_PREFIX, data as usize)?.unwrap_or_default();
                                let limit = match scan.wants[topic] {
                                    Want::All => MAX_MESSAGE_BYTES,
                                    Want::Head | Want::Nothing => HEAD_BYTES as u64,
                                };
                                // One that is damaged is for whoever decodes it to complain about.
                                let unpacked = unpack::message(all, limit).ok().flatten();
                                let most = unpack::most_of_message(data).min(limit);
                                let length = unpacked.as_ref().map_or(most, |plain| plain.len() as u64);
                                state.beyond_usual += unpack::beyond_usual(data, length);
                                unpacked
                            }
                            false => None,
                        };
                        let bytes = match &plain {
                            Some(plain) => plain.as_slice(),
                            None => {
                                source.get(content + MESSAGE_PREFIX, wanted as usize)?.unwrap_or_default()
                            }
                        };
                        let (at, bytes_len) = (content + MESSAGE_PREFIX, data as u32);
                        let locator = Locator { file, block, at, bytes: bytes_len };
                        let encoding = scan.topics[topic].encoding;
                        visitor.message(&Message { topic, encoding, recorded, bytes, locator });
                    }
                }
                _ => {}
            }
            at = end;
        }
        Ok(())
    }

    fn listed(&self, index: &[u8]) -> Option<Vec<Listed>> {
        mcap_index::listed(index)
    }
}

fn describe(
    opcode: u8,
    body: &[u8],
    state: &mut State,
    scan: &mut Scan,
    visitor: &mut dyn Visitor,
) -> DataResult<()> {
    match mcap::parse_record(opcode, body) {
        Ok(Record::Schema { header, .. }) => {
            state.schemas.insert(header.id, header.name);
        }
        Ok(Record::Channel(channel)) => {
            let kind = state.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
            let topic = scan.topic(&channel.topic, &kind, &channel.message_encoding, visitor);
            state.topics.insert(u32::from(channel.id), topic);
        }
        Ok(_) => {}
        Err(e) => return Err(DataError::new("a schema or channel cannot be read").because(e)),
    }
    Ok(())
}
