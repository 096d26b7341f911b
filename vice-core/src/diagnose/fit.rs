//! A hypothesis fitted to the labels: a set of flaws, their values, the sizes of the noise, and how likely all of it is.

use crate::parallel::*;
use nalgebra::{DMatrix, DVector};

use super::DiagnoseError;
use super::filter::{Jump, Shifts, Weights, Whitened, whiten};
use super::flaw::{Flaw, PARAMETERS};
use super::geometry::Geometry;
use super::motion::Motion;
use super::noise::{Logs, NoiseModel};
use super::normal::{Normal, Solution, WIDE_TIMES};
use super::scene::{LOST_PX, Residual, Scene};
use super::theta::Theta;

/// Step of a size's logarithm in differences.
const SIZE_STEP: f64 = 0.1;
/// Variance of a dead label over that of a usual one.
const DEAD: f64 = 1e8;
/// Three frames may have a jump if their squares exceed their number by so many deviations.
const EXCESS: f64 = 3.8;
/// ... in so many frames.
const USUAL_FRAMES: f64 = 300.0;
/// Longest step of a size's logarithm.
const LONGEST_SIZE_STEP: f64 = 0.8;

/// Fits whose passes are shared at a time: enough to save most of them, few enough for all threads and the memory.
const TOGETHER: usize = 6;

/// Scores of frames that differ by less than this share of their squares are all alike.
const ALIKE: f64 = 0.1;

/// The scores of frames, of which the squares tell how sharp the likelihood is. Where they are all alike, as those of the
/// labels' noise are where all labels are far nearer than it, that is slope and no sharpness, and would shorten each step to
/// an eighth: then only how they differ is left.
fn unlike(scores: Vec<f64>) -> Vec<f64> {
    let count = scores.len().max(1) as f64;
    let mean = scores.iter().sum::<f64>() / count;
    let squares: f64 = scores.iter().map(|s| s * s).sum();
    match squares - count * mean * mean < ALIKE * squares {
        true => scores.into_iter().map(|s| s - mean).collect(),
        false => scores,
    }
}

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

/// A fit before a step of its sizes.
struct Base {
    solution: Solution,
    score: f64,
    /// Log likelihood of each frame.
    frames: Vec<f64>,
}

/// What a longer size changes: the score, and the likelihood of each frame, for a step of its logarithm.
struct Moved {
    slope: f64,
    scores: Vec<f64>,
}

fn moved_by(logs: &Logs, size: usize) -> Logs {
    let mut logs = *logs;
    logs[size] += SIZE_STEP;
    logs
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
        let dead: Vec<bool> = scene.labels.iter().map(|l| view.residual(l).is_none()).collect();
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
        Ok(self
            .scene
            .residuals(theta, self.motion)?
            .into_iter()
            .map(|r| r.map_or(lost, |r| if r.norm() < LOST_PX { r } else { r * (LOST_PX / r.norm()) }))
            .collect())
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

    fn score(&self, solution: &Solution, logs: &Logs, jumps: &[Jump]) -> f64 {
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

    /// A hypothesis by Gauss-Newton's method from some values, at given sizes.
    pub(super) fn newton(
        &self,
        flaws: &[Flaw],
        start: &Theta,
        logs: &Logs,
        jumps: &[Jump],
        steps: usize,
    ) -> Result<Fit, DiagnoseError> {
        let parameters = parameters_of(flaws);
        let expected = expected_of(&parameters);
        let mut theta = *start;
        let mut best: Option<(f64, Fit)> = None;
        for i in 0..=steps {
            let evaluated = self
                .residuals(&theta)
                .and_then(|r| Ok((r, self.scene.columns(&theta, self.motion, &parameters)?)));
            let (residuals, columns) = match (evaluated, &best) {
                (Ok(evaluated), _) => evaluated,
                (Err(error), None) => return Err(error),
                (Err(_), Some(_)) => break,
            };
            let fit = Fit {
                flaws: flaws.to_vec(),
                parameters: parameters.clone(),
                theta,
                residuals,
                columns,
                logs: *logs,
                jumps: jumps.to_vec(),
                jump_gain: 0.0,
                solution: Solution {
                    step: DVector::zeros(0),
                    covariance: DMatrix::zeros(0, 0),
                    evidence: 0.0,
                    likelihood: 0.0,
                },
                score: 0.0,
            };
            let whitened = self.whiten(&fit.residuals, &fit.columns, logs, jumps);
            let all: Vec<usize> = (1..whitened.width).collect();
            let normal = Normal::of(&whitened, &all);
            let solution = normal.solve(&fit.linearised_at(), &expected);
            let pull: f64 =
                fit.linearised_at().iter().zip(&expected).map(|(x, s)| (x / (WIDE_TIMES * s)).powi(2)).sum();
            let cost = normal.squares + pull;
            let score = self.score(&solution, logs, jumps);
            let fit = Fit { solution, score, ..fit };
            match &mut best {
                Some((least, kept)) if cost > *least => {
                    // Too far: half of the way, from where it was best.
                    for (parameter, step) in parameters.iter().zip(kept.solution.step.iter()) {
                        let whole = kept.theta[*parameter] + step;
                        let share =
                            (theta[*parameter] - kept.theta[*parameter]) / (whole - kept.theta[*parameter]);
                        let share = if share.is_finite() { 0.4 * share } else { 0.0 };
                        theta[*parameter] = kept.theta[*parameter] + share * step;
                    }
                    continue;
                }
                _ => {}
            }
            let done = fit
                .solution
                .step
                .iter()
                .zip(&parameters)
                .all(|(s, p)| s.abs() < 0.02 * PARAMETERS[*p].typical);
            theta = fit.values();
            let better = best.as_ref().is_none_or(|(least, _)| cost <= *least);
            if better {
                best = Some((cost, fit));
            }
            if done || i == steps {
                break;
            }
        }
        best.map(|(_, fit)| fit)
            .ok_or_else(|| DiagnoseError::CannotEvaluate("the fit does not start".to_string()))
    }

    /// The solutions of fits with the same sizes and jumps in one pass, with what `then` makes of each.
    fn solve_all<T: Send>(
        &self,
        fits: &[&Fit],
        logs: &Logs,
        jumps: &[Jump],
        then: impl Fn(usize, Solution, &Whitened) -> T,
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
            then(i, normal.solve(&fit.linearised_at(), &expected_of(&fit.parameters)), &whitened)
        };
        fits.iter().enumerate().map(one).collect()
    }

    /// Fits with the outliers as they are now, and the same sizes for all of them; those that `wants` are then given sizes of
    /// their own in one round. As [`Work::rescored`] and [`Work::sized`] one by one, but passes are shared.
    pub(super) fn sized_together(
        &self,
        fits: Vec<Fit>,
        logs: &Logs,
        wants: impl Fn(&Fit) -> bool + Sync,
    ) -> Vec<Fit> {
        let alike = fits.windows(2).all(|pair| pair[0].jumps == pair[1].jumps);
        let Some(jumps) = fits.first().map(|fit| fit.jumps.clone()).filter(|_| alike) else {
            let one = |fit: Fit| {
                let fit = self.rescored(Fit { logs: *logs, ..fit });
                if wants(&fit) { self.sized(fit, 1) } else { fit }
            };
            return fits.into_par_iter().map(one).collect();
        };
        let some: Vec<&[Fit]> = fits.chunks(TOGETHER).collect();
        let bases: Vec<Base> = some
            .par_iter()
            .map(|some| {
                let some: Vec<&Fit> = some.iter().collect();
                self.solve_all(&some, logs, &jumps, |_, solution, whitened| {
                    self.base(solution, whitened, logs, &jumps)
                })
            })
            .collect::<Vec<_>>()
            .into_iter()
            .flatten()
            .collect();
        let rescored: Vec<(Fit, Base)> = fits
            .into_iter()
            .zip(bases)
            .map(|(fit, base)| {
                (Fit { logs: *logs, solution: base.solution.clone(), score: base.score, ..fit }, base)
            })
            .collect();
        let wanted: Vec<usize> = (0..rescored.len()).filter(|i| wants(&rescored[*i].0)).collect();
        let parts: Vec<(usize, &[usize])> = self
            .noise
            .free()
            .iter()
            .flat_map(|size| wanted.chunks(TOGETHER).map(move |some| (*size, some)))
            .collect();
        let moved: Vec<Vec<(usize, usize, Moved)>> = parts
            .into_par_iter()
            .map(|(size, some)| {
                let moved_logs = moved_by(logs, size);
                let fits: Vec<&Fit> = some.iter().map(|i| &rescored[*i].0).collect();
                self.solve_all(&fits, &moved_logs, &jumps, |i, solution, whitened| {
                    let base = &rescored[some[i]].1;
                    (some[i], size, self.moved(base, &solution, whitened, &moved_logs, &jumps))
                })
            })
            .collect();
        let mut by_fit: Vec<Vec<(usize, Moved)>> = rescored.iter().map(|_| Vec::new()).collect();
        for (fit, size, moved) in moved.into_iter().flatten() {
            by_fit[fit].push((size, moved));
        }
        let all: Vec<_> = rescored.into_iter().zip(by_fit).collect();
        all.into_par_iter()
            .map(|((fit, base), mut moved)| {
                if moved.is_empty() {
                    return fit;
                }
                moved.sort_by_key(|(size, _)| *size);
                let moved: Vec<Moved> = moved.into_iter().map(|(_, moved)| moved).collect();
                self.stepped(fit, base, &moved).0
            })
            .collect()
    }

    fn base(&self, solution: Solution, whitened: &Whitened, logs: &Logs, jumps: &[Jump]) -> Base {
        let score = self.score(&solution, logs, jumps);
        Base { frames: frame_likelihoods(whitened, &solution.step), score, solution }
    }

    /// What a longer size changes, at the values of the fit as it is.
    fn moved(
        &self,
        base: &Base,
        solution: &Solution,
        whitened: &Whitened,
        logs: &Logs,
        jumps: &[Jump],
    ) -> Moved {
        let slope = (self.score(solution, logs, jumps) - base.score) / SIZE_STEP;
        let scores: Vec<f64> = frame_likelihoods(whitened, &base.solution.step)
            .iter()
            .zip(&base.frames)
            .map(|(a, b)| (a - b) / SIZE_STEP)
            .collect();
        Moved { slope, scores: unlike(scores) }
    }

    /// One step of the sizes; and the solution there, where it is a gain that is worth another.
    fn stepped(&self, fit: Fit, base: Base, moved: &[Moved]) -> (Fit, Option<(Solution, Whitened)>) {
        let free = self.noise.free();
        let n = free.len();
        let hessian = DMatrix::from_fn(n, n, |a, b| {
            let sum: f64 = moved[a].scores.iter().zip(&moved[b].scores).map(|(x, y)| x * y).sum();
            if a == b { sum + NoiseModel::deviation(free[a]).powi(-2) } else { sum }
        });
        let gradient = DVector::from_iterator(n, moved.iter().map(|m| m.slope));
        let Some(chol) = hessian.cholesky() else { return (fit, None) };
        let mut step = chol.solve(&gradient);
        let longest = step.amax();
        if longest > LONGEST_SIZE_STEP {
            step *= LONGEST_SIZE_STEP / longest;
        }
        for _ in 0..3 {
            let mut logs = fit.logs;
            free.iter().zip(step.iter()).for_each(|(size, s)| {
                logs[*size] = (logs[*size] + s).clamp(-3.0, 3.0);
            });
            let (solution, whitened) = self.solve(&fit, &logs, &fit.jumps);
            let score = self.score(&solution, &logs, &fit.jumps);
            if score > base.score {
                let goes_on = (score - base.score >= 0.05).then(|| (solution.clone(), whitened));
                return (Fit { logs, solution, score, ..fit }, goes_on);
            }
            step *= 0.35;
        }
        (Fit { solution: base.solution, score: base.score, ..fit }, None)
    }

    /// With sizes of noise of its own: the likeliest ones, by the scores of the frames.
    pub(super) fn sized(&self, fit: Fit, rounds: usize) -> Fit {
        let mut fit = fit;
        let mut known: Option<(Solution, Whitened)> = None;
        for _ in 0..rounds {
            let (solution, whitened) =
                known.take().unwrap_or_else(|| self.solve(&fit, &fit.logs, &fit.jumps));
            let base = self.base(solution, &whitened, &fit.logs, &fit.jumps);
            drop(whitened);
            let moved: Vec<Moved> = self
                .noise
                .free()
                .par_iter()
                .map(|size| {
                    let logs = moved_by(&fit.logs, *size);
                    let (solution, whitened) = self.solve(&fit, &logs, &fit.jumps);
                    self.moved(&base, &solution, &whitened, &logs, &fit.jumps)
                })
                .collect();
            (fit, known) = self.stepped(fit, base, &moved);
            if known.is_none() {
                break;
            }
        }
        fit
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
fn frame_likelihoods(whitened: &Whitened, step: &DVector<f64>) -> Vec<f64> {
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
