//! Parts of a file in bounded memory.

use std::collections::{BTreeMap, VecDeque};
use std::ops::Range;

/// Bytes that are kept of a file.
const KEPT_BYTES: usize = 64 << 20;
/// Parts that start before a place and may reach it, that are looked at.
const LOOK_BACK: usize = 4;

/// Parts by where they start; the oldest go first.
#[derive(Default)]
pub(crate) struct Segments {
    parts: BTreeMap<u64, Vec<u8>>,
    /// Starts in the order in which they came.
    order: VecDeque<u64>,
    bytes: usize,
}

impl Segments {
    /// Bytes of a range, where one part has all of them.
    pub(crate) fn get(&self, range: Range<u64>) -> Option<&[u8]> {
        self.parts.range(..=range.start).rev().take(LOOK_BACK).find_map(|(start, bytes)| {
            let from = usize::try_from(range.start - start).ok()?;
            bytes.get(from..from + usize::try_from(range.end - range.start).ok()?)
        })
    }

    /// Whether it has all bytes of a range.
    pub(crate) fn has(&self, range: &Range<u64>) -> bool {
        self.get(range.clone()).is_some()
    }

    /// Keeps a part.
    pub(crate) fn add(&mut self, start: u64, bytes: Vec<u8>) {
        if self.parts.get(&start).is_some_and(|there| there.len() >= bytes.len()) {
            return;
        }
        self.bytes += bytes.len();
        match self.parts.insert(start, bytes) {
            Some(shorter) => self.bytes -= shorter.len(),
            None => self.order.push_back(start),
        }
        while self.bytes > KEPT_BYTES && self.order.len() > 1 {
            let oldest = self.order.pop_front().and_then(|start| self.parts.remove(&start));
            self.bytes -= oldest.map_or(0, |part| part.len());
        }
    }
}

/// Ranges sorted, with those in one that touch or have less than `gap` between them.
pub(crate) fn merged(mut ranges: Vec<Range<u64>>, gap: u64) -> Vec<Range<u64>> {
    ranges.retain(|r| r.start < r.end);
    ranges.sort_by_key(|r| r.start);
    let mut merged: Vec<Range<u64>> = Vec::new();
    for range in ranges {
        match merged.last_mut() {
            Some(last) if range.start <= last.end.saturating_add(gap) => last.end = last.end.max(range.end),
            _ => merged.push(range),
        }
    }
    merged
}

/// A range in pieces of at most so many bytes.
pub(crate) fn pieces(range: Range<u64>, most: u64) -> impl Iterator<Item = Range<u64>> {
    let end = range.end;
    let starts = std::iter::successors(Some(range.start), move |at| Some(at + most));
    starts.take_while(move |at| *at < end).map(move |at| at..(at + most).min(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_found_where_one_has_all_of_it() {
        let mut segments = Segments::default();
        segments.add(10, vec![1, 2, 3, 4]);
        segments.add(12, vec![3]);
        assert_eq!(segments.get(11..14), Some(&[2, 3, 4][..]), "behind a shorter one");
        assert!(!segments.has(&(9..12)) && !segments.has(&(13..15)) && segments.has(&(14..14)));
    }

    #[test]
    fn memory_is_bounded() {
        let mut segments = Segments::default();
        for i in 0..80 {
            segments.add(i << 20, vec![0; 1 << 20]);
        }
        assert_eq!(segments.bytes, 64 << 20);
        assert!(!segments.has(&(0..1)) && segments.has(&(79 << 20..80 << 20)));
    }

    #[test]
    fn ranges_are_merged_over_small_gaps_and_cut_where_they_are_large() {
        assert_eq!(merged(vec![20..30, 0..10, 5..12, 15..15], 4), [0..12, 20..30]);
        assert_eq!(merged(vec![20..30, 0..10], 10), [0..30]);
        assert_eq!(pieces(3..10, 3).collect::<Vec<_>>(), [3..6, 6..9, 9..10]);
    }
}
