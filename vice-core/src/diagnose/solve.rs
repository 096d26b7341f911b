//! Robust least squares: Levenberg-Marquardt on Huber's loss, whose width follows the median of the residuals.
//!
//! Well-kept solver crates take no weights that change from step to step, and follow other versions of the matrices.

use nalgebra::{DMatrix, DVector, Matrix2xX};

use super::DiagnoseError;
use super::flaw::{Flaw, PARAMETERS};
use super::problem::{Problem, Residual, rmse_px};
use super::theta::Theta;

/// Residuals longer than this many robust deviations count linearly.
const HUBER: f64 = 3.0;
/// No label is better than this, pixels: exact residuals must not divide by nothing.
pub(super) const FLOOR_PX: f64 = 0.01;
const MAX_STEPS: usize = 40;
/// A step shorter than this share of the typical size of each parameter is the last.
const CONVERGED: f64 = 1e-4;
/// Clock offsets that are tried before the first step, seconds: a wrong one is a valley of its own.
const FIRST_OFFSETS_S: f64 = 0.6;
const OFFSET_STEP_S: f64 = 0.05;

/// A solved fit.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// The flaws that were free.
    pub(super) flaws: Vec<Flaw>,
    /// Their parameters.
    pub(super) parameters: Vec<usize>,
    /// Where it ended.
    pub(super) theta: Theta,
    /// Residuals there.
    pub(super) residuals: Vec<Residual>,
    /// Derivatives there: one column for each parameter.
    pub(super) jacobian: Vec<Vec<Residual>>,
    /// Robust weights there.
    pub(super) weights: Vec<f64>,
    /// Robust standard deviation of one coordinate, pixels.
    pub(super) sigma_px: f64,
}

/// A quadratic piece of the cost: `½ δᵀ H δ + gᵀ δ` of some labels.
#[derive(Clone, Debug)]
pub(super) struct Normal {
    pub(super) hessian: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
}

impl Normal {
    pub(super) fn zeros(n: usize) -> Self {
        Self { hessian: DMatrix::zeros(n, n), gradient: DVector::zeros(n) }
    }

    pub(super) fn add(&mut self, other: &Self, times: f64) {
        self.hessian += &other.hessian * times;
        self.gradient += &other.gradient * times;
    }

    /// The minimum.
    pub(super) fn solve(mut self, ridge: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
        for i in 0..self.gradient.len() {
            let h = self.hessian[(i, i)];
            self.hessian[(i, i)] = h * (1.0 + damping) + ridge[i];
        }
        Some(-self.hessian.cholesky()?.solve(&self.gradient))
    }
}

impl Fit {
    /// No flaw: nothing is free.
    pub(super) fn of_nothing(problem: &Problem<'_>) -> Self {
        let residuals = problem.base.clone();
        let sigma_px = robust_sigma_px(&residuals);
        let weights = residuals.iter().map(|r| huber_weight(r.norm(), sigma_px)).collect();
        Self {
            flaws: vec![],
            parameters: vec![],
            theta: Theta::zero(),
            residuals,
            jacobian: vec![],
            weights,
            sigma_px,
        }
    }

    /// Fits some flaws together, from a start.
    pub(super) fn solve(problem: &Problem<'_>, flaws: &[Flaw], start: &Theta) -> Result<Self, DiagnoseError> {
        let parameters: Vec<usize> = flaws.iter().copied().flat_map(Flaw::parameters).collect();
        let mut fit = Self {
            flaws: flaws.to_vec(),
            theta: first_theta(problem, flaws, start)?,
            ..Self::of_nothing(problem)
        };
        fit.parameters = parameters;
        fit.residuals = problem.residuals(&fit.theta)?;
        let mut damping = 1e-4;
        for _ in 0..MAX_STEPS {
            fit.sigma_px = robust_sigma_px(&fit.residuals);
            fit.weights = fit.residuals.iter().map(|r| huber_weight(r.norm(), fit.sigma_px)).collect();
            fit.jacobian = problem.jacobian(&fit.theta, &fit.parameters)?;
            if !fit.step(problem, &mut damping)? {
                return Ok(fit);
            }
        }
        // The last step moved the residuals away from their derivatives.
        fit.jacobian = problem.jacobian(&fit.theta, &fit.parameters)?;
        Ok(fit)
    }

    /// One accepted step; false where none is left to take.
    fn step(&mut self, problem: &Problem<'_>, damping: &mut f64) -> Result<bool, DiagnoseError> {
        let all: Vec<usize> = (0..self.residuals.len()).collect();
        let ridge = self.ridge();
        let mut normal = self.normal(&all);
        for (i, parameter) in self.parameters.iter().enumerate() {
            normal.gradient[i] += ridge[i] * self.theta[*parameter];
        }
        let cost = |residuals: &[Residual], theta: &Theta| {
            let pull: f64 =
                self.parameters.iter().zip(ridge.iter()).map(|(p, r)| 0.5 * r * theta[*p].powi(2)).sum();
            residuals.iter().map(|r| huber_loss(r.norm(), self.sigma_px)).sum::<f64>() + pull
        };
        let now = cost(&self.residuals, &self.theta);
        while *damping < 1e8 {
            let Some(delta) = normal.clone().solve(&ridge, *damping) else {
                *damping *= 10.0;
                continue;
            };
            let mut theta = self.theta;
            for (parameter, d) in self.parameters.iter().zip(delta.iter()) {
                theta[*parameter] += d;
            }
            let small = |(p, d): (&usize, &f64)| d.abs() < CONVERGED * PARAMETERS[*p].typical;
            let last = self.parameters.iter().zip(delta.iter()).all(small);
            // Trial values may be no camera at all: those are refused as any bad step.
            let residuals = match problem.residuals(&theta) {
                Ok(residuals) => residuals,
                Err(DiagnoseError::Diverged) => {
                    *damping *= 10.0;
                    continue;
                }
                Err(error) => return Err(error),
            };
            if cost(&residuals, &theta) < now {
                (self.theta, self.residuals) = (theta, residuals);
                *damping = (*damping / 10.0).max(1e-9);
                return Ok(!last);
            }
            if last {
                return Ok(false);
            }
            *damping *= 10.0;
        }
        Ok(false)
    }

    /// The weak pull to zero that keeps what the labels do not say at zero.
    pub(super) fn ridge(&self) -> DVector<f64> {
        let variance = self.sigma_px * self.sigma_px;
        DVector::from_iterator(
            self.parameters.len(),
            self.parameters.iter().map(|p| variance / PARAMETERS[*p].plausible.powi(2)),
        )
    }

    /// The quadratic piece of some labels.
    pub(super) fn normal(&self, labels: &[usize]) -> Normal {
        let mut normal = Normal::zeros(self.parameters.len());
        for label in labels {
            let rows = self.rows(*label);
            let weight = self.weights[*label];
            normal.hessian += rows.transpose() * &rows * weight;
            normal.gradient += rows.transpose() * self.residuals[*label] * weight;
        }
        normal
    }

    /// The two rows of a label in the Jacobian.
    pub(super) fn rows(&self, label: usize) -> Matrix2xX<f64> {
        Matrix2xX::from_fn(self.parameters.len(), |row, column| self.jacobian[column][label][row])
    }

    /// The same solution with only one of its flaws free.
    pub(super) fn only(&self, flaw: Flaw) -> Self {
        let of_flaw = |p: &usize| flaw.parameters().contains(p);
        let columns = self.parameters.iter().zip(&self.jacobian).filter(|(p, _)| of_flaw(p));
        Self {
            flaws: vec![flaw],
            parameters: flaw.parameters().collect(),
            jacobian: columns.map(|(_, column)| column.clone()).collect(),
            ..self.clone()
        }
    }

    /// RMSE_2D with the flaws taken out.
    pub(super) fn rmse_px(&self) -> f64 {
        rmse_px(&self.residuals)
    }
}

/// The start, with the best of a coarse row of clock offsets where that is free.
fn first_theta(problem: &Problem<'_>, flaws: &[Flaw], start: &Theta) -> Result<Theta, DiagnoseError> {
    if !flaws.contains(&Flaw::ClockOffset) || start.of(Flaw::ClockOffset)[0] != 0.0 {
        return Ok(*start);
    }
    let sigma_px = robust_sigma_px(&problem.base);
    let steps = (FIRST_OFFSETS_S / OFFSET_STEP_S) as i32;
    let mut best = (f64::INFINITY, *start);
    for step in -steps..=steps {
        let theta = start.with(Flaw::ClockOffset, &[f64::from(step) * OFFSET_STEP_S]);
        let cost: f64 = problem.residuals(&theta)?.iter().map(|r| huber_loss(r.norm(), sigma_px)).sum();
        if cost < best.0 {
            best = (cost, theta);
        }
    }
    Ok(best.1)
}

/// Standard deviation of one coordinate from the median length: that of a normal distribution in the plane is
/// `√(2 ln 2)` deviations long.
pub(super) fn robust_sigma_px(residuals: &[Residual]) -> f64 {
    let mut lengths: Vec<f64> = residuals.iter().map(|r| r.norm()).collect();
    lengths.sort_by(f64::total_cmp);
    let median = lengths.get(lengths.len() / 2).copied().unwrap_or(0.0);
    (median / (2.0 * std::f64::consts::LN_2).sqrt()).max(FLOOR_PX)
}

fn huber_weight(length_px: f64, sigma_px: f64) -> f64 {
    (HUBER * sigma_px / length_px.max(f64::MIN_POSITIVE)).min(1.0)
}

/// Half the squared length up to [`HUBER`] deviations, linear beyond.
pub(super) fn huber_loss(length_px: f64, sigma_px: f64) -> f64 {
    let knee = HUBER * sigma_px;
    if length_px <= knee { 0.5 * length_px * length_px } else { knee * (length_px - 0.5 * knee) }
}
