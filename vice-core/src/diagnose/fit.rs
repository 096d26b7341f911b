//! A hypothesis fitted to the labels: a set of flaws, their values, the sizes of the noise, and how likely all of it is.

use crate::parallel::*;
use nalgebra::DVector;

use super::DiagnoseError;
use super::filter::{Jump, Shifts, Weights, Whitened, whiten};
use super::flaw::{Flaw, PARAMETERS};
use super::geometry::Geometry;
use super::motion::Motion;
use super::noise::{Logs, NoiseModel};
use super::normal::{Normal, Solution};
use super::scene::{LOST_PX, Residual, Scene};
use super::theta::Theta;

/// Variance of a dead label over that of a usual one.
const DEAD: f64 = 1e8;
/// Three frames may have a jump if their squares exceed their number by so many deviations.
const EXCESS: f64 = 3.8;
/// ... in so many frames.
const USUAL_FRAMES: f64 = 300.0;

/// Fits whose passes are shared at a time: enough to save most of them, few enough for all threads and the memory.
pub(super) const TOGETHER: usize = 8;

/// What hypotheses are fitted to.
pub(super) struct Work<'s, 'a> {
    pub(super) scene: &'s Scene<'a>,
    pub(super) motion: &'s Motion<'a>,
    pub(super) geometry: Geometry,
    pub(super) noise: NoiseModel,
    pub(super) weights: Weights,
    /// Labels that cannot be carried where the geometry was taken: they count for nothing.
    pub(super) dead: Vec<bool>,
}

/// A fitted hypothesis.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) flaws: Vec<Flaw>,
    /// The parameters that are solved for.
    pub(super) parameters: Vec<usize>,
    /// Where residuals and columns were taken.
    pub(super) theta: Theta,
    pub(super) residuals: Vec<Residual>,
    pub(super) columns: Vec<Vec<Residual>>,
    pub(super) logs: Logs,
    pub(super) jumps: Vec<Jump>,
    /// What the jumps gain, as a logarithm, before their cost.
    pub(super) jump_gain: f64,
    pub(super) solution: Solution,
    /// Evidence with what sizes and jumps cost.
    pub(super) score: f64,
}

impl Fit {
    /// Values with the last step taken.
    pub(super) fn values(&self) -> Theta {
        let mut theta = self.theta;
        for (parameter, step) in self.parameters.iter().zip(self.solution.step.iter()) {
            theta[*parameter] += step;
        }
        theta
    }

    /// Where a parameter stands among those that are solved for.
    pub(super) fn place_of(&self, parameter: usize) -> Option<usize> {
        self.parameters.iter().position(|p| *p == parameter)
    }

    pub(super) fn linearised_at(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| self.theta[*p]).collect()
    }

    /// Residuals with the last step taken.
    pub(super) fn residuals_now(&self) -> Vec<Residual> {
        let mut residuals = self.residuals.clone();
        for (column, step) in self.columns.iter().zip(self.solution.step.iter()) {
            residuals.iter_mut().zip(column).for_each(|(r, c)| *r += c * *step);
        }
        residuals
    }
}

pub(super) fn parameters_of(flaws: &[Flaw]) -> Vec<usize> {
    flaws.iter().flat_map(|f| f.solved()).collect()
}

pub(super) fn expected_of(parameters: &[usize]) -> Vec<f64> {
    parameters.iter().map(|p| PARAMETERS[*p].expected).collect()
}

/// What jumps cost beside what they gain: when they were, and how large.
pub(super) fn jump_cost(frames: usize) -> f64 {
    (frames.max(2) as f64).ln() + 2.0
}

impl<'s, 'a> Work<'s, 'a> {
    /// Geometry at some values, and all labels of usual weight that can be carried there.
    pub(super) fn new(
        scene: &'s Scene<'a>,
        motion: &'s Motion<'a>,
        noise: NoiseModel,
        theta: &Theta,
    ) -> Result<Self, DiagnoseError> {
        let view = scene.view(theta, motion)?;
        let geometry = Geometry::new(scene, &view, noise.inertial);
        let dead: Vec<bool> = view.residuals().iter().map(|r| r.x.is_nan()).collect();
        let keys = vec![1.0; scene.segments.len()];
        let weights = Weights { labels: vec![1.0; scene.labels.len()], keys };
        let mut work = Self { scene, motion, geometry, noise, weights, dead };
        work.weights = work.without_dead(work.weights.clone());
        Ok(work)
    }

    /// Weights under which dead labels count for nothing.
    pub(super) fn without_dead(&self, mut weights: Weights) -> Weights {
        weights.labels.iter_mut().zip(&self.dead).filter(|(_, dead)| **dead).for_each(|(w, _)| *w = DEAD);
        weights
    }

    /// RMS length of the labels that can be carried, pixels.
    pub(super) fn rms(&self, residuals: &[Residual]) -> f64 {
        let alive = || residuals.iter().zip(&self.dead).filter(|(_, dead)| !**dead).map(|(r, _)| r);
        (alive().map(|r| r.norm_squared()).sum::<f64>() / alive().count().max(1) as f64).sqrt()
    }
}

impl Work<'_, '_> {
    pub(super) fn residuals(&self, theta: &Theta) -> Result<Vec<Residual>, DiagnoseError> {
        let lost = Residual::new(LOST_PX, LOST_PX);
        let mut residuals = self.scene.residuals(theta, self.motion)?;
        for r in &mut residuals {
            if r.norm() < LOST_PX {
                continue;
            }
            *r = if r.x.is_nan() { lost } else { *r * (LOST_PX / r.norm()) };
        }
        Ok(residuals)
    }

    pub(super) fn whiten(
        &self,
        residuals: &[Residual],
        columns: &[Vec<Residual>],
        logs: &Logs,
        jumps: &[Jump],
    ) -> Whitened {
        let all: Vec<&[Residual]> =
            std::iter::once(residuals).chain(columns.iter().map(Vec::as_slice)).collect();
        whiten(&self.geometry, &all, &self.noise.sizes(logs), &self.weights, jumps, Shifts::Nobodys)
    }

    /// The solution of a linearised fit with other sizes or jumps.
    pub(super) fn solve(&self, fit: &Fit, logs: &Logs, jumps: &[Jump]) -> (Solution, Whitened) {
        let whitened = self.whiten(&fit.residuals, &fit.columns, logs, jumps);
        let columns: Vec<usize> = (1..whitened.width).collect();
        let solution =
            Normal::of(&whitened, &columns).solve(&fit.linearised_at(), &expected_of(&fit.parameters));
        (solution, whitened)
    }

    pub(super) fn score(&self, solution: &Solution, logs: &Logs, jumps: &[Jump]) -> f64 {
        solution.evidence + self.noise.prior(logs)
            - jumps.len() as f64 * jump_cost(self.geometry.frames.len())
    }

    /// The same work, to be changed.
    pub(super) fn same(&self) -> Self {
        Self {
            scene: self.scene,
            motion: self.motion,
            geometry: self.geometry.clone(),
            noise: self.noise,
            weights: self.weights.clone(),
            dead: self.dead.clone(),
        }
    }

    /// A fit with its solution as the outliers, sizes and jumps are now.
    pub(super) fn rescored(&self, fit: Fit) -> Fit {
        let (solution, _) = self.solve(&fit, &fit.logs, &fit.jumps);
        let score = self.score(&solution, &fit.logs, &fit.jumps);
        Fit { solution, score, ..fit }
    }

    /// The solutions of fits with the same sizes and jumps in one pass, with what `then` makes of each.
    pub(super) fn solve_all<T: Send>(
        &self,
        fits: &[&Fit],
        logs: &Logs,
        jumps: &[Jump],
        then: impl Fn(usize, &Normal, Solution, &Whitened) -> T,
    ) -> Vec<T> {
        let all: Vec<&[Residual]> = fits
            .iter()
            .flat_map(|fit| std::iter::once(&fit.residuals).chain(&fit.columns).map(Vec::as_slice))
            .collect();
        let together =
            whiten(&self.geometry, &all, &self.noise.sizes(logs), &self.weights, jumps, Shifts::Nobodys);
        let mut first = 0;
        let one = |(i, fit): (usize, &&Fit)| {
            let places: Vec<usize> = (first..=first + fit.columns.len()).collect();
            first += places.len();
            let whitened = together.of_columns(&places);
            let columns: Vec<usize> = (1..whitened.width).collect();
            let normal = Normal::of(&whitened, &columns);
            let solution = normal.solve(&fit.linearised_at(), &expected_of(&fit.parameters));
            then(i, &normal, solution, &whitened)
        };
        fits.iter().enumerate().map(one).collect()
    }

    /// With the jumps that make it likelier by far.
    pub(super) fn with_jumps(&self, fit: Fit, most: usize) -> Fit {
        let mut fit = fit;
        let frames = self.geometry.frames.len();
        for _ in 0..most {
            let (solution, whitened) = self.solve(&fit, &fit.logs, &fit.jumps);
            let excess = frame_excess(&whitened, &solution.step);
            // Where three frames together are worst.
            let sum = |f: usize| excess[f.saturating_sub(1)..(f + 2).min(frames)].iter().sum::<f64>();
            let Some(worst) = (1..frames).max_by(|a, b| sum(*a).total_cmp(&sum(*b))) else { break };
            let rows = |f: usize| {
                whitened.frame_rows[(f + 2).min(frames)] - whitened.frame_rows[f.saturating_sub(1)]
            };
            // The worst of many frames is worse by chance.
            let limit = EXCESS + 0.5 * (frames as f64 / USUAL_FRAMES).max(1.0).ln();
            if sum(worst) < limit * (2.0 * rows(worst) as f64).sqrt() {
                break;
            }
            let tries: Vec<Jump> = [(0, 0), (0, 1), (2, 3), (0, 5), (5, 0), (5, 6), (1, 10), (10, 1)]
                .iter()
                .map(|(before, after)| Jump {
                    from: worst.saturating_sub(*before).max(1),
                    to: (worst + after).min(frames - 1),
                    m: 0.08,
                    rad: 1.2_f64.to_radians(),
                })
                .chain([Jump {
                    from: worst.saturating_sub(1).max(1),
                    to: worst.saturating_sub(1).max(1),
                    m: 0.08,
                    rad: 1.2_f64.to_radians(),
                }])
                .collect();
            let best = tries
                .par_iter()
                .map(|jump| {
                    let jumps: Vec<Jump> = fit.jumps.iter().copied().chain([*jump]).collect();
                    let (solution, _) = self.solve(&fit, &fit.logs, &jumps);
                    let score = self.score(&solution, &fit.logs, &jumps);
                    (score, jumps, solution)
                })
                .reduce_with(|a, b| if b.0 > a.0 { b } else { a });
            let Some((score, jumps, solution)) = best else { break };
            let candidate = self.sized(Fit { jumps, solution, score, ..fit.clone() }, 2);
            // The cost is in the score already; two more to be worth its name.
            if candidate.score < fit.score + 2.0 {
                break;
            }
            let gain = candidate.score - fit.score + jump_cost(frames);
            fit = Fit { jump_gain: fit.jump_gain + gain, ..candidate };
        }
        fit
    }
}

/// Log likelihood of each frame at a step.
pub(super) fn frame_likelihoods(whitened: &Whitened, step: &DVector<f64>) -> Vec<f64> {
    frame_squares(whitened, step)
        .into_iter()
        .zip(&whitened.log_variances)
        .map(|((squares, _), log)| -0.5 * squares - 0.5 * log)
        .collect()
}

/// By how much the squares of a frame exceed their number.
pub(super) fn frame_excess(whitened: &Whitened, step: &DVector<f64>) -> Vec<f64> {
    frame_squares(whitened, step).into_iter().map(|(squares, rows)| squares - rows as f64).collect()
}

fn frame_squares(whitened: &Whitened, step: &DVector<f64>) -> Vec<(f64, usize)> {
    let width = whitened.width;
    whitened
        .frame_rows
        .windows(2)
        .map(|w| {
            let rows = whitened.rows[w[0] * width..w[1] * width].chunks_exact(width);
            let squares = rows
                .map(|row| {
                    let moved: f64 = row[1..].iter().zip(step.iter()).map(|(q, s)| q * s).sum();
                    (row[0] + moved).powi(2)
                })
                .sum();
            (squares, w[1] - w[0])
        })
        .collect()
}
