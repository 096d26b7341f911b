//! By how much the clocks of two motion sources differ, from how both turn.
//!
//! Two sensors on one rigid body turn at one rate at each moment, whatever their frames. The magnitudes of their turn rates
//! are correlated over lags first; from the best peaks on, the lag, the constant rotation between both bodies and the
//! difference of their biases are fitted to the rates as vectors, with glitches counted less. Turns come from
//! orientations at both ends of a stretch of time, so that no filter moves one against the other. The interval comes from how
//! much blocks of five seconds disagree: samples near each other are not independent.
//!
//! Where this cannot be known, a [`ClockDoubt`] says why with its numbers: a motion that is too quiet, rates that do not
//! correlate, or several lags that fit alike.
//!
//! Source: rigid-body kinematics; correlation of turn rates as in Mair et al., "Spatio-temporal initialization for IMU to
//! camera registration", ROBIO 2011.

mod coarse;
mod fit;
mod parts;
pub(super) mod pieces;
#[cfg(test)]
mod tests;
mod words;

use nalgebra::UnitQuaternion;

use self::coarse::{Lags, correlate};
use self::fit::{Fit, What, fit};
use self::parts::Change;
use self::pieces::Pieces;
pub use self::words::{finding, images_finding};
use super::Check;
use super::turning::Turning;
use crate::time::{Span, Stamp};

/// What this check is.
pub const CHECK: Check = Check {
    name: "clock",
    title: "clocks of motion sources",
    looks_at: "offset and rate between the clocks of gyroscope, pose streams and images, by their turn rates",
    threshold: "look above 4 ms, wrong above 10 ms beyond the 95 % interval; rates that add up to as much; for the stamps of images (with --images) above 10 and 20 ms",
    source: "rigid-body kinematics; Mair et al., ROBIO 2011; interval by blocks of 5 s",
};

/// A correlation below this is not believed.
pub const LEAST_CORRELATION: f64 = 0.9;
/// The next best peak must leave at least this many times more unexplained.
const UNIQUE: f64 = 2.0;
/// Quieter motion tells nothing, rad/s RMS about the mean.
const QUIET_RAD_S: f64 = 0.01;
/// An interval wider than this to either side is no answer, seconds; nor one wider than this share of the offset.
const WIDEST_S: f64 = 0.01;
const WIDEST_SHARE: f64 = 0.1;
/// The denser source must be this dense, seconds.
const SPARSEST_S: f64 = 0.3;
/// Lags that are looked at, seconds to either side: few where these suffice.
const RANGES_S: [f64; 2] = [2.0, 20.0];

/// By how much a clock differs from another one.
#[derive(Clone, Debug, PartialEq)]
pub struct ClockOffset {
    /// Seconds to add to the stamps of the estimate, in the middle of what both have in common: what `time-offset` takes.
    pub offset_s: f64,
    /// Half of its 95 % interval, seconds.
    pub half_95_s: f64,
    /// What the offset grows by a second, where that can be told from none: a share (1e-6 is one part in a million).
    pub rate: Option<ClockRate>,
    /// Correlation of the turn rates at that offset.
    pub correlation: f64,
    /// The best correlation of magnitudes at another lag, and that lag.
    pub next_best: Option<(f64, f64)>,
    /// Whether rates were compared as vectors (else their magnitudes only).
    pub by_vectors: bool,
    /// Takes directions in the estimate's body to those in the reference's; meaningless for turns about one axis.
    pub reference_from_estimate: UnitQuaternion<f64>,
    /// Stretches compared.
    pub count: usize,
    /// Seconds they cover.
    pub seconds: f64,
    /// RMS turn rate about its mean, rad/s.
    pub motion_rad_s: f64,
    /// Offsets of parts: middle, offset and its standard deviation, seconds; times by the reference's clock.
    pub parts: Vec<(Stamp, f64, f64)>,
}

/// How fast a clock runs against another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockRate {
    /// What the offset grows by a second.
    pub share: f64,
    /// Half of its 95 % interval.
    pub half_95: f64,
}

/// Why an offset is not known.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClockDoubt {
    /// The two have hardly a time in common.
    #[error("the two have {seconds:.1} s in common, too little to compare {count} turns")]
    TooShort {
        /// Seconds in common.
        seconds: f64,
        /// Stretches compared.
        count: usize,
    },
    /// Neither source is dense enough.
    #[error("both have an orientation every {spacing_s:.2} s or less often: too sparse")]
    TooSparse {
        /// Median spacing of the denser one, seconds.
        spacing_s: f64,
    },
    /// There is hardly any motion.
    #[error("the motion is too quiet: turn rates vary by {motion_rad_s:.4} rad/s, {QUIET_RAD_S} is needed")]
    TooQuiet {
        /// RMS turn rate about its mean, rad/s.
        motion_rad_s: f64,
    },
    /// Turn rates are not alike at any lag.
    #[error(
        "too uncertain: the turn rates correlate with {correlation:.3} at best (at {:.1} ms), {LEAST_CORRELATION} is needed",
        1e3 * offset_s
    )]
    Uncorrelated {
        /// The best correlation.
        correlation: f64,
        /// Where, seconds to add to the estimate's stamps.
        offset_s: f64,
    },
    /// Two lags fit about as well.
    #[error(
        "too uncertain: turn rates correlate with {correlation:.3} at {:.1} ms, and with {next:.3} at {:.0} ms",
        1e3 * offset_s, 1e3 * next_s
    )]
    NotUnique {
        /// The best correlation.
        correlation: f64,
        /// Where, seconds.
        offset_s: f64,
        /// The next best.
        next: f64,
        /// Where, seconds.
        next_s: f64,
    },
    /// The clock was set in the middle.
    #[error("the offset steps from {:.1} to {:.1} ms at about {at} ns", 1e3 * before_s, 1e3 * after_s)]
    Step {
        /// When, by the stamps of the sparser one, within some seconds.
        at: Stamp,
        /// The offset before, seconds to add to the estimate's stamps.
        before_s: f64,
        /// The offset after, seconds.
        after_s: f64,
    },
    /// The interval is too wide.
    #[error("too uncertain: {:.1} ± {:.1} ms", 1e3 * offset_s, 1e3 * half_95_s)]
    TooWide {
        /// The offset, seconds.
        offset_s: f64,
        /// Half of its interval, seconds.
        half_95_s: f64,
    },
}

/// What must be added to the stamps of the estimate to bring it to the reference's clock.
///
/// `range_s`: lags that are looked at, seconds to either side of none; `None`: 2, and 20 where nothing is found there.
///
/// Cost: some hundred passes over at most some thousand turns.
///
/// # Errors
/// [`ClockDoubt`] where this is not known, with the numbers.
pub fn clock_offset(
    reference: &Turning,
    estimate: &Turning,
    range_s: Option<f64>,
) -> Result<ClockOffset, ClockDoubt> {
    let spacing_s = reference.spacing_s().min(estimate.spacing_s());
    if spacing_s > SPARSEST_S {
        return Err(ClockDoubt::TooSparse { spacing_s });
    }
    let search = Search::new(reference, estimate);
    let ranges = match &range_s {
        Some(range) => std::slice::from_ref(range),
        None => &RANGES_S[..],
    };
    let mut doubt = None;
    for range in ranges {
        match search.within(*range) {
            Ok(found) => return Ok(found),
            // Quiet or short it stays, however far one looks.
            Err(error @ (ClockDoubt::TooQuiet { .. } | ClockDoubt::NotUnique { .. })) => return Err(error),
            Err(error) => doubt = doubt.or(Some(error)),
        }
    }
    let doubt = doubt.unwrap_or(ClockDoubt::TooShort { seconds: 0.0, count: 0 });
    // A constant offset does not fit: perhaps one that changes does.
    match doubt {
        ClockDoubt::Uncorrelated { .. } | ClockDoubt::TooWide { .. } => {
            search.changing(range_s.unwrap_or(RANGES_S[0])).unwrap_or(Err(doubt))
        }
        doubt => Err(doubt),
    }
}

struct Search<'a> {
    pieces: Pieces,
    sparse: &'a Turning,
    other: &'a Turning,
    /// 1 where the estimate is the sparser one, else -1.
    sign: f64,
    /// Takes a time of the sparse one to one of the other where both clocks agree, seconds.
    apart_s: f64,
}

impl<'a> Search<'a> {
    fn new(reference: &'a Turning, estimate: &'a Turning) -> Self {
        let sparse_is_estimate = estimate.spacing_s() >= reference.spacing_s();
        let (sparse, other, sign) =
            if sparse_is_estimate { (estimate, reference, 1.0) } else { (reference, estimate, -1.0) };
        Self { pieces: Pieces::of(sparse), sparse, other, sign, apart_s: sparse.later_than(other) }
    }

    fn within(&self, range_s: f64) -> Result<ClockOffset, ClockDoubt> {
        let pieces = &self.pieces;
        let lags = correlate(pieces, self.other, self.apart_s, range_s);
        let peaks = lags.peaks();
        let Some(best_peak) = peaks.first().copied() else {
            let common = pieces.seen_by(self.other, |t| t + self.apart_s).iter().flatten().count();
            let seconds = common as f64 * pieces.seconds() / pieces.len().max(1) as f64;
            return Err(ClockDoubt::TooShort { seconds, count: common });
        };
        let fits = |what: What| {
            let each = peaks.iter().filter_map(|(lag, _)| {
                let fitted = fit(pieces, self.other, what, (self.apart_s + lag, 0.0), false)?;
                ((fitted.lag_s - self.apart_s).abs() <= range_s + 0.5 * lags.step_s).then_some(fitted)
            });
            each.max_by(|a, b| a.correlation.total_cmp(&b.correlation))
        };
        let good = |f: &Fit| f.correlation >= LEAST_CORRELATION;
        let vectors = fits(What::Vectors);
        let (what, best) = match vectors.as_ref().filter(|f| good(f)) {
            Some(fit) => (What::Vectors, Some(fit.clone())),
            None => match fits(What::Magnitudes).filter(good) {
                Some(fit) => (What::Magnitudes, Some(fit)),
                None => (What::Vectors, vectors),
            },
        };
        let Some(best) = best else {
            return Err(self.uncorrelated(best_peak.1, best_peak.0));
        };
        if best.motion_rad_s < QUIET_RAD_S {
            return Err(ClockDoubt::TooQuiet { motion_rad_s: best.motion_rad_s });
        }
        if !good(&best) {
            return Err(self.uncorrelated(best.correlation, best.lag_s - self.apart_s));
        }
        let next = self.unique(&lags, &best)?;
        let best = self.with_rate(best, what);
        let offset_s = self.sign * (best.lag_s - self.apart_s);
        if best.lag_half_s > WIDEST_S.max(WIDEST_SHARE * offset_s.abs()) {
            return Err(ClockDoubt::TooWide { offset_s, half_95_s: best.lag_half_s });
        }
        Ok(self.answer(&best, what, next))
    }

    /// What parts say, where no constant lag fits.
    fn changing(&self, range_s: f64) -> Option<Result<ClockOffset, ClockDoubt>> {
        let offset = |lag: f64| self.sign * (lag - self.apart_s);
        match parts::change(&self.pieces, self.other, self.apart_s, range_s)? {
            Change::Step(at, before, after) => Some(Err(ClockDoubt::Step {
                at: self.sparse.range().0.saturating_add(Span::from_secs_f64(at).unwrap_or(Span::ZERO)),
                before_s: offset(before),
                after_s: offset(after),
            })),
            Change::Rate(lag, rate) => {
                let found = fit(&self.pieces, self.other, What::Vectors, (lag, rate), true)?;
                let sure = found.correlation >= LEAST_CORRELATION
                    && found.rate.abs() > found.rate_half
                    && found.lag_half_s < WIDEST_S.max(WIDEST_SHARE * offset(found.lag_s).abs());
                sure.then(|| Ok(self.answer(&found, What::Vectors, None)))
            }
        }
    }

    fn uncorrelated(&self, correlation: f64, lag_s: f64) -> ClockDoubt {
        ClockDoubt::Uncorrelated { correlation, offset_s: self.sign * lag_s }
    }

    /// The next best lag, as an offset with its correlation; refused where it fits about as well.
    fn unique(&self, lags: &Lags, best: &Fit) -> Result<Option<(f64, f64)>, ClockDoubt> {
        let lag = best.lag_s - self.apart_s;
        let Some((next_lag, next)) = lags.best_elsewhere(lag) else { return Ok(None) };
        let here = coarse::at(&self.pieces, self.other, |t| t + best.lag_s).unwrap_or(0.0);
        let unexplained = |c: f64| 1.0 - c.max(0.0).powi(2);
        if UNIQUE * unexplained(here) > unexplained(next) {
            return Err(ClockDoubt::NotUnique {
                correlation: here,
                offset_s: self.sign * lag,
                next,
                next_s: self.sign * next_lag,
            });
        }
        Ok(Some((self.sign * next_lag, next)))
    }

    /// The same with a rate, where blocks agree on one.
    fn with_rate(&self, plain: Fit, what: What) -> Fit {
        let with = fit(&self.pieces, self.other, what, (plain.lag_s, 0.0), true);
        match with {
            Some(with)
                if with.rate.abs() > with.rate_half && with.correlation >= plain.correlation - 1e-3 =>
            {
                with
            }
            _ => plain,
        }
    }

    fn answer(&self, fit: &Fit, what: What, next_best: Option<(f64, f64)>) -> ClockOffset {
        let offset = |lag: f64| self.sign * (lag - self.apart_s);
        let stamp = |t: f64| {
            let span = Span::from_secs_f64(t).unwrap_or(Span::ZERO);
            let sparse = self.sparse.range().0.saturating_add(span);
            // By the clock of the reference.
            let own = if self.sign > 0.0 { offset(fit.lag_s) } else { 0.0 };
            sparse.saturating_add(Span::from_secs_f64(own).unwrap_or(Span::ZERO))
        };
        let turn = fit.sparse_from_other;
        ClockOffset {
            offset_s: offset(fit.lag_s),
            half_95_s: fit.lag_half_s,
            rate: (fit.rate != 0.0)
                .then_some(ClockRate { share: self.sign * fit.rate, half_95: fit.rate_half }),
            correlation: fit.correlation,
            next_best,
            by_vectors: what == What::Vectors,
            reference_from_estimate: if self.sign > 0.0 { turn.inverse() } else { turn },
            count: fit.count,
            seconds: self.pieces.seconds(),
            motion_rad_s: fit.motion_rad_s,
            parts: fit.blocks.iter().map(|(t, lag, sd)| (stamp(*t), offset(*lag), *sd)).collect(),
        }
    }
}

impl ClockOffset {
    /// What is added to the stamps of the estimate.
    pub fn span(&self) -> Span {
        Span::from_secs_f64(self.offset_s).unwrap_or(Span::ZERO)
    }

    /// By how much the offset changes over what both have in common, seconds.
    pub fn grows_s(&self) -> f64 {
        self.rate.map_or(0.0, |r| r.share * self.seconds)
    }
}
