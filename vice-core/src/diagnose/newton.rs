//! Hypotheses fitted by Gauss-Newton's method at given sizes of the noise: many together, since a pass over the frames costs
//! little more for the columns of all than for those of one.

use nalgebra::{DMatrix, DVector};

use super::DiagnoseError;
use super::filter::Jump;
use super::fit::{Fit, TOGETHER, Work, expected_of, parameters_of};
use super::flaw::{Flaw, PARAMETERS};
use super::noise::Logs;
use super::normal::{Normal, Solution, WIDE_TIMES};
use super::theta::Theta;
use crate::parallel::*;

/// A hypothesis on its way to its best values.
pub(super) struct Way {
    flaws: Vec<Flaw>,
    parameters: Vec<usize>,
    theta: Theta,
    logs: Logs,
    jumps: Vec<Jump>,
    /// The least cost so far, and the fit there.
    best: Option<(f64, Fit)>,
    ended: bool,
    failed: Option<DiagnoseError>,
}

impl Way {
    pub(super) fn new(flaws: &[Flaw], start: &Theta, logs: &Logs, jumps: &[Jump]) -> Self {
        Self {
            flaws: flaws.to_vec(),
            parameters: parameters_of(flaws),
            theta: *start,
            logs: *logs,
            jumps: jumps.to_vec(),
            best: None,
            ended: false,
            failed: None,
        }
    }

    /// Residuals and columns at the values as they are.
    fn linearised(&self, work: &Work<'_, '_>) -> Result<Fit, DiagnoseError> {
        let residuals = work.residuals(&self.theta)?;
        let columns = work.scene.columns(&self.theta, work.motion, &self.parameters)?;
        let solution = Solution {
            step: DVector::zeros(0),
            covariance: DMatrix::zeros(0, 0),
            evidence: 0.0,
            likelihood: 0.0,
        };
        Ok(Fit {
            flaws: self.flaws.clone(),
            parameters: self.parameters.clone(),
            theta: self.theta,
            residuals,
            columns,
            logs: self.logs,
            jumps: self.jumps.clone(),
            jump_gain: 0.0,
            solution,
            score: 0.0,
        })
    }

    /// A solution where nothing can be evaluated: the end, or the failure of a way that has not begun.
    fn refused(&mut self, error: DiagnoseError) {
        self.ended = true;
        if self.best.is_none() {
            self.failed = Some(error);
        }
    }

    /// Takes a solution in and steps on.
    fn step(&mut self, fit: Fit, squares: f64) {
        let expected = expected_of(&self.parameters);
        let pull: f64 =
            fit.linearised_at().iter().zip(&expected).map(|(x, s)| (x / (WIDE_TIMES * s)).powi(2)).sum();
        let cost = squares + pull;
        match &mut self.best {
            Some((least, kept)) if cost > *least => {
                // Too far: half of the way, from where it was best.
                for (parameter, step) in self.parameters.iter().zip(kept.solution.step.iter()) {
                    let (now, before) = (self.theta[*parameter], kept.theta[*parameter]);
                    let share = (now - before) / (before + step - before);
                    let share = if share.is_finite() { 0.4 * share } else { 0.0 };
                    self.theta[*parameter] = before + share * step;
                }
                return;
            }
            _ => {}
        }
        let steps = fit.solution.step.iter().zip(&self.parameters);
        self.ended = steps.into_iter().all(|(s, p)| s.abs() < 0.02 * PARAMETERS[*p].typical);
        self.theta = fit.values();
        if self.best.as_ref().is_none_or(|(least, _)| cost <= *least) {
            self.best = Some((cost, fit));
        }
    }

    fn end(self) -> Result<Fit, DiagnoseError> {
        match (self.best, self.failed) {
            (_, Some(error)) => Err(error),
            (Some((_, fit)), None) => Ok(fit),
            (None, None) => Err(DiagnoseError::CannotEvaluate("the fit does not start".to_string())),
        }
    }
}

impl Work<'_, '_> {
    /// A hypothesis from some values.
    pub(super) fn newton(
        &self,
        flaws: &[Flaw],
        start: &Theta,
        logs: &Logs,
        jumps: &[Jump],
        steps: usize,
    ) -> Result<Fit, DiagnoseError> {
        let none = || Err(DiagnoseError::CannotEvaluate("the fit does not start".to_string()));
        self.newton_all(vec![Way::new(flaws, start, logs, jumps)], steps).pop().unwrap_or_else(none)
    }

    /// Several, in their order: the same as one by one.
    pub(super) fn newton_all(&self, mut ways: Vec<Way>, steps: usize) -> Vec<Result<Fit, DiagnoseError>> {
        for _ in 0..=steps {
            let going: Vec<usize> = (0..ways.len()).filter(|i| !ways[*i].ended).collect();
            let linearised: Vec<Result<Fit, DiagnoseError>> = match &going[..] {
                [] => break,
                [one] => vec![ways[*one].linearised(self)],
                _ => going.par_iter().map(|i| ways[*i].linearised(self)).collect(),
            };
            let mut fits: Vec<(usize, Fit)> = Vec::new();
            for (i, fit) in going.into_iter().zip(linearised) {
                match fit {
                    Ok(fit) => fits.push((i, fit)),
                    Err(error) => ways[i].refused(error),
                }
            }
            let solved: Vec<Vec<(usize, f64, Solution, f64)>> = alike(&fits)
                .par_iter()
                .map(|places| {
                    let some: Vec<&Fit> = places.iter().map(|place| &fits[*place].1).collect();
                    let (logs, jumps) = (&some[0].logs, &some[0].jumps);
                    self.solve_all(&some, logs, jumps, |i, normal: &Normal, solution, _| {
                        let score = self.score(&solution, logs, jumps);
                        (places[i], normal.squares, solution, score)
                    })
                })
                .collect();
            let mut solved: Vec<_> = solved.into_iter().flatten().collect();
            solved.sort_by_key(|(place, ..)| *place);
            for ((i, fit), (_, squares, solution, score)) in fits.into_iter().zip(solved) {
                ways[i].step(Fit { solution, score, ..fit }, squares);
            }
        }
        ways.into_iter().map(Way::end).collect()
    }
}

/// Places of fits with the same sizes and jumps, some together.
fn alike(fits: &[(usize, Fit)]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (place, (_, fit)) in fits.iter().enumerate() {
        let same = |group: &&mut Vec<usize>| {
            let first = &fits[group[0]].1;
            group.len() < TOGETHER && first.logs == fit.logs && first.jumps == fit.jumps
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.push(place),
            None => groups.push(vec![place]),
        }
    }
    groups
}
