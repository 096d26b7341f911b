//! What of a file that lies elsewhere will be read, by its index: so that it is fetched together, and no images are.
//!
//! Bytes decide, not the index: a walk that needs what was not foreseen reads that as well.

use std::ops::Range;
use std::sync::Arc;

use vice_core::error::DataResult;

use super::block::{Block, BlockFile, Compression, Records, State};
use super::indexed::{Indexed, Listed};
use super::{HEAD_BYTES, Scan, Want};

/// Blocks that are planned at once.
const BLOCKS_AHEAD: usize = 64;
/// Bytes that are fetched ahead, by which the memory for it is bounded.
const BYTES_AHEAD: u64 = 24 << 20;
/// Bytes that a record has before the data of its message, at most.
const RECORD_PREFIX: u64 = 64;

impl BlockFile {
    /// Fetches what of the blocks from `at` on is wanted, and gives up to which block that was.
    pub(super) fn look_ahead(
        &self,
        blocks: &[Block],
        at: usize,
        records: &dyn Records,
        state: &State,
        scan: &Scan,
    ) -> DataResult<usize> {
        if !self.bytes.is_elsewhere() {
            return Ok(blocks.len());
        }
        let foreseen = |b: &&Block| b.indexed.is_some() || b.compression != Compression::None;
        let mut stored = 0;
        let batch: Vec<&Block> = blocks[at..]
            .iter()
            .take_while(foreseen)
            .take(BLOCKS_AHEAD)
            .take_while(|b| {
                stored += if b.compression == Compression::None { 0 } else { b.stored };
                stored <= BYTES_AHEAD
            })
            .collect();
        let lists: Vec<Range<u64>> = batch
            .iter()
            .filter(|b| b.compression == Compression::None || unwanted(b, state, scan))
            .filter_map(|b| b.indexed.as_ref().map(|i| i.places.clone()))
            .collect();
        self.bytes.will_read(&lists)?;
        let (mut ranges, mut bytes) = (Vec::new(), 0);
        let mut planned = at;
        for block in batch {
            if block.compression == Compression::None {
                ranges.extend(self.parts(block, records, state, scan)?);
            } else if !unwanted(block, state, scan) {
                let from = block.indexed.as_ref().map_or(block.offset, |i| i.crc_at);
                ranges.push(from..block.offset + block.stored);
            }
            bytes = ranges.iter().map(|r| r.end - r.start).sum();
            planned += 1;
            if bytes > BYTES_AHEAD {
                break;
            }
        }
        if bytes <= 2 * BYTES_AHEAD {
            self.bytes.will_read(&ranges)?;
        }
        Ok(planned.max(at + 1))
    }

    /// The parts of a block that is not compressed in which there is what is wanted.
    fn parts(
        &self,
        block: &Block,
        records: &dyn Records,
        state: &State,
        scan: &Scan,
    ) -> DataResult<Vec<Range<u64>>> {
        let Some(listed) = self.listed(block, records)? else { return Ok(Vec::new()) };
        let ends = listed.iter().skip(1).map(|l| l.at).chain([block.stored]);
        let first = listed.first().map_or(block.stored, |l| l.at);
        let mut parts = Vec::with_capacity(listed.len() + 1);
        parts.push(block.offset..block.offset + first);
        for (message, end) in listed.iter().zip(ends) {
            let len = match wanted(message.channel, state, scan) {
                Want::All => end - message.at,
                Want::Head => HEAD_BYTES as u64 + RECORD_PREFIX,
                Want::Nothing => RECORD_PREFIX,
            };
            let from = block.offset + message.at;
            parts.push(from..from + len.min(end - message.at));
        }
        Ok(parts)
    }

    /// The messages of a block by their places; `None` where no index lists them, or one that cannot be right.
    fn listed(&self, block: &Block, records: &dyn Records) -> DataResult<Option<Vec<Listed>>> {
        let Some(indexed) = &block.indexed else { return Ok(None) };
        let bytes = self.bytes.read_vec(indexed.places.start, indexed.places.end - indexed.places.start)?;
        let Some(mut listed) = records.listed(&bytes) else { return Ok(None) };
        listed.sort_by_key(|l| l.at);
        let inside = listed.last().is_none_or(|l| l.at < block.size);
        Ok(Some(listed).filter(|_| inside))
    }

    /// Whether nothing of a block is wanted but how many messages it has, and it would have to be fetched for that.
    pub(super) fn only_counts(&self, block: &Block, state: &State, scan: &Scan) -> bool {
        self.bytes.is_elsewhere() && unwanted(block, state, scan)
    }

    /// Counts the messages of a block that nobody wants, so that it need not be fetched; false where that cannot be.
    pub(super) fn count_only(
        &self,
        block: &Block,
        records: &dyn Records,
        state: &State,
        scan: &mut Scan,
    ) -> DataResult<bool> {
        if !self.only_counts(block, state, scan) {
            return Ok(false);
        }
        let Some(listed) = self.listed(block, records)? else { return Ok(false) };
        if !listed.iter().all(|l| state.topics.contains_key(&l.channel)) {
            return Ok(false);
        }
        for message in listed {
            scan.topics[state.topics[&message.channel]].note(message.recorded, 1);
        }
        Ok(true)
    }
}

/// What is wanted of a channel; of one that is not known yet everything.
fn wanted(channel: u32, state: &State, scan: &Scan) -> Want {
    state.topics.get(&channel).map_or(Want::All, |topic| scan.wants[*topic])
}

/// Whether nothing of a compressed block is wanted, as far as its index says.
fn unwanted(block: &Block, state: &State, scan: &Scan) -> bool {
    let nothing = |i: &Arc<Indexed>| {
        !i.channels.is_empty() && i.channels.iter().all(|c| wanted(*c, state, scan) == Want::Nothing)
    };
    block.compression != Compression::None && block.indexed.as_ref().is_some_and(nothing)
}
