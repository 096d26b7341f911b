//! Which flaw it is, if any: forward selection on unseen labels.

use super::blocks::Blocks;
use super::flaw::Flaw;
use super::problem::Problem;
use super::solve::Fit;
use super::theta::Theta;
use super::unseen::Unseen;
use super::{DiagnoseError, Options};

/// As sure as this a comparison must be to count.
pub(super) const SURE: f64 = 0.95;
/// A first flaw must take away this share of the loss on unseen labels: less is noise that happens to fit.
const FIRST_SHARE: f64 = 0.2;
/// A further one must take this share of what is left.
const NEXT_SHARE: f64 = 0.3;
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
    /// The noise that says which errors count linearly, pixels.
    pub(super) sigma_px: f64,
}

impl Judge<'_> {
    pub(super) fn candidate(&self, fit: Fit) -> Candidate {
        let unseen = Unseen::new(&fit, self.blocks, self.sigma_px);
        Candidate { fit, unseen }
    }

    pub(super) fn sureness(&self, better: &Candidate, worse: &Candidate) -> f64 {
        better.unseen.sureness_over(&worse.unseen, self.options.resamples, self.options.seed)
    }

    /// `singles` are the flaws fitted alone.
    pub(super) fn decide(&self, singles: &[Fit]) -> Result<Found, DiagnoseError> {
        let mut named = self.candidate(Fit::of_nothing(self.problem));
        let mut sureness: f64 = 1.0;
        let flaws: Vec<Flaw> = singles.iter().flat_map(|f| f.flaws.iter().copied()).collect();
        while named.fit.flaws.len() < MOST_FLAWS {
            let first = named.fit.flaws.is_empty();
            let candidates = match first {
                true => singles.iter().map(|fit| self.candidate(fit.clone())).collect(),
                false => self.with_one_more(&named.fit, &flaws)?,
            };
            let share = if first { FIRST_SHARE } else { NEXT_SHARE };
            let mut better: Vec<(f64, Candidate)> = candidates
                .into_iter()
                .map(|c| (self.sureness(&c, &named), c))
                .filter(|(sure, c)| *sure >= SURE && c.unseen.explains_of(&named.unseen) >= share)
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

    fn with_one_more(&self, fit: &Fit, flaws: &[Flaw]) -> Result<Vec<Candidate>, DiagnoseError> {
        let others = flaws.iter().filter(|f| !fit.flaws.contains(f));
        others
            .map(|flaw| {
                let together: Vec<Flaw> = fit.flaws.iter().copied().chain([*flaw]).collect();
                Ok(self.candidate(Fit::solve(self.problem, &together, &fit.theta)?))
            })
            .collect()
    }
}

/// Fits each flaw alone.
pub(super) fn singles(
    problem: &Problem<'_>,
    flaws: &[Flaw],
    mut done: impl FnMut(),
) -> Result<Vec<Fit>, DiagnoseError> {
    flaws
        .iter()
        .map(|flaw| {
            let fit = Fit::solve(problem, &[*flaw], &Theta::zero());
            done();
            fit
        })
        .collect()
}
