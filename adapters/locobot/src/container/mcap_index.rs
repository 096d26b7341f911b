//! The index at the end of an MCAP file: where its chunks are, so that one that lies elsewhere need not be walked.

use std::collections::BTreeMap;
use std::sync::Arc;

use mcap::records::{ChunkIndex, Record, op};
use vice_core::error::DataResult;
use vice_core::time::Stamp;

use super::block::{Block, BlockFile, Compression};
use super::indexed::{Indexed, Listed};

/// Bytes of a record before its content: the opcode and the length.
const PREFIX: u64 = 9;
/// Bytes of the footer with its prefix, and of the magic behind it.
const FOOTER: u64 = PREFIX + 20;
const MAGIC: u64 = 8;
/// Bytes beyond which an index is left alone: the file is walked.
const MAX_INDEX_BYTES: u64 = 64 << 20;

/// A chunk by the index, and where the walk goes on behind it and the places of its messages.
pub(super) struct Known {
    pub(super) block: Block,
    pub(super) end: u64,
}

/// The chunks by where they start. Empty where there is no index, or one that cannot be right: then the walk finds them.
pub(super) fn chunks(file: &BlockFile) -> DataResult<BTreeMap<u64, Known>> {
    let none = BTreeMap::new();
    let len = file.len();
    let Some(footer_at) = len.checked_sub(FOOTER + MAGIC) else { return Ok(none) };
    let footer = file.read_vec(footer_at, FOOTER)?;
    let summary_at = match mcap::parse_record(op::FOOTER, &footer[PREFIX as usize..]) {
        Ok(Record::Footer(footer_record)) if footer[0] == op::FOOTER => footer_record.summary_start,
        _ => return Ok(none),
    };
    let summary_len = footer_at.checked_sub(summary_at).filter(|n| summary_at > 0 && *n <= MAX_INDEX_BYTES);
    let Some(summary_len) = summary_len else { return Ok(none) };
    let summary = file.read_vec(summary_at, summary_len)?;
    let mut known = BTreeMap::new();
    for (opcode, body) in records(&summary) {
        if opcode != op::CHUNK_INDEX {
            continue;
        }
        let Ok(Record::ChunkIndex(index)) = mcap::parse_record(opcode, body) else { return Ok(none) };
        let Some(chunk) = chunk(&index, summary_at) else { return Ok(none) };
        known.insert(index.chunk_start_offset, chunk);
    }
    Ok(known)
}

/// A chunk as its index has it, if that can be.
fn chunk(index: &ChunkIndex, before: u64) -> Option<Known> {
    let compression = Compression::from_name(&index.compression).ok()?;
    let head = PREFIX + 40 + index.compression.len() as u64;
    let offset = index.chunk_start_offset.checked_add(head)?;
    let places_at = index.chunk_start_offset.checked_add(index.chunk_length)?;
    let end = places_at.checked_add(index.message_index_length)?;
    let stored = index.compressed_size;
    let fits = offset.checked_add(stored)? == places_at && end <= before;
    let same = compression != Compression::None || stored == index.uncompressed_size;
    // Without a list of their places all messages may be wanted.
    let indexed = (index.message_index_length > 0).then(|| Indexed {
        places: places_at..end,
        channels: index.message_index_offsets.keys().map(|c| u32::from(*c)).collect(),
        crc_at: index.chunk_start_offset + PREFIX + 24,
    });
    let size = index.uncompressed_size;
    (fits && same).then(|| Known {
        block: Block {
            offset,
            stored,
            size,
            compression,
            crc: None,
            cut: false,
            indexed: indexed.map(Arc::new),
        },
        end,
    })
}

/// The messages that the index behind a chunk lists.
pub(super) fn listed(bytes: &[u8]) -> Option<Vec<Listed>> {
    let mut all = Vec::new();
    for (opcode, body) in records(bytes) {
        let Ok(Record::MessageIndex(index)) = mcap::parse_record(opcode, body) else { return None };
        all.extend(index.records.iter().map(|entry| Listed {
            channel: u32::from(index.channel_id),
            recorded: Stamp::from_nanos(i64::try_from(entry.log_time).unwrap_or(i64::MAX)),
            at: entry.offset,
        }));
    }
    Some(all)
}

/// Records one after the other; ends where one is cut off.
fn records(mut bytes: &[u8]) -> impl Iterator<Item = (u8, &[u8])> {
    std::iter::from_fn(move || {
        let (head, rest) = bytes.split_at_checked(PREFIX as usize)?;
        let len = usize::try_from(u64::from_le_bytes(head[1..].try_into().ok()?)).ok()?;
        let (body, rest) = rest.split_at_checked(len)?;
        bytes = rest;
        Some((head[0], body))
    })
}
