//! What the machine could do at best: copying memory, multiplying and adding, dividing.

use std::hint::black_box;
use std::time::Instant;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use serde::Serialize;

/// Bytes of each of the two buffers that are copied for the headline number: larger than most caches.
const COPY_BYTES: usize = 128 << 20;
/// Chains of operations that do not wait for each other: more than latency times ports of any processor of today.
const CHAINS: usize = 12;
/// Long enough that waking the threads does not count.
const ROUNDS: usize = 500_000;

/// The limits with a number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Number of threads.
    pub threads: usize,
    /// Of a large copy, read and written bytes both counted.
    pub memcpy_bytes_per_second: f64,
    /// Fused multiply-adds on doubles.
    pub multiply_adds_per_second: f64,
    /// Divisions of doubles.
    pub divisions_per_second: f64,
}

impl Machine {
    /// Measures with the threads of the pool that it runs in.
    pub(crate) fn measure() -> Self {
        let from = vec![1_u8; COPY_BYTES];
        let mut to = vec![0_u8; COPY_BYTES];
        let copy = best_seconds(5, || copy_bytes(&from, &mut to));
        let threads = rayon::current_num_threads();
        let arch = Arch::new();
        let rate = |divide: bool| {
            let seconds = best_seconds(5, || {
                rayon::broadcast(|_| black_box(arch.dispatch(Peak { divide, seed: black_box(1.0) })));
            });
            let lanes = arch.dispatch(Width);
            (threads * lanes * CHAINS * ROUNDS) as f64 / seconds
        };
        Self {
            threads,
            memcpy_bytes_per_second: 2.0 * COPY_BYTES as f64 / copy,
            multiply_adds_per_second: rate(false),
            divisions_per_second: rate(true),
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

/// Doubles in a register.
struct Width;

impl WithSimd for Width {
    type Output = usize;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F64_LANES
    }
}

/// Nothing but fused multiply-adds, or nothing but divisions.
struct Peak {
    divide: bool,
    seed: f64,
}

impl WithSimd for Peak {
    type Output = f64;
    #[inline(always)]
    #[allow(clippy::needless_range_loop)] // An iterator's closure might be compiled for the smallest instruction set.
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let (factor, summand) = (simd.splat_f64s(self.seed * 0.999_999), simd.splat_f64s(1e-6));
        let mut chains = [simd.splat_f64s(self.seed); CHAINS];
        if self.divide {
            for _ in 0..ROUNDS {
                for k in 0..CHAINS {
                    chains[k] = simd.div_f64s(chains[k], factor);
                }
            }
        } else {
            for _ in 0..ROUNDS {
                for k in 0..CHAINS {
                    chains[k] = simd.mul_add_f64s(chains[k], factor, summand);
                }
            }
        }
        let mut sum = 0.0;
        for k in 0..CHAINS {
            sum += simd.reduce_sum_f64s(chains[k]);
        }
        sum
    }
}
