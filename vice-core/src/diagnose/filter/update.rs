//! Labels of one frame taken in together: the rows that they add, by Cholesky's decomposition of their covariance. The same
//! numbers as one by one, with each number of the covariance read and written once.

#![expect(clippy::needless_range_loop, reason = "indices of matrices are clearer as indices")]

use super::state::{LANES, POSE, State};

/// Labels that are taken in at once.
pub(super) const AT_ONCE: usize = 8;
const ROWS: usize = 2 * AT_ONCE;
const TERMS: usize = POSE + 4;

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
    lower: [[f64; ROWS]; ROWS],
    /// One over the diagonal of `lower`.
    inverse: [f64; ROWS],
}

impl Update {
    pub(super) fn new(stride: usize) -> Self {
        Self { stride, rows: vec![0.0; ROWS * stride], lower: [[0.0; ROWS]; ROWS], inverse: [0.0; ROWS] }
    }

    /// Takes rows into the covariance; the sum of the logarithms of their variances, each given those before it.
    #[inline(always)]
    pub(super) fn covariance(&mut self, state: &mut State, rows: &[Row]) -> f64 {
        let (s, n) = (self.stride, state.n);
        let m = rows.len();
        for (row, out) in rows.iter().zip(self.rows.chunks_exact_mut(s)) {
            let out = &mut out[..n];
            out.fill(0.0);
            for (i, times) in row.terms {
                add_times(out, times, &state.p[i * s..i * s + n]);
            }
        }
        let mut log_variances = 0.0;
        for a in 0..m {
            for b in 0..=a {
                let with = &self.rows[b * s..b * s + n];
                let mut sum = if a == b { rows[a].variance } else { 0.0 };
                for (i, times) in rows[a].terms {
                    sum += times * with[i];
                }
                self.lower[a][b] = sum;
            }
        }
        for a in 0..m {
            for b in 0..a {
                let mut sum = self.lower[a][b];
                for k in 0..b {
                    sum -= self.lower[a][k] * self.lower[b][k];
                }
                self.lower[a][b] = sum * self.inverse[b];
            }
            let mut sum = self.lower[a][a];
            for k in 0..a {
                sum -= self.lower[a][k] * self.lower[a][k];
            }
            // No row has less variance than its own label, whatever rounding leaves.
            let variance = sum.max(0.5 * rows[a].variance);
            log_variances += variance.ln();
            self.inverse[a] = 1.0 / variance.sqrt();
        }
        for a in 0..m {
            let (before, rest) = self.rows.split_at_mut(a * s);
            let row = &mut rest[..n];
            for b in 0..a {
                add_times(row, -self.lower[a][b], &before[b * s..b * s + n]);
            }
            let inverse = self.inverse[a];
            row.iter_mut().for_each(|v| *v *= inverse);
            rest[n..s].fill(0.0);
        }
        self.subtract(&mut state.p, n, m);
        log_variances
    }

    /// `p -= rowsᵀ · rows`, two rows of the covariance at a time.
    #[inline(always)]
    fn subtract(&self, p: &mut [f64], n: usize, m: usize) {
        let s = self.stride;
        let end = n.next_multiple_of(LANES);
        for (k, pair) in p.chunks_exact_mut(2 * s).take(n.div_ceil(2)).enumerate() {
            let (first, second) = pair.split_at_mut(s);
            let mut at = 0;
            while at < end {
                let (mut one, mut two) = ([0.0; LANES], [0.0; LANES]);
                one.copy_from_slice(&first[at..at + LANES]);
                two.copy_from_slice(&second[at..at + LANES]);
                for row in self.rows.chunks_exact(s).take(m) {
                    let (a, b) = (row[2 * k], row[2 * k + 1]);
                    let with = &row[at..at + LANES];
                    for i in 0..LANES {
                        one[i] -= a * with[i];
                        two[i] -= b * with[i];
                    }
                }
                first[at..at + LANES].copy_from_slice(&one);
                second[at..at + LANES].copy_from_slice(&two);
                at += LANES;
            }
        }
    }

    /// Takes the measured rows of one column into its mean; they become independent, of unit variance.
    #[inline(always)]
    pub(super) fn mean(&self, mean: &mut [f64], rows: &[Row], measured: &mut [f64]) {
        let s = self.stride;
        for (row, value) in rows.iter().zip(measured.iter_mut()) {
            for (i, times) in row.terms {
                *value -= times * mean[i];
            }
        }
        for a in 0..rows.len() {
            let mut sum = measured[a];
            for b in 0..a {
                sum -= self.lower[a][b] * measured[b];
            }
            measured[a] = sum * self.inverse[a];
        }
        for (value, row) in measured.iter().zip(self.rows.chunks_exact(s)) {
            add_times(&mut mean[..s], *value, &row[..s]);
        }
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
