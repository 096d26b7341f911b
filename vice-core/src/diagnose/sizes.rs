//! The likeliest sizes of the noise of a fit, by the scores of the frames.

use nalgebra::{DMatrix, DVector};

use super::filter::{Jump, Whitened};
use super::fit::{Fit, TOGETHER, Work, frame_likelihoods};
use super::noise::{Logs, NoiseModel};
use super::normal::Solution;
use crate::parallel::*;

/// Step of a size's logarithm in differences.
const SIZE_STEP: f64 = 0.1;
/// Longest step of a size's logarithm.
const LONGEST_SIZE_STEP: f64 = 0.8;

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

impl Work<'_, '_> {
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
                self.solve_all(&some, logs, &jumps, |_, _, solution, whitened| {
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
                self.solve_all(&fits, &moved_logs, &jumps, |i, _, solution, whitened| {
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
}
