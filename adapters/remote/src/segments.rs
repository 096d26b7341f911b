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
    /// What there is from a place on, in one part: of several the most.
    fn from(&self, at: u64) -> &[u8] {
        let parts = self.parts.range(..=at).rev().take(LOOK_BACK);
        let rest = parts.filter_map(|(start, bytes)| bytes.get(usize::try_from(at - start).ok()?..));
        rest.max_by_key(|rest| rest.len()).unwrap_or_default()
    }

    /// Fills `bytes` from `at` on; false where some of them are not there.
    pub(crate) fn copy(&self, mut at: u64, mut bytes: &mut [u8]) -> bool {
        while !bytes.is_empty() {
            let there = self.from(at);
            let len = there.len().min(bytes.len());
            if len == 0 {
                return false;
            }
            let (now, later) = bytes.split_at_mut(len);
            now.copy_from_slice(&there[..len]);
            (at, bytes) = (at + len as u64, later);
        }
        true
    }

    /// What of a range is not there.
    pub(crate) fn missing(&self, range: Range<u64>) -> Vec<Range<u64>> {
        let (mut missing, mut at) = (Vec::new(), range.start);
        while at < range.end {
            at += self.from(at).len() as u64;
            if at >= range.end {
                break;
            }
            let next =
                self.parts.range(at + 1..).next().map_or(range.end, |(start, _)| (*start).min(range.end));
            if self.from(at).is_empty() {
                missing.push(at..next);
                at = next;
            }
        }
        missing
    }

    /// Keeps a part; where one starts there already, the longer one.
    pub(crate) fn add(&mut self, start: u64, bytes: Vec<u8>) {
        if self.parts.get(&start).is_some_and(|there| there.len() >= bytes.len()) {
            return;
        }
        // Small ones inside of it would hide it from who looks back.
        let end = start + bytes.len() as u64;
        let inside = self.parts.range(start + 1..end.max(start + 1));
        let inside: Vec<u64> =
            inside.filter(|(at, part)| *at + part.len() as u64 <= end).map(|(at, _)| *at).collect();
        for at in &inside {
            self.bytes -= self.parts.remove(at).map_or(0, |part| part.len());
        }
        if !inside.is_empty() {
            self.order.retain(|at| self.parts.contains_key(at));
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
    fn what_is_there_is_found_whatever_it_came_with() {
        let mut segments = Segments::default();
        segments.add(10, vec![1, 2, 3, 4]);
        segments.add(12, vec![3]);
        segments.add(14, vec![5, 6]);
        let mut bytes = [0; 5];
        assert!(segments.copy(11, &mut bytes), "behind a shorter one, over two");
        assert_eq!(bytes, [2, 3, 4, 5, 6]);
        assert!(!segments.copy(9, &mut bytes) && !segments.copy(12, &mut bytes));
        segments.add(20, vec![7]);
        assert_eq!(segments.missing(8..22), [8..10, 16..20, 21..22]);
        assert!(segments.missing(10..16).is_empty() && segments.missing(3..3).is_empty());
    }

    #[test]
    fn a_large_part_is_not_hidden_by_small_ones_inside_of_it() {
        let mut segments = Segments::default();
        (0..10).for_each(|i| segments.add(100 * i, vec![1; 10]));
        segments.add(50, vec![2; 900]);
        assert!(segments.missing(50..950).is_empty());
        assert_eq!((segments.bytes, segments.order.len()), (910, 2));
    }

    #[test]
    fn memory_is_bounded() {
        let mut segments = Segments::default();
        for i in 0..80 {
            segments.add(i << 20, vec![0; 1 << 20]);
        }
        assert_eq!(segments.bytes, 64 << 20);
        assert_eq!(segments.missing(0..1).len(), 1);
        assert!(segments.missing(79 << 20..80 << 20).is_empty());
    }

    #[test]
    fn ranges_are_merged_over_small_gaps_and_cut_where_they_are_large() {
        assert_eq!(merged(vec![20..30, 0..10, 5..12, 15..15], 4), [0..12, 20..30]);
        assert_eq!(merged(vec![20..30, 0..10, 50..51], 10), [0..30, 50..51]);
        assert_eq!(pieces(3..10, 3).collect::<Vec<_>>(), [3..6, 6..9, 9..10]);
    }
}
