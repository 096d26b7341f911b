//! What the machine could do at best: copying memory.

use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

/// Bytes of each of the two buffers that are copied for the headline number: larger than most caches.
const COPY_BYTES: usize = 128 << 20;

/// The limits with a number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Number of threads.
    pub threads: usize,
    /// Of a large copy, read and written bytes both counted.
    pub memcpy_bytes_per_second: f64,
}

impl Machine {
    /// Measures with the threads of the pool that it runs in.
    pub(crate) fn measure() -> Self {
        let from = vec![1_u8; COPY_BYTES];
        let mut to = vec![0_u8; COPY_BYTES];
        let copy = best_seconds(5, || copy_bytes(&from, &mut to));
        Self {
            threads: rayon::current_num_threads(),
            memcpy_bytes_per_second: 2.0 * COPY_BYTES as f64 / copy,
        }
    }
}

/// Copies, shared among the threads.
pub(crate) fn copy_bytes<T: Copy + Send + Sync>(from: &[T], to: &mut [T]) {
    let threads = rayon::current_num_threads();
    if threads == 1 {
        to.copy_from_slice(from);
        return;
    }
    let piece = from.len().div_ceil(threads).max(1);
    to.par_chunks_mut(piece).zip(from.par_chunks(piece)).for_each(|(to, from)| to.copy_from_slice(from));
}

/// The shortest of some runs, after one that warms up.
pub(crate) fn best_seconds(runs: usize, mut work: impl FnMut()) -> f64 {
    work();
    let mut best = f64::INFINITY;
    for _ in 0..runs {
        best = best.min(seconds(&mut work));
    }
    best
}

/// How long something takes.
pub(crate) fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}
