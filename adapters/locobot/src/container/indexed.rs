//! What the index of a file says of its blocks.

use std::ops::Range;

use vice_core::time::Stamp;

/// What the index of a file says of a block.
#[derive(Clone, Debug)]
pub(super) struct Indexed {
    /// Where the places of its messages are listed.
    pub(super) places: Range<u64>,
    /// Channels of its messages.
    pub(super) channels: Vec<u32>,
    /// Where its header has the check sum.
    pub(super) crc_at: u64,
}

/// A message as an index has it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Listed {
    pub(super) channel: u32,
    pub(super) recorded: Stamp,
    /// Offset of its record in the block.
    pub(super) at: u64,
}
