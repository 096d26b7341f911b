//! Which flaw it is, if any: forward selection on unseen labels.

use super::blocks::Blocks;
use super::flaw::Flaw;
use super::noise::Noise;
use super::problem::{Problem, rmse_px};
use super::solve::Fit;
use super::unseen::{Ruler, Unseen};
use super::{DiagnoseError, Options};

/// As sure as this a comparison must be to count.
pub(super) const SURE: f64 = 0.95;
/// As sure as this a further flaw must be, which is asked for after a first one was found.
const SURE_OF_MORE: f64 = 0.99;
/// A flaw must make unseen labels more likely by this factor, as a logarithm ...
const LIKELIER: f64 = 8.0;
/// ... and take away this share of the mean squared error: less may be there, but matters to nobody ...
const SHARE: f64 = 0.1;
/// ... and this share of what there was before any flaw was taken out.
const SHARE_OF_ALL: f64 = 0.01;
/// More flaws at once than these are not told apart by pixels.
const MOST_FLAWS: usize = 3;

/// A fit and how it does on unseen labels.
pub(super) struct Candidate {
    pub(super) fit: Fit,
    pub(super) unseen: Unseen,
}

/// What was found.
pub(super) struct Found {
    /// The flaws fitted together; none where there is none to name.
    pub(super) named: Candidate,
    /// Flaws that could each be what is missing, likeliest first; fewer than two where there is no doubt.
    pub(super) doubt: Vec<Flaw>,
    /// The least sure of the comparisons behind the name.
    pub(super) sureness: f64,
}

/// Compares fits of one problem.
pub(super) struct Judge<'a> {
    pub(super) problem: &'a Problem<'a>,
    pub(super) blocks: &'a Blocks,
    pub(super) options: Options,
    /// The noise that the best fit leaves.
    pub(super) noise: Noise,
    /// What errors are measured with.
    pub(super) ruler: Ruler,
}

impl Judge<'_> {
    pub(super) fn candidate(&self, fit: Fit) -> Candidate {
        let unseen = Unseen::new(&fit, self.blocks, &self.ruler);
        Candidate { fit, unseen }
    }

    pub(super) fn sureness(&self, better: &Candidate, worse: &Candidate) -> f64 {
        better.unseen.sureness_over(&worse.unseen, self.options.resamples, self.options.seed)
    }

    /// `singles` are the flaws fitted alone.
    pub(super) fn decide(&self, singles: &[Fit]) -> Result<Found, DiagnoseError> {
        let mut named = self.candidate(Fit::of_nothing(self.problem, self.blocks));
        let mut sureness: f64 = 1.0;
        let flaws: Vec<Flaw> = singles.iter().flat_map(|f| f.flaws.iter().copied()).collect();
        while named.fit.flaws.len() < MOST_FLAWS {
            let first = named.fit.flaws.is_empty();
            let candidates = match first {
                true => singles.iter().map(|fit| self.candidate(fit.clone())).collect(),
                false => self.with_one_more(&named.fit, &flaws)?,
            };
            let sure_enough = if first { SURE } else { self.attainable(SURE_OF_MORE) };
            let mut better: Vec<(f64, Candidate)> = candidates
                .into_iter()
                .map(|c| (self.sureness(&c, &named), c))
                .filter(|(sure, c)| *sure >= sure_enough && self.matters(c, &named))
                .collect();
            better.sort_by(|a, b| a.1.unseen.total().total_cmp(&b.1.unseen.total()));
            let mut better = better.into_iter();
            let Some((over_none, best)) = better.next() else { break };
            let mut doubt = Vec::new();
            let mut over_others = 1.0_f64;
            for (_, other) in better {
                let sure = self.sureness(&best, &other);
                over_others = over_others.min(sure);
                if sure < SURE {
                    doubt.extend(other.fit.flaws.last());
                }
            }
            if !doubt.is_empty() {
                doubt.splice(0..0, best.fit.flaws.last().copied());
                let sureness = if first { over_none.min(over_others) } else { sureness };
                return Ok(Found { named, doubt, sureness });
            }
            sureness = sureness.min(over_none).min(over_others);
            named = best;
        }
        Ok(Found { named, doubt: vec![], sureness })
    }

    /// Few blocks cannot be very sure of anything.
    fn attainable(&self, sure: f64) -> f64 {
        sure.min(1.0 - 0.5_f64.powi(self.blocks.len() as i32))
    }

    fn matters(&self, candidate: &Candidate, before: &Candidate) -> bool {
        let [left, there_was] = [candidate, before].map(|c| c.fit.rmse_px().powi(2));
        let least = (SHARE * there_was).max(SHARE_OF_ALL * rmse_px(&self.problem.base).powi(2));
        before.unseen.total() - candidate.unseen.total() >= LIKELIER && there_was - left >= least
    }

    fn with_one_more(&self, fit: &Fit, flaws: &[Flaw]) -> Result<Vec<Candidate>, DiagnoseError> {
        let others = flaws.iter().filter(|f| !fit.flaws.contains(f));
        others
            .map(|flaw| {
                let together: Vec<Flaw> = fit.flaws.iter().copied().chain([*flaw]).collect();
                Ok(self.candidate(Fit::solve(self.problem, self.blocks, &together, fit)?))
            })
            .collect()
    }
}

/// Fits each flaw alone. One that cannot be fitted is left out, and said.
pub(super) fn singles(
    problem: &Problem<'_>,
    blocks: &Blocks,
    flaws: &[Flaw],
    mut done: impl FnMut(),
) -> Result<Vec<Fit>, DiagnoseError> {
    let mut fits = Vec::new();
    let nothing = Fit::of_nothing(problem, blocks);
    for flaw in flaws {
        match Fit::solve(problem, blocks, &[*flaw], &nothing) {
            Ok(fit) => fits.push(fit),
            Err(DiagnoseError::CannotEvaluate(why)) => tracing::warn!("{flaw} is not looked for: {why}"),
            Err(error) => return Err(error),
        }
        done();
    }
    if fits.is_empty() { Err(DiagnoseError::NoFlaws) } else { Ok(fits) }
}
