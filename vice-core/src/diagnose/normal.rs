//! Normal equations of whitened columns, and what they come to: values, their covariance, and the evidence with the values
//! integrated over.

use nalgebra::{DMatrix, DVector};

use super::filter::Whitened;

/// What is expected of a parameter before anything is seen: normal with its expected width, or four times wider.
const NARROW: f64 = 0.7;
pub(super) const WIDE_TIMES: f64 = 4.0;

/// Normal equations of whitened columns: products of the derivatives, with the residuals, and of these.
#[derive(Clone, Debug)]
pub(super) struct Normal {
    pub(super) hessian: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    pub(super) squares: f64,
    pub(super) log_variances: f64,
}

impl Normal {
    /// Of some of the columns, which count from 1.
    pub(super) fn of(whitened: &Whitened, columns: &[usize]) -> Self {
        let p = columns.len();
        let mut hessian = DMatrix::zeros(p, p);
        let mut gradient = DVector::zeros(p);
        let mut squares = 0.0;
        for row in whitened.rows.chunks_exact(whitened.width) {
            squares += row[0] * row[0];
            for (a, ca) in columns.iter().enumerate() {
                gradient[a] += row[*ca] * row[0];
                for (b, cb) in columns.iter().enumerate().take(a + 1) {
                    hessian[(a, b)] += row[*ca] * row[*cb];
                }
            }
        }
        for a in 0..p {
            for b in 0..a {
                hessian[(b, a)] = hessian[(a, b)];
            }
        }
        Self { hessian, gradient, squares, log_variances: whitened.log_variances.iter().sum() }
    }

    /// Solved around the values that were linearised at.
    pub(super) fn solve(&self, values: &[f64], expected: &[f64]) -> Solution {
        let p = values.len();
        let fixed = -0.5 * self.log_variances;
        if p == 0 {
            let likelihood = fixed - 0.5 * self.squares;
            return Solution {
                step: DVector::zeros(0),
                covariance: DMatrix::zeros(0, 0),
                evidence: likelihood,
                likelihood,
            };
        }
        let x = DVector::from_column_slice(values);
        let with = |times: f64| {
            let precision = DVector::from_iterator(p, expected.iter().map(|s| (s * times).powi(-2)));
            let a = &self.hessian + DMatrix::from_diagonal(&precision);
            let b = &self.gradient + precision.component_mul(&x);
            let chol = a.cholesky()?;
            let step = -chol.solve(&b);
            let log_det: f64 = chol.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
            let log_prior: f64 = expected.iter().map(|s| 2.0 * (s * times).ln()).sum();
            let cost = self.squares + x.dot(&precision.component_mul(&x)) + b.dot(&step);
            Some((fixed - 0.5 * cost - 0.5 * log_det - 0.5 * log_prior, step, chol.inverse()))
        };
        let (Some(narrow), Some(wide)) = (with(1.0), with(WIDE_TIMES)) else {
            return Solution {
                step: DVector::zeros(p),
                covariance: DMatrix::identity(p, p) * 1e12,
                evidence: f64::NEG_INFINITY,
                likelihood: f64::NEG_INFINITY,
            };
        };
        let (a, b) = (narrow.0 + NARROW.ln(), wide.0 + (1.0 - NARROW).ln());
        let most = a.max(b);
        let evidence = most + ((a - most).exp() + (b - most).exp()).ln();
        // The wider pull is weak: what is said of the values comes from the labels.
        let (_, step, covariance) = wide;
        let moved = self.squares + 2.0 * self.gradient.dot(&step) + step.dot(&(&self.hessian * &step));
        Solution { step, covariance, evidence, likelihood: fixed - 0.5 * moved }
    }
}

/// What normal equations come to.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    /// From the values that were linearised at.
    pub(super) step: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// How likely the labels are with the values integrated over, as a logarithm.
    pub(super) evidence: f64,
    /// How likely they are at the best values, as a logarithm.
    pub(super) likelihood: f64,
}
