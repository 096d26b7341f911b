//! The state of the pass: its covariance and one mean for each column.

use super::super::geometry::SegmentAnswer;
use super::means::Means;

/// Numbers of a followed point: its place and the walk of its label.
pub(super) const SLOT: usize = 5;
/// Numbers of a pose: position and rotation.
pub(super) const POSE: usize = 6;
/// Rows are this long or a multiple: the widest step of [`super::update`].
pub(super) const LANES: usize = 16;

/// Error of the pose, of the pose with its jitter at this frame (`now`), and of followed points.
pub(super) struct State {
    /// Numbers in use.
    pub(super) n: usize,
    /// Length of a row.
    pub(super) stride: usize,
    /// Covariance, row by row, symmetric.
    pub(super) p: Vec<f64>,
    pub(super) means: Means,
    /// Where the pose with its jitter stands.
    pub(super) now: usize,
    /// Slots that are free.
    pub(super) free: Vec<usize>,
}

impl State {
    /// With room for so many points followed at once.
    pub(super) fn new(now: usize, most_followed: usize, width: usize) -> Self {
        let first_slot = now + POSE;
        let stride = (first_slot + SLOT * most_followed).next_multiple_of(LANES);
        Self {
            n: first_slot,
            stride,
            p: vec![0.0; stride * stride],
            means: Means::new(stride, width),
            now,
            free: (0..most_followed).rev().map(|i| first_slot + SLOT * i).collect(),
        }
    }

    #[inline(always)]
    pub(super) fn clear(&mut self, at: usize, count: usize) {
        for i in at..at + count {
            for k in 0..self.stride {
                self.p[i * self.stride + k] = 0.0;
                self.p[k * self.stride + i] = 0.0;
            }
            self.means.clear(i);
        }
    }

    /// `state[to] += times · state[from]`.
    #[inline(always)]
    pub(super) fn add(&mut self, to: usize, from: usize, times: f64) {
        let s = self.stride;
        for k in 0..self.n {
            self.p[to * s + k] += times * self.p[from * s + k];
        }
        for k in 0..self.n {
            self.p[k * s + to] += times * self.p[k * s + from];
        }
        self.means.add(to, from, times);
    }

    #[inline(always)]
    pub(super) fn scale(&mut self, at: usize, times: f64) {
        let s = self.stride;
        for k in 0..self.n {
            self.p[at * s + k] *= times;
        }
        for k in 0..self.n {
            self.p[k * s + at] *= times;
        }
        self.means.scale(at, times);
    }

    #[inline(always)]
    pub(super) fn widen(&mut self, at: usize, variance: f64) {
        self.p[at * self.stride + at] += variance;
    }

    /// The pose at this frame, with fresh jitter.
    #[inline(always)]
    pub(super) fn look(&mut self, jitter: [f64; POSE]) {
        let (s, now) = (self.stride, self.now);
        let (before, after) = self.p.split_at_mut(now * s);
        after[..POSE * s].copy_from_slice(&before[..POSE * s]);
        for row in self.p.chunks_exact_mut(s).take(self.n) {
            let (before, after) = row.split_at_mut(now);
            // One by one: a copy of so few is no call.
            let (before, after) = (&before[..POSE], &mut after[..POSE]);
            for i in 0..POSE {
                after[i] = before[i];
            }
        }
        for i in 0..POSE {
            self.widen(now + i, jitter[i] * jitter[i]);
        }
        self.means.copy(0, now, POSE);
    }

    /// A key frame: the error of the point's place, from that of the pose, the label (of this variance) and the depth.
    #[inline(always)]
    pub(super) fn begin(&mut self, segment: &SegmentAnswer, slot: usize, variance: f64) {
        let (s, n, now) = (self.stride, self.n, self.now);
        for i in 0..3 {
            for m in 0..POSE {
                let times = segment.by_pose[(i, m)];
                for k in 0..n {
                    self.p[(slot + i) * s + k] += times * self.p[(now + m) * s + k];
                }
            }
        }
        // By now the rows of the slot hold the covariance with all others; the block of the slot comes from them.
        let mut block = [[0.0; 3]; 3];
        for (i, row) in block.iter_mut().enumerate() {
            for (j, sum) in row.iter_mut().enumerate() {
                let pose: f64 =
                    (0..POSE).map(|m| segment.by_pose[(j, m)] * self.p[(slot + i) * s + now + m]).sum();
                let label: f64 = (0..2).map(|a| segment.by_pixel[(i, a)] * segment.by_pixel[(j, a)]).sum();
                *sum = pose + variance * label + segment.depth_variance[(i, j)];
            }
        }
        for i in 0..3 {
            for k in 0..n {
                self.p[k * s + slot + i] = self.p[(slot + i) * s + k];
            }
        }
        for (i, row) in block.iter().enumerate() {
            self.p[(slot + i) * s + slot..(slot + i) * s + slot + 3].copy_from_slice(row);
        }
        for i in 0..3 {
            self.means.clear(slot + i);
            for m in 0..POSE {
                self.means.add(slot + i, now + m, segment.by_pose[(i, m)]);
            }
        }
    }
}
