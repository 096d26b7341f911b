//! Drives a kernel over slices.

use pulp::{Simd, WithSimd, bytemuck};

use super::number::{REGISTERS, Yes};
use super::{ARCH, Element, Lanes, Number};
use crate::parallel::{Piece, total};

/// Points below which one thread is faster: waking another costs some ten microseconds.
const PARALLEL_POINTS: usize = 32_768;
/// Points that a thread works on at a time. Smaller pieces share better among busy threads, larger ones cost less.
/// A multiple of 64, so that no two threads write to the same cache line of a mask.
const PIECE_POINTS: usize = 16_384;

/// A formula from the numbers of a point to numbers of the same point.
///
/// `IN` slices are read only; `OUT` slices are read, where the formula uses what they hold, and written.
pub(crate) trait Kernel<const IN: usize, const OUT: usize>: Copy + Send + Sync {
    /// The formula for a register of points. It must be `#[inline(always)]` with all that it calls and use no closures:
    /// what is not inlined is compiled for the smallest instruction set.
    fn lanes<S: Simd>(&self, inout: [Lanes<S>; OUT], input: [Lanes<S>; IN]) -> Masked<S, OUT>;

    /// The formula for one point, `None` where it has no result. It is asked where `lanes` was unsure.
    fn single(&self, inout: [f64; OUT], input: [f64; IN]) -> Option<[f64; OUT]>;
}

/// What a kernel gives for a register of points.
pub(crate) struct Masked<S: Simd, const OUT: usize> {
    /// The numbers; what they are where not valid does not matter.
    pub(crate) numbers: [Lanes<S>; OUT],
    /// Which points have a result.
    pub(crate) valid: Yes<S>,
    /// Which points the formula for one point must decide.
    pub(crate) unsure: Option<Yes<S>>,
}

/// Runs a kernel over slices of one length. `valid[i]`, where it is asked for, tells which points have a result; where
/// a point has none its numbers are NaN. Returns how many have one.
///
/// # Panics
/// If the slices differ in length; `name` stands in the message.
pub(crate) fn run<T: Element, K: Kernel<IN, OUT>, const IN: usize, const OUT: usize>(
    name: &str,
    kernel: K,
    input: [&[T]; IN],
    inout: [&mut [T]; OUT],
    valid: Option<&mut [bool]>,
) -> usize {
    const { assert!(OUT > 0) };
    let n = inout[0].len();
    let same_length = input.iter().all(|s| s.len() == n)
        && inout.iter().all(|s| s.len() == n)
        && valid.as_ref().is_none_or(|v| v.len() == n);
    assert!(same_length, "{name}: slices differ in length");
    let drive = Drive { kernel, input, inout, valid };
    if n >= PARALLEL_POINTS && crate::parallel::current_num_threads() > 1 {
        drive.in_parallel()
    } else {
        ARCH.dispatch(drive)
    }
}

struct Drive<'a, T, K, const IN: usize, const OUT: usize> {
    kernel: K,
    input: [&'a [T]; IN],
    inout: [&'a mut [T]; OUT],
    valid: Option<&'a mut [bool]>,
}

impl<T: Element, K: Kernel<IN, OUT>, const IN: usize, const OUT: usize> Drive<'_, T, K, IN, OUT> {
    /// Cuts the slices into pieces, which all threads share.
    fn in_parallel(self) -> usize {
        let mut pieces: Vec<Piece<'_>> = Vec::with_capacity(self.inout[0].len() / PIECE_POINTS + 1);
        let mut rest = self;
        while rest.inout[0].len() > PIECE_POINTS {
            let (piece, after) = rest.split_at(PIECE_POINTS);
            pieces.push(Box::new(|| ARCH.dispatch(piece)));
            rest = after;
        }
        pieces.push(Box::new(|| ARCH.dispatch(rest)));
        total(pieces)
    }

    fn split_at(self, middle: usize) -> (Self, Self) {
        let (mut inout_a, mut inout_b) = ([const { None }; OUT], [const { None }; OUT]);
        for (k, slice) in self.inout.into_iter().enumerate() {
            let (a, b) = slice.split_at_mut(middle);
            (inout_a[k], inout_b[k]) = (Some(a), Some(b));
        }
        let (valid_a, valid_b) = self.valid.map(|v| v.split_at_mut(middle)).unzip();
        let a = Self {
            kernel: self.kernel,
            input: self.input.map(|s| &s[..middle]),
            inout: inout_a.map(Option::unwrap_or_default),
            valid: valid_a,
        };
        let b = Self {
            kernel: self.kernel,
            input: self.input.map(|s| &s[middle..]),
            inout: inout_b.map(Option::unwrap_or_default),
            valid: valid_b,
        };
        (a, b)
    }
}

impl<T: Element, K: Kernel<IN, OUT>, const IN: usize, const OUT: usize> WithSimd
    for Drive<'_, T, K, IN, OUT>
{
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> usize {
        let (n, width) = (self.inout[0].len(), REGISTERS * S::F64_LANES);
        let mut counts = simd.splat_u64s(0);
        let mut at = 0;
        // One place for whole registers and for the rest: each call of the formula is compiled once more.
        while at < n {
            let [first, second] = self.step(simd, at, (at + width).min(n));
            counts = simd.add_u64s(counts, simd.add_u64s(first, second));
            at += width;
        }
        let mut count = 0;
        for word in bytemuck::cast_slice::<S::u64s, u64>(std::slice::from_ref(&counts)) {
            count += *word;
        }
        count as usize
    }
}

impl<T: Element, K: Kernel<IN, OUT>, const IN: usize, const OUT: usize> Drive<'_, T, K, IN, OUT> {
    // Loops count: an iterator's closure might be compiled for the smallest instruction set.
    #[allow(clippy::needless_range_loop)]
    /// The points `from..to`, at most as many as the lanes hold. Gives 1 where a point has a result, else 0.
    #[inline(always)]
    fn step<S: Simd>(&mut self, simd: S, from: usize, to: usize) -> [S::u64s; REGISTERS] {
        let width = REGISTERS * S::F64_LANES;
        let is_whole = to - from == width;
        let zero = Lanes::splat(simd, 0.0);
        let (mut input, mut inout) = ([zero; IN], [zero; OUT]);
        if is_whole {
            // A length that is known when compiling: no look at how many there are.
            for k in 0..IN {
                input[k] = Lanes::load(simd, &self.input[k][from..][..width]);
            }
            for k in 0..OUT {
                inout[k] = Lanes::load(simd, &self.inout[k][from..][..width]);
            }
        } else {
            for k in 0..IN {
                input[k] = Lanes::load(simd, &self.input[k][from..to]);
            }
            for k in 0..OUT {
                inout[k] = Lanes::load(simd, &self.inout[k][from..to]);
            }
        }
        let Masked { mut numbers, valid, unsure } = self.kernel.lanes(inout, input);
        for k in 0..OUT {
            numbers[k] = Lanes::select(valid, numbers[k], zero.of(f64::NAN));
        }
        let mut flags = ones(simd, valid);
        let words: &mut [u64] = bytemuck::cast_slice_mut(&mut flags);
        if is_whole {
            for k in 0..OUT {
                numbers[k].store(&mut self.inout[k][from..][..width]);
            }
        } else {
            for k in 0..OUT {
                numbers[k].store(&mut self.inout[k][from..to]);
            }
            let mut i = to - from;
            while i < words.len() {
                words[i] = 0;
                i += 1;
            }
        }
        if let Some(unsure) = unsure
            && zero.any(unsure)
        {
            let unsure = ones(simd, unsure);
            let unsure: &[u64] = bytemuck::cast_slice(&unsure);
            self.decide(from, to, unsure, words, inout.map(|l| l.v), input.map(|l| l.v));
        }
        if let Some(valid) = &mut self.valid {
            let (flags, mut i) = (&mut valid[from..to], 0);
            while i < flags.len() {
                flags[i] = words[i] != 0;
                i += 1;
            }
        }
        flags
    }

    /// Asks the formula for one point where that for many was unsure. Rare, so that it is kept out of the loop.
    #[cold]
    #[inline(never)]
    #[allow(clippy::needless_range_loop)]
    fn decide<V: bytemuck::Pod>(
        &mut self,
        from: usize,
        to: usize,
        unsure: &[u64],
        flags: &mut [u64],
        inout: [V; OUT],
        input: [V; IN],
    ) {
        let number = |v: &V, i: usize| bytemuck::cast_slice::<V, f64>(std::slice::from_ref(v))[i];
        for i in 0..to - from {
            if unsure[i] == 0 {
                continue;
            }
            let inout = std::array::from_fn(|k| number(&inout[k], i));
            let found = self.kernel.single(inout, std::array::from_fn(|k| number(&input[k], i)));
            flags[i] = u64::from(found.is_some());
            let numbers = found.unwrap_or([f64::NAN; OUT]);
            for k in 0..OUT {
                self.inout[k][from + i] = T::from_f64(numbers[k]);
            }
        }
    }
}

/// One where there is a yes, else zero.
#[inline(always)]
fn ones<S: Simd>(simd: S, mask: Yes<S>) -> [S::u64s; REGISTERS] {
    let (one, zero) = (simd.splat_u64s(1), simd.splat_u64s(0));
    [simd.select_u64s(mask[0], one, zero), simd.select_u64s(mask[1], one, zero)]
}
