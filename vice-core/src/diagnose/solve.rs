//! Robust least squares: Levenberg-Marquardt, reweighted at each step by the noise of what is left ([`Noise`]).
//!
//! Well-kept solver crates take no weights that change from step to step, and follow other versions of the matrices.

use nalgebra::{DMatrix, DVector};

use super::DiagnoseError;
use super::blocks::{Blocks, Cell};
use super::flaw::{Flaw, PARAMETERS};
use super::noise::{Noise, Whitener, coordinate};
use super::problem::{Problem, Residual, rmse_px};
use super::theta::Theta;

const MAX_STEPS: usize = 40;
/// Widths of the differences, coarse to fine: a Z-map jumps from triangle to triangle as the camera is turned.
const WIDTHS: [f64; 3] = [16.0, 4.0, 1.0];
/// A step shorter than this share of the typical size of each parameter is the last.
const CONVERGED: f64 = 1e-4;
/// Rough depth is asked again at most so often after a solution has moved it.
const MOST_ASKED: usize = 3;
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
    /// Where rough depth was asked.
    pub(super) asked_at: Theta,
    /// RMSE_2D there, pixels: with rough depth the better of that with depth as asked and asked again there.
    pub(super) rmse_px: f64,
    /// Fitted residuals there.
    pub(super) residuals: Vec<Residual>,
    /// Derivatives there: one column for each parameter.
    pub(super) jacobian: Vec<Vec<Residual>>,
    /// The noise that is left there.
    pub(super) noise: Noise,
    /// The quadratic piece of each cell there.
    pub(super) pieces: Vec<Normal>,
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
    pub(super) fn of_nothing(problem: &Problem<'_>, blocks: &Blocks) -> Self {
        let residuals = problem.base_fitted.clone();
        Self {
            flaws: vec![],
            parameters: vec![],
            theta: Theta::zero(),
            asked_at: Theta::zero(),
            rmse_px: rmse_px(&problem.base),
            noise: Noise::of(&residuals, blocks),
            residuals,
            jacobian: vec![],
            pieces: vec![Normal::zeros(0); blocks.cells.len()],
        }
    }

    /// Fits some flaws together, from where another fit ended.
    pub(super) fn solve(
        problem: &Problem<'_>,
        blocks: &Blocks,
        flaws: &[Flaw],
        start: &Self,
    ) -> Result<Self, DiagnoseError> {
        let mut fit = Self {
            flaws: flaws.to_vec(),
            parameters: flaws.iter().copied().flat_map(Flaw::parameters).collect(),
            theta: first_theta(problem, flaws, start)?,
            asked_at: start.asked_at,
            ..Self::of_nothing(problem, blocks)
        };
        fit.residuals = problem.residuals(&fit.theta, &fit.asked_at)?;
        let moves_depth =
            |flaw: &Flaw| !matches!(flaw, Flaw::ClockOffset | Flaw::InitialTilt | Flaw::Scale | Flaw::Drift);
        let bumpy = problem.rough_segments.is_empty() && flaws.iter().any(moves_depth);
        fit.descend(problem, blocks, if bumpy { &WIDTHS } else { &WIDTHS[WIDTHS.len() - 1..] })?;
        for _ in 0..MOST_ASKED {
            if !problem.depth_moved(&fit.theta, &fit.asked_at)? {
                break;
            }
            fit.asked_at = fit.theta;
            fit.residuals = problem.residuals(&fit.theta, &fit.asked_at)?;
            fit.descend(problem, blocks, &WIDTHS[WIDTHS.len() - 1..])?;
        }
        // The last step moved the residuals away from their derivatives and pieces.
        fit.jacobian = problem.jacobian(&fit.theta, &fit.asked_at, &fit.parameters, 1.0)?;
        let whiteners = fit.reweighted(blocks);
        fit.pieces = fit.pieces_with(blocks, &whiteners);
        fit.rmse_px = match problem.rough_segments.is_empty() {
            true => rmse_px(&fit.residuals),
            false => {
                let [held, asked] = [&fit.asked_at, &fit.theta].map(|at| problem.scored(&fit.theta, at));
                rmse_px(&held?).min(rmse_px(&asked?))
            }
        };
        Ok(fit)
    }

    /// Steps down until none is left to take, by differences of one width after the other.
    fn descend(
        &mut self,
        problem: &Problem<'_>,
        blocks: &Blocks,
        widths: &[f64],
    ) -> Result<(), DiagnoseError> {
        for wider in widths {
            let mut damping = 1e-4;
            for _ in 0..MAX_STEPS {
                self.jacobian = problem.jacobian(&self.theta, &self.asked_at, &self.parameters, *wider)?;
                if !self.step(problem, blocks, &mut damping)? {
                    break;
                }
            }
        }
        Ok(())
    }

    /// One accepted step; false where none is left to take.
    fn step(
        &mut self,
        problem: &Problem<'_>,
        blocks: &Blocks,
        damping: &mut f64,
    ) -> Result<bool, DiagnoseError> {
        let whiteners = self.reweighted(blocks);
        let ridge = self.ridge();
        let mut normal = Normal::zeros(self.parameters.len());
        self.pieces_with(blocks, &whiteners).iter().for_each(|piece| normal.add(piece, 1.0));
        for (i, parameter) in self.parameters.iter().enumerate() {
            normal.gradient[i] += ridge[i] * self.theta[*parameter];
        }
        let cost = |residuals: &[Residual], theta: &Theta| {
            let pull: f64 =
                self.parameters.iter().zip(ridge.iter()).map(|(p, r)| 0.5 * r * theta[*p].powi(2)).sum();
            pull + 0.5 * squares(residuals, blocks, &whiteners)
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
            match problem.residuals(&theta, &self.asked_at) {
                Ok(residuals) if cost(&residuals, &theta) < now => {
                    (self.theta, self.residuals) = (theta, residuals);
                    *damping = (*damping / 10.0).max(1e-9);
                    return Ok(!last);
                }
                // What cannot be evaluated is a bad step as any other.
                Ok(_) | Err(DiagnoseError::CannotEvaluate(_)) if !last => *damping *= 10.0,
                Ok(_) | Err(DiagnoseError::CannotEvaluate(_)) => return Ok(false),
                Err(error) => return Err(error),
            }
        }
        Ok(false)
    }

    /// The noise of the residuals as they are, and what whitens each cell.
    fn reweighted(&mut self, blocks: &Blocks) -> Vec<Option<Whitener>> {
        self.noise = Noise::of(&self.residuals, blocks);
        let weights = self.noise.weights(&self.residuals, blocks);
        let whitener = |cell| self.noise.robust_whitener(cell, &self.residuals, &weights);
        blocks.cells.iter().map(whitener).collect()
    }

    fn pieces_with(&self, blocks: &Blocks, whiteners: &[Option<Whitener>]) -> Vec<Normal> {
        blocks
            .cells
            .iter()
            .zip(whiteners)
            .map(|(cell, whitener)| {
                let mut piece = Normal::zeros(self.parameters.len());
                if let Some(pull) = cell.pull {
                    let row = DVector::from_iterator(
                        self.parameters.len(),
                        self.jacobian.iter().map(|column| column[pull].x),
                    );
                    piece.gradient += &row * self.residuals[pull].x;
                    piece.hessian += &row * row.transpose();
                }
                let Some(whitener) = whitener else { return piece };
                for axis in [0, 1] {
                    let columns = whitener.apply(self.columns(cell, axis));
                    let residuals =
                        whitener.apply(DMatrix::from_columns(&[coordinate(&self.residuals, cell, axis)]));
                    piece.hessian += columns.transpose() * &columns;
                    piece.gradient += columns.transpose() * residuals.column(0);
                }
                piece
            })
            .collect()
    }

    /// One coordinate of the derivatives of a cell's labels: a column for each parameter.
    pub(super) fn columns(&self, cell: &Cell, axis: usize) -> DMatrix<f64> {
        DMatrix::from_fn(cell.labels.len(), self.parameters.len(), |row, column| {
            self.jacobian[column][cell.labels[row]][axis]
        })
    }

    /// The weak pull to zero that keeps what the labels do not say at zero.
    pub(super) fn ridge(&self) -> DVector<f64> {
        DVector::from_iterator(
            self.parameters.len(),
            self.parameters.iter().map(|p| PARAMETERS[*p].plausible.powi(-2)),
        )
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
        self.rmse_px
    }

    /// The depth error of a cell's segment in its deviations, the fit moved by a step; zero where it has none.
    pub(super) fn pull(&self, cell: &Cell, step: &DVector<f64>) -> f64 {
        cell.pull.map_or(0.0, |pull| {
            let moved: f64 = self.jacobian.iter().zip(step.iter()).map(|(c, s)| c[pull].x * s).sum();
            self.residuals[pull].x + moved
        })
    }
}

/// The start, with the best of a coarse row of clock offsets where that is free.
fn first_theta(problem: &Problem<'_>, flaws: &[Flaw], start: &Fit) -> Result<Theta, DiagnoseError> {
    let Fit { theta: start, asked_at, .. } = start;
    if !flaws.contains(&Flaw::ClockOffset) || start.of(Flaw::ClockOffset)[0] != 0.0 {
        return Ok(*start);
    }
    let steps = (FIRST_OFFSETS_S / OFFSET_STEP_S) as i32;
    let mut best = (f64::INFINITY, *start);
    for step in -steps..=steps {
        let theta = start.with(Flaw::ClockOffset, &[f64::from(step) * OFFSET_STEP_S]);
        let cost = match problem.residuals(&theta, asked_at) {
            // Lengths, not squares: outliers must not choose the valley.
            Ok(residuals) => residuals.iter().map(|r| r.norm()).sum(),
            Err(DiagnoseError::CannotEvaluate(_)) => f64::INFINITY,
            Err(error) => return Err(error),
        };
        if cost < best.0 {
            best = (cost, theta);
        }
    }
    Ok(best.1)
}

/// Sum of the squares of whitened residuals.
fn squares(residuals: &[Residual], blocks: &Blocks, whiteners: &[Option<Whitener>]) -> f64 {
    let cells = blocks.cells.iter().zip(whiteners);
    let whitened = cells.filter_map(|(cell, whitener)| {
        let both = [0, 1].map(|axis| coordinate(residuals, cell, axis));
        Some(whitener.as_ref()?.apply(DMatrix::from_columns(&both)).norm_squared())
    });
    let pulls = blocks.cells.iter().filter_map(|cell| cell.pull).map(|pull| residuals[pull].x.powi(2));
    whitened.sum::<f64>() + pulls.sum::<f64>()
}
