//! Labels of one frame taken in together: the rows that they add, by Cholesky's decomposition of their covariance. The same
//! numbers as one by one, with each number of the covariance read and written once.

use std::ops::Range;

use pulp::Simd;

use super::state::{POSE, State};

/// Labels that are taken in at once.
pub(super) const AT_ONCE: usize = 8;
const ROWS: usize = 2 * AT_ONCE;
const TERMS: usize = POSE + 4;
/// Registers of a row of the covariance that are worked on at a time.
const REGISTERS: usize = 4;
/// Numbers of the state whose means are worked on at a time.
const NUMBERS: usize = 4;

/// One coordinate of a label: how it answers to the state, and its variance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) terms: [(usize, f64); TERMS],
    pub(super) variance: f64,
}

/// What the rows of some labels are made with, kept from one frame to the next.
pub(super) struct Update {
    stride: usize,
    /// Covariance of each row with the state, then the same made independent.
    rows: Vec<f64>,
    /// The first of these, number by number of the state.
    turned: Vec<[f64; ROWS]>,
    lower: [[f64; ROWS]; ROWS],
    /// One over the diagonal of `lower`.
    inverse: [f64; ROWS],
}

impl Update {
    pub(super) fn new(stride: usize) -> Self {
        Self {
            stride,
            rows: vec![0.0; ROWS * stride],
            turned: vec![[0.0; ROWS]; stride],
            lower: [[0.0; ROWS]; ROWS],
            inverse: [0.0; ROWS],
        }
    }

    /// Takes rows into the covariance; the sum of the logarithms of their variances, each given those before it. The pose
    /// with its jitter is left as it was unless it is `looked_at` once more before the next frame.
    #[inline(always)]
    pub(super) fn covariance<S: Simd>(
        &mut self,
        simd: S,
        state: &mut State,
        rows: &[Row],
        looked_at: bool,
    ) -> f64 {
        let (s, n) = (self.stride, state.n);
        let m = rows.len();
        for (row, out) in rows.iter().zip(self.rows.chunks_exact_mut(s)) {
            sum_of_rows(simd, row, &state.p, out, n);
        }
        for k in 0..n {
            for b in 0..m {
                self.turned[k][b] = self.rows[b * s + k];
            }
        }
        for a in 0..m {
            // Sums that do not wait for each other; those beyond `a` are not used.
            let mut sums = [0.0; ROWS];
            for (i, times) in rows[a].terms {
                let with = &self.turned[i];
                for b in 0..ROWS {
                    sums[b] += times * with[b];
                }
            }
            sums[a] += rows[a].variance;
            self.lower[a] = sums;
        }
        let mut log_variances = 0.0;
        for a in 0..m {
            // No row has less variance than its own label, whatever rounding leaves.
            let variance = self.lower[a][a].max(0.5 * rows[a].variance);
            log_variances += variance.ln();
            let inverse = 1.0 / variance.sqrt();
            self.inverse[a] = inverse;
            let mut column = [0.0; ROWS];
            for b in a + 1..m {
                column[b] = self.lower[b][a] * inverse;
                self.lower[b][a] = column[b];
            }
            for b in a + 1..m {
                for c in a + 1..=b {
                    self.lower[b][c] -= column[b] * column[c];
                }
            }
        }
        for a in 0..m {
            let (before, rest) = self.rows.split_at_mut(a * s);
            let row = &mut rest[..n];
            for b in 0..a {
                add_times(row, -self.lower[a][b], &before[b * s..b * s + n]);
            }
            let inverse = self.inverse[a];
            for value in row {
                *value *= inverse;
            }
            rest[n..s].fill(0.0);
        }
        let left = if looked_at { 0..0 } else { state.now..state.now + POSE };
        self.subtract(simd, &mut state.p, n, m, left);
        log_variances
    }

    /// `p -= rowsᵀ · rows`, two rows of the covariance and some registers at a time; rows in `left` need not be.
    #[inline(always)]
    fn subtract<S: Simd>(&self, simd: S, p: &mut [f64], n: usize, m: usize, left: Range<usize>) {
        let s = self.stride;
        let end = n.div_ceil(S::F64_LANES);
        for (k, pair) in p.chunks_exact_mut(2 * s).take(n.div_ceil(2)).enumerate() {
            if left.start <= 2 * k && 2 * k + 1 < left.end {
                continue;
            }
            let (first, second) = pair.split_at_mut(s);
            let (first, _) = S::as_mut_simd_f64s(first);
            let (second, _) = S::as_mut_simd_f64s(second);
            let mut at = 0;
            while at + REGISTERS <= end {
                self.subtract_some::<S, REGISTERS>(simd, k, at, m, first, second);
                at += REGISTERS;
            }
            while at < end {
                self.subtract_some::<S, 1>(simd, k, at, m, first, second);
                at += 1;
            }
        }
    }

    #[inline(always)]
    fn subtract_some<S: Simd, const N: usize>(
        &self,
        simd: S,
        k: usize,
        at: usize,
        m: usize,
        first: &mut [S::f64s],
        second: &mut [S::f64s],
    ) {
        let (mut one, mut two) = ([simd.splat_f64s(0.0); N], [simd.splat_f64s(0.0); N]);
        // One by one: copies of slices would go through memory.
        let (first, second) = (&mut first[at..at + N], &mut second[at..at + N]);
        for i in 0..N {
            one[i] = first[i];
            two[i] = second[i];
        }
        for row in self.rows.chunks_exact(self.stride).take(m) {
            let (a, b) = (simd.splat_f64s(row[2 * k]), simd.splat_f64s(row[2 * k + 1]));
            let (row, _) = S::as_simd_f64s(row);
            let with = &row[at..at + N];
            for i in 0..N {
                one[i] = simd.sub_f64s(one[i], simd.mul_f64s(a, with[i]));
                two[i] = simd.sub_f64s(two[i], simd.mul_f64s(b, with[i]));
            }
        }
        for i in 0..N {
            first[i] = one[i];
            second[i] = two[i];
        }
    }

    /// Takes the measured rows of all columns into their means; they become independent, of unit variance. `measured` holds
    /// row by row as many numbers as the means have columns.
    #[inline(always)]
    pub(super) fn mean<S: Simd>(&self, simd: S, state: &mut State, rows: &[Row], measured: &mut [f64]) {
        let n = state.n;
        let at_once = state.means.width() / S::F64_LANES;
        let (means, _) = S::as_mut_simd_f64s(state.means.rows_mut(n));
        let (measured, _) = S::as_mut_simd_f64s(measured);
        for at in 0..at_once {
            let mut solved = [simd.splat_f64s(0.0); ROWS];
            for a in 0..rows.len() {
                let mut sum = measured[a * at_once + at];
                for t in 0..TERMS {
                    let (i, times) = rows[a].terms[t];
                    let times = simd.splat_f64s(times);
                    sum = simd.sub_f64s(sum, simd.mul_f64s(times, means[i * at_once + at]));
                }
                for b in 0..a {
                    let times = simd.splat_f64s(self.lower[a][b]);
                    sum = simd.sub_f64s(sum, simd.mul_f64s(times, solved[b]));
                }
                solved[a] = simd.mul_f64s(sum, simd.splat_f64s(self.inverse[a]));
                measured[a * at_once + at] = solved[a];
            }
            let mut k = 0;
            while k + NUMBERS <= n {
                self.add_some::<S, NUMBERS>(simd, (k, at, at_once), means, &solved[..rows.len()]);
                k += NUMBERS;
            }
            while k < n {
                self.add_some::<S, 1>(simd, (k, at, at_once), means, &solved[..rows.len()]);
                k += 1;
            }
        }
    }

    /// Some numbers of the state from `k` on, of the columns of one register.
    #[inline(always)]
    fn add_some<S: Simd, const N: usize>(
        &self,
        simd: S,
        (k, at, at_once): (usize, usize, usize),
        means: &mut [S::f64s],
        solved: &[S::f64s],
    ) {
        let mut sums = [simd.splat_f64s(0.0); N];
        for i in 0..N {
            sums[i] = means[(k + i) * at_once + at];
        }
        for a in 0..solved.len() {
            let row = &self.rows[a * self.stride + k..a * self.stride + k + N];
            for i in 0..N {
                sums[i] = simd.add_f64s(sums[i], simd.mul_f64s(solved[a], simd.splat_f64s(row[i])));
            }
        }
        for i in 0..N {
            means[(k + i) * at_once + at] = sums[i];
        }
    }
}

/// `out = Σ times · p[row]`, so many numbers of it.
#[inline(always)]
fn sum_of_rows<S: Simd>(simd: S, row: &Row, p: &[f64], out: &mut [f64], n: usize) {
    let s = out.len();
    let (out, _) = S::as_mut_simd_f64s(out);
    let end = n.div_ceil(S::F64_LANES);
    let (mut from, mut times) = ([&[][..]; TERMS], [simd.splat_f64s(0.0); TERMS]);
    for t in 0..TERMS {
        let (i, factor) = row.terms[t];
        let (of_row, _) = S::as_simd_f64s(&p[i * s..(i + 1) * s]);
        (from[t], times[t]) = (&of_row[..end], simd.splat_f64s(factor));
    }
    for (at, out) in out[..end].iter_mut().enumerate() {
        let mut sum = simd.splat_f64s(0.0);
        for t in 0..TERMS {
            sum = simd.add_f64s(sum, simd.mul_f64s(times[t], from[t][at]));
        }
        *out = sum;
    }
}

/// `to += times · from`.
#[inline(always)]
fn add_times(to: &mut [f64], times: f64, from: &[f64]) {
    let n = to.len().min(from.len());
    let (to, from) = (&mut to[..n], &from[..n]);
    for i in 0..n {
        to[i] += times * from[i];
    }
}
