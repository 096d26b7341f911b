//! Parts of a run whose errors are as good as independent.
//!
//! The error of an odometry wanders: labels that are near in time err alike, and all points of a frame share its pose.
//! So labels are never resampled or left out one by one, but in blocks of time. A block is a group of key frames with
//! all that is scored against them, since a wander starts anew at each key frame. Where there are fewer than
//! [`FEWEST_KEYFRAMES`] of these, it is a group of frames.

use std::collections::BTreeMap;

use super::problem::ScoredLabel;
use crate::time::Stamp;

/// So many stamps with key frames are enough for blocks of their own.
const FEWEST_KEYFRAMES: usize = 6;
/// More blocks than these say nothing more.
const MOST_BLOCKS: usize = 12;
/// Longer cells are cut: their covariance is a full matrix.
const LONGEST_CELL: usize = 64;

/// Labels of one segment within one block, in time.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    /// The point.
    pub(super) point: usize,
    /// The block.
    pub(super) block: usize,
    /// The labels.
    pub(super) labels: Vec<usize>,
    /// Seconds since the key frame, one for each label.
    pub(super) seconds: Vec<f64>,
    /// Where the depth error of its segment stands among the residuals, if this is the segment's first cell and the depth
    /// is rough.
    pub(super) pull: Option<usize>,
}

/// Labels by block of time, by point and by segment.
#[derive(Clone, Debug)]
pub(super) struct Blocks {
    /// Labels of each block, ascending.
    pub(super) by_time: Vec<Vec<usize>>,
    /// Labels of each segment, as far as they are in one block.
    pub(super) cells: Vec<Cell>,
    /// Whether the blocks are groups of key frames.
    pub(super) of_keyframes: bool,
}

impl Blocks {
    pub(super) fn new(labels: &[ScoredLabel]) -> Self {
        let count = |stamp: fn(&ScoredLabel) -> Stamp| {
            let mut counts: BTreeMap<Stamp, usize> = BTreeMap::new();
            labels.iter().for_each(|l| *counts.entry(stamp(l)).or_default() += 1);
            counts
        };
        let keyframes = count(|l| l.keyframe);
        let of_keyframes = keyframes.len() >= FEWEST_KEYFRAMES;
        let block_of = grouped(&if of_keyframes { keyframes } else { count(|l| l.stamp) });
        let blocks = block_of.values().max().map_or(0, |b| b + 1);
        let mut by_time = vec![Vec::new(); blocks];
        let mut cells: BTreeMap<(usize, usize, Stamp), Vec<usize>> = BTreeMap::new();
        for (i, label) in labels.iter().enumerate() {
            let block = block_of[if of_keyframes { &label.keyframe } else { &label.stamp }];
            by_time[block].push(i);
            cells.entry((label.point, block, label.keyframe)).or_default().push(i);
        }
        let seconds = |label: &usize| labels[*label].stamp.since(labels[*label].keyframe).as_secs_f64();
        let cells = cells.into_iter().flat_map(|((point, block, _), inside)| {
            let pieces: Vec<Cell> = inside
                .chunks(LONGEST_CELL)
                .map(|piece| Cell {
                    point,
                    block,
                    labels: piece.to_vec(),
                    seconds: piece.iter().map(seconds).collect(),
                    pull: None,
                })
                .collect();
            pieces
        });
        let cells = cells.collect();
        Self { by_time, cells, of_keyframes }
    }

    /// With the depth errors of segments, which stand behind the residuals of the labels.
    pub(super) fn with_pulls(mut self, segments: &[Vec<usize>]) -> Self {
        let labels: usize = self.cells.iter().map(|cell| cell.labels.len()).sum();
        let firsts: BTreeMap<usize, usize> =
            segments.iter().enumerate().filter_map(|(i, s)| Some((*s.first()?, labels + i))).collect();
        for cell in &mut self.cells {
            cell.pull = cell.labels.first().and_then(|first| firsts.get(first)).copied();
        }
        self
    }

    /// Median time since the key frame, seconds.
    pub(super) fn typical_seconds(&self) -> f64 {
        let mut seconds: Vec<f64> = self.cells.iter().flat_map(|c| c.seconds.iter().copied()).collect();
        seconds.sort_by(f64::total_cmp);
        seconds.get(seconds.len() / 2).copied().unwrap_or(0.0)
    }

    pub(super) fn len(&self) -> usize {
        self.by_time.len()
    }
}

/// Consecutive stamps in at most [`MOST_BLOCKS`] groups of about as many labels.
fn grouped(counts: &BTreeMap<Stamp, usize>) -> BTreeMap<Stamp, usize> {
    let groups = counts.len().min(MOST_BLOCKS);
    let mut left: usize = counts.values().sum();
    let (mut group, mut inside) = (0, 0);
    let mut block_of = BTreeMap::new();
    for (seen, (stamp, count)) in counts.iter().enumerate() {
        let (groups_left, stamps_left) = (groups - group, counts.len() - seen);
        let share = (left + inside) as f64 / groups_left as f64;
        // A new group where this one is full, or where the stamps that are left must have one each.
        let full = inside as f64 + 0.5 * *count as f64 > share || stamps_left < groups_left;
        if inside > 0 && full && groups_left > 1 {
            (group, inside) = (group + 1, 0);
        }
        block_of.insert(*stamp, group);
        inside += count;
        left -= count;
    }
    block_of
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(points: usize, keyframes: i64, each: i64) -> Vec<ScoredLabel> {
        let mut labels = Vec::new();
        for point in 0..points {
            for k in 0..keyframes {
                for i in 1..=each {
                    let at = |n| Stamp::from_nanos(n);
                    labels.push(ScoredLabel {
                        point,
                        name: point.to_string().into(),
                        stamp: at(1000 * k + i),
                        keyframe: at(1000 * k),
                    });
                }
            }
        }
        labels
    }

    #[test]
    fn blocks_follow_key_frames_or_else_frames() {
        let many = Blocks::new(&labels(3, 30, 5));
        assert!(many.of_keyframes && many.len() == MOST_BLOCKS && many.cells.len() == 90);
        assert!(many.by_time.iter().all(|b| (30..=45).contains(&b.len())), "{:?}", many.by_time);
        let few = Blocks::new(&labels(4, 2, 3));
        assert!(!few.of_keyframes && few.len() == 6 && few.cells.len() == 24);
        assert_eq!(Blocks::new(&labels(1, 7, 1)).len(), 7);
        assert_eq!(Blocks::new(&[]).len(), 0);
    }
}
