//! Bytes of a file in blocks: nothing is held but the block, and the place in the file is always known.

use std::io::{self, BufRead, Read};

use vice_core::error::{DataError, DataResult};

/// Bytes read at once: large enough for the disk, small enough to stay in the cache between reading and decoding.
const BLOCK_BYTES: usize = 1 << 18;

/// A row that does not fit this is no row (16 MiB).
const MAX_ROW_BYTES: usize = 1 << 24;

/// A reader with a block in front of it.
pub(crate) struct Source<R> {
    inner: R,
    block: Vec<u8>,
    start: usize,
    end: usize,
    /// Offset of `block[start]`.
    offset: u64,
    /// Length of the whole file, where it is known.
    length: Option<u64>,
}

impl<R: Read> Source<R> {
    pub(crate) fn new(inner: R, length: Option<u64>) -> Self {
        Self { inner, block: vec![0; BLOCK_BYTES], start: 0, end: 0, offset: 0, length }
    }

    /// Offset of the next byte.
    pub(crate) const fn offset(&self) -> u64 {
        self.offset
    }

    /// Bytes left, where the length of the file is known.
    pub(crate) fn remaining(&self) -> Option<u64> {
        self.length.map(|length| length.saturating_sub(self.offset))
    }

    /// The bytes at hand.
    pub(crate) fn ahead(&self) -> &[u8] {
        &self.block[self.start..self.end]
    }

    /// Reads on until at least `wanted` bytes are at hand; false where the file ends before that.
    pub(crate) fn at_least(&mut self, wanted: usize) -> DataResult<bool> {
        while self.end - self.start < wanted {
            if !self.more().map_err(unreadable)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Reads one more block behind what is at hand; false at the end of the file.
    pub(crate) fn more(&mut self) -> io::Result<bool> {
        self.block.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        if self.end == self.block.len() {
            if self.end >= MAX_ROW_BYTES {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "a row is longer than 16 MiB"));
            }
            self.block.resize(2 * self.end, 0);
        }
        loop {
            match self.inner.read(&mut self.block[self.end..]) {
                Ok(got) => {
                    self.end += got;
                    return Ok(got > 0);
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
    }

    /// Passes over `count` bytes that are at hand.
    pub(crate) fn pass(&mut self, count: usize) {
        self.start += count;
        self.offset += count as u64;
    }

    /// Passes over `count` bytes, at hand or not; false where the file ends before that.
    pub(crate) fn skip(&mut self, mut count: u64) -> DataResult<bool> {
        while count > 0 {
            if self.start == self.end && !self.more().map_err(unreadable)? {
                return Ok(false);
            }
            let step = count.min((self.end - self.start) as u64);
            self.pass(step as usize);
            count -= step;
        }
        Ok(true)
    }
}

impl<R: Read> Read for Source<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let got = self.fill_buf()?.read(out)?;
        self.pass(got);
        Ok(got)
    }
}

impl<R: Read> BufRead for Source<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.start == self.end {
            self.more()?;
        }
        Ok(&self.block[self.start..self.end])
    }

    fn consume(&mut self, count: usize) {
        self.pass(count);
    }
}

pub(crate) fn unreadable(e: io::Error) -> DataError {
    DataError::new("cannot be read").because(e)
}
