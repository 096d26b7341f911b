//! Stamps of one sensor or stream: gaps, jitter, drops.

use super::Check;
use crate::finding::{Finding, State, short};
use crate::statistics::{quantile, sorted};
use crate::time::Stamp;

/// What this check is.
pub const CHECK: Check = Check {
    name: "stamps",
    title: "stamps",
    looks_at: "rate, gaps, drops and jitter of the stamps of frames, poses and inertial samples",
    threshold: "look where a regular source lacks more than 2 % of its samples, has a gap of more than ten times its spacing and half a second, or is more than 2 % off the rate that its format names",
    source: "spacing of a triggered sensor; key frames and other irregular sources have no rate to be held to",
};

/// A source is regular where this share of its spacings is near the median.
const REGULAR_SHARE: f64 = 0.8;
/// Near means within this share of the median.
const NEAR: f64 = 0.2;
/// More drops than this are worth a look, a share.
const DROPS: f64 = 0.02;
/// A gap is long above this many spacings, and above this many seconds.
const LONG_TIMES: f64 = 10.0;
const LONG_S: f64 = 0.5;

/// A rate may be off the one that is named by this share.
const RATE: f64 = 0.02;
/// From so many times the named spacing on, samples were left out on purpose.
const LEFT_OUT: f64 = 1.5;

/// The rate of a source against the one that its format names, Hz; nothing for fewer than ten samples, or a rate that is
/// none. For formats' own checks.
pub fn nominal(about: &str, what: &str, stamps: &[Stamp], rate_hz: f64) -> Option<Finding> {
    if stamps.len() < 10 || !(rate_hz.is_finite() && rate_hz > 0.0) {
        return None;
    }
    let spacings: Vec<f64> = stamps.windows(2).map(|w| w[1].since(w[0]).as_secs_f64()).collect();
    let usual = quantile(&sorted(spacings), 0.5).filter(|s| *s > 0.0)?;
    let hz = 1.0 / usual;
    let (state, says) = match hz / rate_hz {
        share if share < 1.0 / LEFT_OUT => {
            (State::Ok, format!("{hz:.2} Hz of the {rate_hz} Hz that are named: a selection of the {what}s"))
        }
        share if (share - 1.0).abs() > RATE => {
            (State::Look, format!("the {what}s come at {hz:.2} Hz, and {rate_hz} Hz are named"))
        }
        _ => (State::Ok, format!("the {what}s come at the rate that is named, {rate_hz} Hz")),
    };
    let finding =
        Finding::new(CHECK.name, about, state, says).number("rate", hz, "Hz").number("named", rate_hz, "Hz");
    Some(match state {
        State::Look => finding
            .mend("see whether stamps were made from a wrong frame rate: `vice check` compares the clocks"),
        _ => finding,
    })
}

/// What the stamps of a source are like. `what` is a word for one: frame, pose, sample.
pub fn stamps(about: &str, what: &str, stamps: &[Stamp]) -> Finding {
    if stamps.len() < 3 {
        let says = format!(
            "{} {what}{}: nothing can be said of their stamps",
            stamps.len(),
            if stamps.len() == 1 { "" } else { "s" }
        );
        return Finding::new(CHECK.name, about, State::Unknown, says);
    }
    let spacings: Vec<f64> = stamps.windows(2).map(|w| w[1].since(w[0]).as_secs_f64()).collect();
    let ordered = sorted(spacings.clone());
    let usual = quantile(&ordered, 0.5).unwrap_or(0.0);
    let near = spacings.iter().filter(|s| (*s / usual - 1.0).abs() < NEAR).count() as f64;
    let regular = near / spacings.len() as f64 >= REGULAR_SHARE;
    let (longest_at, longest) =
        spacings.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
    let seconds = stamps[stamps.len() - 1].since(stamps[0]).as_secs_f64();
    let number = |finding: Finding| {
        finding
            .number("count", stamps.len() as f64, "")
            .number("median-spacing", 1e3 * usual, "ms")
            .number("longest-spacing", 1e3 * longest, "ms")
            .number("seconds", seconds, "s")
    };
    if !regular {
        let says = format!(
            "irregular, as key frames are: {} {what}s in {} s, {} ms apart in the middle",
            stamps.len(),
            short(seconds),
            short(1e3 * usual)
        );
        return number(Finding::new(CHECK.name, about, State::Ok, says));
    }
    let lacking: f64 = spacings.iter().map(|s| ((s / usual).round() - 1.0).max(0.0)).sum();
    let share = lacking / (lacking + stamps.len() as f64);
    let jitter = quantile(&ordered, 0.95).zip(quantile(&ordered, 0.05)).map_or(0.0, |(high, low)| high - low);
    let long = longest > (LONG_TIMES * usual).max(LONG_S);
    let place = stamps[longest_at].since(stamps[0]).as_secs_f64();
    let (state, says) = if share > DROPS {
        (
            State::Look,
            format!(
                "{:.1} % of the {what}s are missing at {:.1} Hz, {lacking:.0} of them",
                100.0 * share,
                1.0 / usual
            ),
        )
    } else if long {
        (
            State::Look,
            format!("a gap of {longest:.2} s, {place:.2} s after the start, at {:.1} Hz", 1.0 / usual),
        )
    } else {
        (
            State::Ok,
            format!(
                "{} {what}s at {:.1} Hz, the longest gap is {} ms",
                stamps.len(),
                1.0 / usual,
                short(1e3 * longest)
            ),
        )
    };
    let finding = number(Finding::new(CHECK.name, about, state, says))
        .number("rate", 1.0 / usual, "Hz")
        .number("missing", lacking, "")
        .number("jitter-of-90%", 1e3 * jitter, "ms");
    match state {
        State::Look => finding.mend("what is looked up in a gap wider than `max-gap` is skipped and counted"),
        _ => finding,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_held_to_the_one_that_is_named() {
        let at = |hz: f64| -> Vec<Stamp> {
            (0..50).map(|i| Stamp::from_nanos((f64::from(i) * 1e9 / hz) as i64)).collect()
        };
        let said = |hz: f64, named: f64| nominal("cam0", "frame", &at(hz), named).map(|f| f.state);
        assert_eq!([said(20.0, 20.0), said(20.1, 20.0)], [Some(State::Ok); 2]);
        assert_eq!([said(21.0, 20.0), said(19.0, 20.0), said(200.0, 100.0)], [Some(State::Look); 3]);
        // Every tenth frame, and key frames.
        assert_eq!(said(2.0, 20.0), Some(State::Ok));
        assert_eq!([said(20.0, 0.0), said(20.0, f64::NAN)], [None; 2]);
    }

    fn at(millis: impl Iterator<Item = i64>) -> Vec<Stamp> {
        millis.map(|m| Stamp::from_nanos(m * 1_000_000)).collect()
    }

    #[test]
    fn gaps_and_drops_are_seen_and_key_frames_are_not_blamed() {
        let state = |list: Vec<Stamp>| stamps("cam0", "frame", &list).state;
        assert_eq!(state(at((0..200).map(|i| i * 50))), State::Ok);
        assert_eq!(state(at((0..200).map(|i| i * 50 + (i % 3)))), State::Ok);
        assert_eq!(
            state(at((0..200).filter(|i| i % 10 != 0).map(|i| i * 50))),
            State::Look,
            "a tenth is missing"
        );
        let gap = stamps("cam0", "frame", &at((0..200).map(|i| i * 50 + if i > 99 { 700 } else { 0 })));
        assert!(gap.state == State::Look && gap.says.contains("missing"), "{}", gap.says);
        let gap = stamps("cam0", "frame", &at((0..2000).map(|i| i * 50 + if i > 99 { 700 } else { 0 })));
        assert!(gap.state == State::Look && gap.says.contains("4.95 s after the start"), "{}", gap.says);
        assert_eq!(state(at((0..50).map(|i| i * i * 7))), State::Ok, "key frames");
        assert_eq!(state(at(0..2)), State::Unknown);
    }
}
