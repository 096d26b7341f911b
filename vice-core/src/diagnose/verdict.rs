//! Which verdict the hypotheses come to.

use super::fit::Fit;
use super::flaw::{Flaw, PARAMETERS};
use super::noise::{NoiseModel, POSITION, YAW};
use super::search::{Ranked, Search};
use super::width::shows;

/// A name needs this share of all hypotheses ...
const SURE: f64 = 0.88;
/// ... and no other with as many flaws whose best fit is as good but for this, as a logarithm.
const RIVAL: f64 = 2.5;
/// ... or, of one flaw, all hypotheses that hold it this one.
const SURE_WITH: f64 = 0.97;
/// Fewer labels than these are too few for any answer.
const FEWEST_LABELS: usize = 8;
/// RMSE_2D that is hardly less.
const HARDLY_LESS: f64 = 0.9;
/// Of two flaws at once each is at most this times what is expected of it.
const USUAL_TIMES: f64 = 4.5;
/// A second flaw must add this, as a logarithm, and bring what is left to less than this share: little of what is left
/// may be the flaw's where it is mostly the walk of the odometry, or a small gain of evidence chance.
const SECOND: [(f64, f64); 3] = [(12.0, 0.75), (20.0, 0.97), (60.0, f64::INFINITY)];
/// No flaw is said where it has this share of the hypotheses.
const NONE: f64 = 0.3;
/// Beyond these times the expected walk an odometry is not healthy.
const SICK_TIMES: f64 = 1.8;
/// Jumps that gain more than this are no noise, as a logarithm.
const SICK_JUMPS: f64 = 25.0;
/// No flaw is not said where RMSE_2D is beyond these times what labels alone make.
const ABOVE_LABELS: f64 = 2.7;
/// Candidates are named until they hold this share.
const SET: f64 = 0.97;
/// A direction shows if the labels halve what is expected of it.
const SHOWN: f64 = 0.5;

/// What is decided, without words.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Decision {
    NoFlaw,
    Named(Vec<Flaw>),
    CannotTell(Vec<Flaw>),
    /// Noise or jumps, if that is what it looks like.
    Unexplained {
        noise: bool,
        jumps: bool,
    },
    /// How many times as many labels would be needed.
    TooFew {
        times: f64,
    },
}

/// Whether the odometry wanders more than is healthy, or jumps.
pub(super) fn sick(fit: &Fit, noise: &NoiseModel) -> (bool, bool) {
    let beyond = |size: usize| fit.logs[size] > SICK_TIMES.ln();
    (!noise.inertial && (beyond(POSITION) || beyond(YAW)), fit.jump_gain > SICK_JUMPS)
}

/// Share of all hypotheses with exactly these flaws.
pub(super) fn share(search: &Search, flaws: &[Flaw]) -> f64 {
    let same =
        |r: &&Ranked| r.fit.flaws.len() == flaws.len() && flaws.iter().all(|f| r.fit.flaws.contains(f));
    search.ranked.iter().filter(same).map(|r| r.posterior).sum()
}

/// Whether all values are what such a flaw can be.
fn plausible(fit: &Fit) -> bool {
    let values = fit.values();
    // Two at once are believed where each is of a usual size: together they bend to whatever is left.
    let pair = fit.flaws.len() > 1;
    fit.parameters.iter().all(|p| {
        let size = values[*p].abs();
        size <= PARAMETERS[*p].plausible && !(pair && size > USUAL_TIMES * PARAMETERS[*p].expected)
    })
}

/// `rmse_px` as the poses are taken, `left_px` without the flaws of the best hypothesis.
pub(super) fn decide(
    search: &Search,
    noise: &NoiseModel,
    rmse_px: f64,
    left_px: f64,
    labels_rmse_px: f64,
) -> Decision {
    let best = &search.ranked[0];
    let (wanders, jumps) = sick(&best.fit, noise);
    let is_sick = wanders || jumps;
    let none = share(search, &[]);
    // What is not above the labels' own noise, and stays as it is without the flaw, is nobody's flaw.
    let nothing_above = rmse_px <= labels_rmse_px && left_px > HARDLY_LESS * rmse_px;
    let is_none = best.fit.flaws.is_empty() || none > NONE || nothing_above;
    let times = needed(search).max(FEWEST_LABELS as f64 / best.fit.residuals.len().max(1) as f64);
    if times > 1.0 && (is_none || best.posterior < SURE) {
        return Decision::TooFew { times };
    }
    if is_none {
        let high = rmse_px > ABOVE_LABELS * labels_rmse_px;
        return match is_sick || high {
            false => Decision::NoFlaw,
            true => Decision::Unexplained { noise: wanders, jumps },
        };
    }
    if is_sick {
        return Decision::Unexplained { noise: wanders, jumps };
    }
    if let Some(core) = core(search) {
        return Decision::Named(core);
    }
    let rivals = rivals(search, &best.fit);
    if !plausible(&best.fit) {
        return Decision::Unexplained { noise: false, jumps: false };
    }
    let mut candidates: Vec<Flaw> = Vec::new();
    let mut held = 0.0;
    for ranked in &search.ranked {
        if held >= SET {
            break;
        }
        held += ranked.posterior;
        candidates
            .extend(ranked.fit.flaws.iter().filter(|f| !candidates.contains(f)).copied().collect::<Vec<_>>());
    }
    for rival in rivals {
        candidates
            .extend(rival.flaws.iter().filter(|f| !candidates.contains(f)).copied().collect::<Vec<_>>());
    }
    Decision::CannotTell(candidates)
}

/// The flaws that are named: the best hypothesis, or without a second flaw that adds little to it. A small gain may ride on
/// an outlier that nobody found, so that it makes no name; it is no doubt of the first one either. A second flaw that may
/// be zero, or that adds little and brings the key points no nearer to their labels, is none.
fn core(search: &Search) -> Option<Vec<Flaw>> {
    let best = &search.ranked[0].fit;
    let mut core = best;
    if best.flaws.len() == 2 {
        let single = |flaw: Flaw| search.ranked.iter().map(|r| &r.fit).find(|f| f.flaws == [flaw]);
        let shown: Vec<Flaw> = best.flaws.iter().copied().filter(|f| shows(best, *f)).collect();
        let first = shown.iter().filter_map(|f| single(*f)).max_by(|a, b| a.score.total_cmp(&b.score))?;
        let gain = best.score - first.score;
        let left = usual_rms(best) / usual_rms(first).max(f64::MIN_POSITIVE);
        let is_second = shown.len() == 2 && SECOND.iter().any(|(least, most)| gain >= *least && left < *most);
        if !is_second {
            core = first;
        }
    }
    let with: f64 = search
        .ranked
        .iter()
        .filter(|r| core.flaws.iter().all(|f| r.fit.flaws.contains(f)))
        .map(|r| r.posterior)
        .sum();
    let alone = share(search, &core.flaws);
    let sure = alone >= SURE || (core.flaws.len() == 1 && with >= SURE_WITH);
    let without_it = |fit: &&Fit| core.flaws.iter().any(|f| !fit.flaws.contains(f));
    let unrivalled = rivals(search, core).is_empty() && !rivals(search, best).iter().any(without_it);
    (sure && unrivalled && plausible(core)).then(|| core.flaws.clone())
}

/// Others with as many flaws or fewer that fit as well at their best: evidence alone prefers fewer parameters, which is no
/// evidence.
fn rivals<'s>(search: &'s Search, of: &Fit) -> Vec<&'s Fit> {
    let fits_at_best = |fit: &Fit| fit.score - fit.solution.evidence + fit.solution.likelihood;
    let limit = fits_at_best(of) - RIVAL;
    search
        .ranked
        .iter()
        .map(|r| &r.fit)
        .filter(|fit| {
            !fit.flaws.is_empty()
                && fit.flaws.len() <= of.flaws.len()
                && !fit.flaws.iter().all(|f| of.flaws.contains(f))
                && fits_at_best(fit) > limit
        })
        .collect()
}

/// RMS length of what a fit leaves of the nearer nine tenths of the labels, pixels: blunders are no measure of it.
fn usual_rms(fit: &Fit) -> f64 {
    let mut squares: Vec<f64> = fit.residuals_now().iter().map(|r| r.norm_squared()).collect();
    squares.sort_by(f64::total_cmp);
    squares.truncate((squares.len() * 9).div_ceil(10));
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// How many times as many labels it takes until a direction of some flaw shows; 1 or less where one does.
fn needed(search: &Search) -> f64 {
    let singles = search.ranked.iter().map(|r| &r.fit).filter(|f| f.flaws.len() == 1);
    let narrowest = singles
        .flat_map(|fit| {
            let covariance = &fit.solution.covariance;
            fit.parameters
                .iter()
                .enumerate()
                .map(|(i, p)| covariance[(i, i)].sqrt() / PARAMETERS[*p].expected)
                .collect::<Vec<_>>()
        })
        .fold(f64::INFINITY, f64::min);
    if narrowest.is_finite() { (narrowest / SHOWN).powi(2) } else { f64::INFINITY }
}

/// Number of directions of a fit's parameters that the labels show.
pub(super) fn rank(fit: &Fit) -> usize {
    let n = fit.parameters.len();
    let scaled = nalgebra::DMatrix::from_fn(n, n, |a, b| {
        fit.solution.covariance[(a, b)]
            / (PARAMETERS[fit.parameters[a]].expected * PARAMETERS[fit.parameters[b]].expected)
    });
    scaled.symmetric_eigenvalues().iter().filter(|e| **e < SHOWN * SHOWN).count()
}
