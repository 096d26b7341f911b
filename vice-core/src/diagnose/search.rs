//! All hypotheses: none, each flaw, pairs; fitted to the same labels with the same outliers, by their evidence.

use crate::parallel::*;

use super::DiagnoseError;
use super::filter::Weights;
use super::fit::{Fit, Work, expected_of, parameters_of};
use super::flaw::Flaw;
use super::gross::independent;
use super::newton::Way;
use super::noise::Logs;
use super::normal::Normal;
use super::outliers;
use super::starts::{robust_cost, start};
use super::theta::Theta;

/// Sizes are estimated for hypotheses this close to the best one, as a logarithm.
const CLOSE: f64 = 60.0;
/// Jumps are looked for in hypotheses this close.
const CLOSE_FOR_JUMPS: f64 = 40.0;
/// Pairs this close to the best hypothesis are fitted in full, and at most so many.
const CLOSE_PAIR: f64 = 12.0;
const MOST_PAIRS: usize = 6;
/// A flaw more must be nearer by this, as a logarithm of a robust likelihood.
const NEARER: f64 = 1.5;
/// A fit that leaves more than this share of what another leaves is in the same valley.
const SAME_VALLEY: f64 = 0.95;
/// A flaw that changes the likelihood of so many labels by less than this changes no size of the noise.
const BESIDE: f64 = 5.0;
const USUAL_LABELS: f64 = 1200.0;
/// Prior of no flaw, of one, of two.
const NONE: f64 = 0.35;
const ONE: f64 = 0.5;
const TWO: f64 = 0.15;
/// Rounds in which sizes of the noise are found to the end.
const SIZED_IN_FULL: usize = 5;
/// At most so many jumps.
const MOST_JUMPS: usize = 3;

/// A hypothesis and how likely it is beside the others.
pub(super) struct Ranked {
    pub(super) fit: Fit,
    /// Evidence and prior, as a logarithm.
    pub(super) log_posterior: f64,
    /// Share of all hypotheses.
    pub(super) posterior: f64,
}

/// Flaws that cannot be evaluated, and why.
pub(super) type Refused = Vec<(Flaw, String)>;

/// What was found.
pub(super) struct Search {
    /// All of them, the likeliest first.
    pub(super) ranked: Vec<Ranked>,
    /// Flaws that cannot be evaluated.
    pub(super) refused: Refused,
}

/// Likelihood of a set of flaws before anything is seen, as a logarithm.
fn log_prior(flaws: &[Flaw], all: &[Flaw]) -> f64 {
    let weight = |f: &Flaw| if f.is_common() { 1.0 } else { 0.5 };
    let total: f64 = all.iter().map(weight).sum();
    let share = |f: &Flaw| weight(f) / total;
    match flaws {
        [] => NONE.ln(),
        [one] => (ONE * share(one)).ln(),
        // Either may be named first.
        [a, b] => (TWO * 2.0 * share(a) * share(b)).ln(),
        _ => 1e-4_f64.ln(),
    }
}

/// Fits all of them. `progress` is called with (done, total).
pub(super) fn search(
    work: &mut Work<'_, '_>,
    flaws: &[Flaw],
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Search, DiagnoseError> {
    let zero = Theta::zero();
    let logs: Logs = [0.0; 6];
    let base = work.residuals(&zero)?;
    work.weights = outliers::by_neighbours(work, &base);
    let steps = 6;
    progress(0, steps);
    let (mut fits, refused) = singles(work, flaws, &logs)?;
    // How pixels move with a pose is taken where the labels fit best, and not where nothing does.
    let nearest = nearest(&fits, work.scene.labels.len()).clone();
    if !nearest.flaws.is_empty() {
        move_to(work, &nearest.values())?;
        fits = again(work, fits, 3);
    }
    progress(1, steps);
    let second = pairs(work, &fits, flaws, &[], 3, false);
    fits.extend(second);
    fits = alone(work, fits, false);
    let nearest = self::nearest(&fits, work.scene.labels.len()).clone();
    if nearest.flaws.len() == 2 {
        move_to(work, &nearest.values())?;
        fits = again(work, fits, 1);
    }
    progress(2, steps);
    work.weights = shared_outliers(work, &fits, &nearest.flaws);
    fits = again(work, fits, 2);
    fits = same_sizes(work, fits);
    progress(3, steps);
    // Once more, now that the noise is known.
    let best = best_of(&fits);
    work.weights = outliers::find(work, &fits[best]);
    let before: Vec<Fit> = fits.extract_if(.., |f| f.flaws.len() > 1).collect();
    fits = again(work, fits, 1);
    fits = sized(work, fits);
    fits = jumping(work, fits);
    progress(4, steps);
    let pairs = pairs(work, &fits, flaws, &before, MOST_PAIRS, true);
    fits.extend(pairs);
    fits = alone(work, fits, true);
    progress(steps, steps);
    let mut ranked: Vec<Ranked> = fits
        .into_iter()
        .map(|fit| Ranked { log_posterior: fit.score + log_prior(&fit.flaws, flaws), fit, posterior: 0.0 })
        .collect();
    ranked.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    let most = ranked[0].log_posterior;
    let sum: f64 = ranked.iter().map(|r| (r.log_posterior - most).exp()).sum();
    ranked.iter_mut().for_each(|r| r.posterior = (r.log_posterior - most).exp() / sum);
    Ok(Search { ranked, refused })
}

fn best_of(fits: &[Fit]) -> usize {
    (0..fits.len()).max_by(|a, b| fits[*a].score.total_cmp(&fits[*b].score)).unwrap_or(0)
}

fn best_score(fits: &[Fit]) -> f64 {
    fits.iter().map(|f| f.score).fold(f64::NEG_INFINITY, f64::max)
}

/// No flaw and each alone, from the best of many starts.
fn singles(work: &Work<'_, '_>, flaws: &[Flaw], logs: &Logs) -> Result<(Vec<Fit>, Refused), DiagnoseError> {
    let zero = Theta::zero();
    let sets: Vec<Vec<Flaw>> = std::iter::once(vec![]).chain(flaws.iter().map(|f| vec![*f])).collect();
    let ways = sets.par_iter().map(|set| {
        let from = set.first().map_or(zero, |flaw| start(work, *flaw, &zero));
        Way::new(set, &from, logs, &[])
    });
    let first = work.newton_all(ways.collect(), 4);
    let (mut fits, mut refused) = (Vec::new(), Vec::new());
    for (set, fit) in sets.iter().zip(first) {
        match (fit, set.first()) {
            (Ok(fit), _) => fits.push(fit),
            (Err(DiagnoseError::CannotEvaluate(why)), Some(flaw)) => refused.push((*flaw, why)),
            (Err(error), _) => return Err(error),
        }
    }
    Ok((fits, refused))
}

/// The fit that leaves least by a robust measure; no flaw unless one is clearly better, one flaw unless two are.
fn nearest(fits: &[Fit], labels: usize) -> &Fit {
    let cost =
        |fit: &Fit| robust_cost(&fit.residuals_now()) * independent(labels) + NEARER * fit.flaws.len() as f64;
    let mut best = &fits[0];
    for fit in fits {
        if cost(fit) < cost(best) {
            best = fit;
        }
    }
    best
}

/// Takes the geometry at other values, and outliers by neighbours there.
fn move_to(work: &mut Work<'_, '_>, theta: &Theta) -> Result<(), DiagnoseError> {
    if let Ok(moved) = Work::new(work.scene, work.motion, work.noise, theta) {
        *work = moved;
        let residuals = work.residuals(theta)?;
        work.weights = outliers::by_neighbours(work, &residuals);
    }
    Ok(())
}

/// All hypotheses must get the same outliers: those of the likelier of two bases, the nearest fit and no flaw with jumps.
fn shared_outliers(work: &Work<'_, '_>, fits: &[Fit], nearest: &[Flaw]) -> Weights {
    let nearest = fits.iter().find(|f| f.flaws == nearest);
    let none = fits.iter().find(|f| f.flaws.is_empty());
    let bases: Vec<Fit> = nearest.into_iter().chain(none).cloned().collect();
    let tried: Vec<(f64, Weights)> = bases
        .into_par_iter()
        .map(|base| {
            let mut own = work.same();
            let base = own.sized(base, 2);
            let base = if base.flaws.is_empty() { own.with_jumps(base, 2) } else { base };
            own.weights = outliers::find(&own, &base);
            let base = own.sized(base, 1);
            (base.score, own.weights)
        })
        .collect();
    let found = tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
    found.map_or_else(|| work.weights.clone(), |(_, weights)| weights)
}

/// Fits them again from where they are, with the outliers as they are now.
fn again(work: &Work<'_, '_>, fits: Vec<Fit>, steps: usize) -> Vec<Fit> {
    let close = best_score(&fits) - 20.0 * CLOSE;
    let near: Vec<usize> = (0..fits.len()).filter(|i| fits[*i].score >= close).collect();
    let way = |i: &usize| Way::new(&fits[*i].flaws, &fits[*i].values(), &fits[*i].logs, &fits[*i].jumps);
    let found = work.newton_all(near.iter().map(way).collect(), steps);
    let mut fits = fits;
    for (i, new) in near.into_iter().zip(found) {
        if let Ok(new) = new {
            fits[i] = Fit { jump_gain: fits[i].jump_gain, ..new };
        }
    }
    fits
}

/// All of them with the sizes of the best one.
fn same_sizes(work: &Work<'_, '_>, fits: Vec<Fit>) -> Vec<Fit> {
    let best = best_of(&fits);
    let logs = work.sized(fits[best].clone(), 3).logs;
    work.sized_together(fits, &logs, |_| false)
}

/// With their own sizes, those that are close.
fn sized(work: &Work<'_, '_>, fits: Vec<Fit>) -> Vec<Fit> {
    let best = best_of(&fits);
    // To the end: a pair that starts from here must not win by better sizes.
    let first = work.sized(fits[best].clone(), SIZED_IN_FULL);
    let limit = first.score - CLOSE;
    let left = |fit: &Fit| robust_cost(&fit.residuals_now());
    let left_by_first = left(&first);
    // What leaves less than the best does may be far from it only for want of sizes as small as what it leaves.
    let leaves_less = |(i, fit): &(usize, Fit)| *i != best && left(fit) < SAME_VALLEY * left_by_first;
    let (less, others): (Vec<_>, Vec<_>) = fits.into_iter().enumerate().partition(leaves_less);
    let less: Vec<(usize, Fit)> =
        less.into_par_iter().map(|(i, fit)| (i, work.sized(fit, SIZED_IN_FULL))).collect();
    let (places, others): (Vec<usize>, Vec<Fit>) = others.into_iter().filter(|(i, _)| *i != best).unzip();
    let others = work.sized_together(others, &first.logs, |fit| {
        // Far from the best the best one's sizes are far from right.
        let far = fit.score < limit - 3.0 * CLOSE;
        !far && !is_beside(fit, first.solution.likelihood)
    });
    let mut fits: Vec<(usize, Fit)> =
        places.into_iter().zip(others).chain(less).chain([(best, first.clone())]).collect();
    fits.sort_by_key(|(i, _)| *i);
    let fits: Vec<Fit> = fits.into_iter().map(|(_, fit)| fit).collect();
    let limit = best_score(&fits) - CLOSE;
    fits.into_par_iter()
        .map(|fit| {
            let settled = fit.score < limit || is_beside(&fit, first.solution.likelihood);
            if settled { fit } else { work.sized(fit, 1) }
        })
        .collect()
}

/// With jumps, those that are close.
fn jumping(work: &Work<'_, '_>, fits: Vec<Fit>) -> Vec<Fit> {
    let best = best_of(&fits);
    let (likelihood, close) = (fits[best].solution.likelihood, fits[best].score - CLOSE_FOR_JUMPS);
    let first = work.with_jumps(fits[best].clone(), MOST_JUMPS);
    fits.into_par_iter()
        .enumerate()
        .map(|(i, fit)| {
            if i == best {
                first.clone()
            } else if fit.score <= close {
                fit
            } else if is_beside(&fit, likelihood) {
                // The same frames are worst where the same is left.
                let (logs, jumps) = (first.logs, first.jumps.clone());
                work.rescored(Fit { logs, jumps, jump_gain: first.jump_gain, ..fit })
            } else {
                work.with_jumps(fit, MOST_JUMPS)
            }
        })
        .collect()
}

/// Whether a fit leaves so nearly what another leaves, by its likelihood with the same sizes, that the sizes are the same.
fn is_beside(fit: &Fit, likelihood: f64) -> bool {
    // What own sizes would gain is the square of the difference over the number of labels.
    let limit = BESIDE * (fit.residuals.len() as f64 / USUAL_LABELS).sqrt();
    (fit.solution.likelihood - likelihood).abs() < limit
}

/// Flaws of pairs by themselves, once more from the values that they have in the pair: from where no flaw is known the way
/// may lead into another valley.
fn alone(work: &Work<'_, '_>, fits: Vec<Fit>, in_full: bool) -> Vec<Fit> {
    let pairs: Vec<&Fit> = fits.iter().filter(|f| f.flaws.len() == 2).collect();
    let best = pairs.iter().map(|f| f.score).fold(f64::NEG_INFINITY, f64::max);
    let tries: Vec<(&Fit, Flaw)> = pairs
        .into_iter()
        .filter(|pair| pair.score > best - CLOSE_PAIR)
        .flat_map(|pair| pair.flaws.iter().map(move |flaw| (pair, *flaw)))
        .collect();
    let found: Vec<Fit> = tries
        .into_par_iter()
        .filter_map(|(pair, flaw)| {
            let from = Theta::zero().with(flaw, pair.values().of(flaw));
            let fit = work.newton(&[flaw], &from, &pair.logs, &[], 3).ok()?;
            let known = fits.iter().find(|f| f.flaws == [flaw])?;
            let left = |fit: &Fit| robust_cost(&fit.residuals_now());
            if left(&fit) > SAME_VALLEY * left(known) {
                return None;
            }
            if !in_full {
                return Some(fit);
            }
            Some(work.with_jumps(work.sized(fit, 2), MOST_JUMPS))
        })
        .collect();
    let mut fits = fits;
    for one in found {
        match fits.iter_mut().find(|f| f.flaws == one.flaws) {
            Some(known) if one.score > known.score => *known = one,
            _ => {}
        }
    }
    fits
}

/// The second flaws that matter, beside the three best, and pairs that were good `before`.
fn pairs(
    work: &Work<'_, '_>,
    fits: &[Fit],
    flaws: &[Flaw],
    before: &[Fit],
    most_pairs: usize,
    in_full: bool,
) -> Vec<Fit> {
    let mut order: Vec<usize> = (0..fits.len()).filter(|i| fits[*i].flaws.len() == 1).collect();
    order.sort_by(|a, b| fits[*b].score.total_cmp(&fits[*a].score));
    order.truncate(3);
    let mut looked: Vec<(f64, Start)> =
        order.into_par_iter().flat_map(|i| second_flaws(work, &fits[i], flaws)).collect();
    looked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let most = looked.first().map_or_else(|| best_score(fits), |l| l.0.max(best_score(fits)));
    let close = looked.into_iter().filter(|l| l.0 > most - CLOSE_PAIR).map(|l| l.1).take(2 * most_pairs);
    // Sizes of the noise that a wrong flaw needs hide what is beside it: sizes are the pair's own.
    let known =
        before.iter().map(|f| Start { set: f.flaws.clone(), from: f.values(), logs: f.logs, beside: None });
    let mut chosen: Vec<Start> = Vec::new();
    for start in known.chain(close) {
        if !chosen.iter().any(|other| start.set.iter().all(|f| other.set.contains(f))) {
            chosen.push(start);
        }
    }
    chosen.truncate(most_pairs);
    chosen
        .into_par_iter()
        .filter_map(|start| {
            let fit = work.newton(&start.set, &start.from, &start.logs, &[], 3).ok()?;
            if !in_full {
                return Some(fit);
            }
            let beside = start.beside.is_some_and(|likelihood| is_beside(&fit, likelihood));
            let fit = if beside { fit } else { work.sized(fit, 2) };
            Some(work.with_jumps(fit, MOST_JUMPS))
        })
        .collect()
}

/// Where the fit of a pair begins.
struct Start {
    set: Vec<Flaw>,
    from: Theta,
    logs: Logs,
    /// The likelihood of the flaw that a second is added to, with sizes of its own and without jumps.
    beside: Option<f64>,
}

/// Each second flaw beside a fit, by columns of one pass: how likely the pair is at least.
fn second_flaws(work: &Work<'_, '_>, fit: &Fit, flaws: &[Flaw]) -> Vec<(f64, Start)> {
    let others: Vec<Flaw> =
        flaws.iter().copied().filter(|f| !fit.flaws.contains(f) && *f != Flaw::ClockStep).collect();
    let added = parameters_of(&others);
    let theta = fit.theta;
    let Ok(columns) = work.scene.columns(&theta, work.motion, &added) else { return vec![] };
    let mut all = fit.columns.clone();
    all.extend(columns);
    let whitened = work.whiten(&fit.residuals, &all, &fit.logs, &fit.jumps);
    let own: Vec<usize> = (1..=fit.parameters.len()).collect();
    others
        .into_iter()
        .map(|flaw| {
            let parameters: Vec<usize> = fit.parameters.iter().copied().chain(flaw.solved()).collect();
            let second = added
                .iter()
                .enumerate()
                .filter(|(_, p)| flaw.solved().contains(p))
                .map(|(i, _)| 1 + fit.parameters.len() + i);
            let columns: Vec<usize> = own.iter().copied().chain(second).collect();
            let values: Vec<f64> = parameters.iter().map(|p| theta[*p]).collect();
            let solution = Normal::of(&whitened, &columns).solve(&values, &expected_of(&parameters));
            let set: Vec<Flaw> = fit.flaws.iter().copied().chain([flaw]).collect();
            let beside = fit.jumps.is_empty().then_some(fit.solution.likelihood);
            let start = Start { set, from: fit.values(), logs: fit.logs, beside };
            (fit.score - fit.solution.evidence + solution.evidence, start)
        })
        .collect()
}
