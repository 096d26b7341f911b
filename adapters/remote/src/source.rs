//! An object as a file that is read by ranges.

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use vice_core::error::{DataError, DataResult};
use vice_files::elsewhere::Ranged;

use crate::object::{MAX_REQUEST_BYTES, Object};
use crate::segments::{Segments, merged, pieces};
use crate::waiting::wait;

/// Bytes of the first request at a place; as many again with each that goes on where the last one ended.
const FIRST_BYTES: u64 = 4 << 10;
/// Bytes between two ranges that are fetched with them rather than by two requests.
const GAP_BYTES: u64 = 4 << 10;
/// Bytes that one call fetches ahead, at most: what is kept must not push itself out.
const AHEAD_BYTES: u64 = 56 << 20;

/// An object that is read by ranges.
pub(crate) struct Source {
    object: Arc<Object>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    kept: Segments,
    /// Where the last request ended that was made for a read, and its bytes.
    last: (u64, u64),
}

impl Source {
    pub(crate) fn new(object: Object) -> Self {
        Self { object: Arc::new(object), state: Mutex::default() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn fetch(&self, ranges: Vec<Range<u64>>) -> DataResult<Vec<Vec<u8>>> {
        let object = Arc::clone(&self.object);
        wait(async move { object.parts(ranges).await })
    }

    /// Bytes of a range by requests of a size that servers like, in one piece.
    fn whole(&self, range: Range<u64>) -> DataResult<Vec<u8>> {
        let mut parts = self.fetch(pieces(range, MAX_REQUEST_BYTES).collect())?;
        Ok(if parts.len() == 1 { parts.swap_remove(0) } else { parts.concat() })
    }
}

impl Ranged for Source {
    fn size_bytes(&self) -> u64 {
        self.object.version.size
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> DataResult<()> {
        let len = bytes.len() as u64;
        let size = self.size_bytes();
        let end = offset.checked_add(len).filter(|end| *end <= size).ok_or_else(|| {
            let problem = format!("{len} bytes are asked for, and it ends at byte {size}");
            DataError::new(problem).at(&self.object.shown).byte(offset)
        })?;
        if len == 0 {
            return Ok(());
        }
        let ahead = {
            let mut state = self.state();
            if state.kept.copy(offset, bytes) {
                return Ok(());
            }
            let (last_end, last_len) = state.last;
            let goes_on = offset <= last_end && end > last_end;
            let wanted =
                if goes_on { (2 * last_len).clamp(FIRST_BYTES, MAX_REQUEST_BYTES) } else { FIRST_BYTES };
            let to = offset.saturating_add(wanted.max(len)).min(size);
            state.last = (to, wanted);
            to
        };
        let part = self.whole(offset..ahead)?;
        bytes.copy_from_slice(&part[..bytes.len()]);
        // What is large is decompressed or decoded at once and not read a second time.
        if part.len() as u64 <= MAX_REQUEST_BYTES {
            self.state().kept.add(offset, part);
        }
        Ok(())
    }

    fn will_read(&self, ranges: &[Range<u64>]) -> DataResult<()> {
        let size = self.size_bytes();
        let missing: Vec<Range<u64>> = {
            let state = self.state();
            let inside = ranges.iter().map(|r| r.start.min(size)..r.end.min(size));
            inside.flat_map(|r| state.kept.missing(r)).collect()
        };
        let mut left = AHEAD_BYTES;
        let mut wanted = Vec::new();
        for range in merged(missing, GAP_BYTES) {
            let len = range.end - range.start;
            if len > left {
                break;
            }
            left -= len;
            wanted.push(range);
        }
        let requests = wanted.iter().flat_map(|range| pieces(range.clone(), MAX_REQUEST_BYTES)).collect();
        let mut parts = self.fetch(requests)?.into_iter();
        let mut state = self.state();
        for range in wanted {
            let mut bytes = Vec::new();
            for _ in pieces(range.clone(), MAX_REQUEST_BYTES) {
                let part = parts.next().unwrap_or_default();
                bytes = if bytes.is_empty() { part } else { [bytes, part].concat() };
            }
            state.kept.add(range.start, bytes);
        }
        Ok(())
    }
}
