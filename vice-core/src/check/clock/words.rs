//! What is said of an offset.

use super::{CHECK, ClockDoubt, ClockOffset};
use crate::finding::{Finding, State, short};

/// Offsets beyond their interval by more than these are worth a look, or wrong, seconds.
const LOOK_S: f64 = 0.004;
const WRONG_S: f64 = 0.010;
/// The same for the stamps of images: exposures and rolling shutters take some milliseconds.
const IMAGES_LOOK_S: f64 = 0.010;
const IMAGES_WRONG_S: f64 = 0.020;

/// The finding about an estimate's clock against a reference's.
pub fn finding(reference: &str, estimate: &str, found: &Result<ClockOffset, ClockDoubt>) -> Finding {
    said(reference, estimate, found, [LOOK_S, WRONG_S])
}

/// The finding about the stamps of a camera's images against a source's: what mends them moves pose streams, whose stamps
/// the source keeps, to the images.
pub fn images_finding(source: &str, camera: &str, found: &Result<ClockOffset, ClockDoubt>) -> Finding {
    let finding = said(source, camera, found, [IMAGES_LOOK_S, IMAGES_WRONG_S]);
    match found {
        Ok(found) if finding.mend.starts_with("`time-offset`") => finding.mend(format!(
            "`time-offset` {:.4} for pose streams that keep the clock of {source}, or correct the stamps of {camera}",
            -found.offset_s
        )),
        _ => finding,
    }
}

fn said(
    reference: &str,
    estimate: &str,
    found: &Result<ClockOffset, ClockDoubt>,
    [look_s, wrong_s]: [f64; 2],
) -> Finding {
    let about = format!("{reference} / {estimate}");
    let found = match found {
        Ok(found) => found,
        Err(doubt @ ClockDoubt::Step { before_s, after_s, .. }) => {
            let says = format!("the clock of {estimate} or of {reference} was set: {doubt}");
            return Finding::new(CHECK.name, about, State::Wrong, says)
                .number("before", 1e3 * before_s, "ms")
                .number("after", 1e3 * after_s, "ms")
                .mend("no constant offset mends a step: correct the stamps at their source, or use one part with `start` and `duration`");
        }
        Err(doubt) => return Finding::new(CHECK.name, about, State::Unknown, doubt.to_string()),
    };
    let beyond = (found.offset_s.abs() - found.half_95_s).max(0.0);
    let certain = found.rate.map_or(0.0, |r| (r.share.abs() - r.half_95).max(0.0) * found.seconds);
    let state = match beyond.max(certain) {
        s if s > wrong_s => State::Wrong,
        s if s > look_s => State::Look,
        _ => State::Ok,
    };
    let ms = 1e3 * found.offset_s;
    let words = match state {
        State::Ok => format!(
            "the clocks agree within {} ms",
            short((1e2 * (ms.abs() + 1e3 * found.half_95_s)).round() / 1e2)
        ),
        _ if beyond > look_s => {
            let late = if found.offset_s < 0.0 { "late" } else { "early" };
            let moves = match certain > look_s {
                true => format!(
                    ", and the offset moves by {:.1} ms in {:.0} s",
                    1e3 * found.grows_s(),
                    found.seconds
                ),
                false => String::new(),
            };
            format!("the stamps of {estimate} are {:.1} ms {late} against {reference}{moves}", ms.abs())
        }
        _ => format!(
            "the clock of {estimate} runs at another rate than that of {reference}: the offset moves by {:.1} ms in {:.0} s",
            1e3 * found.grows_s(),
            found.seconds
        ),
    };
    let mut finding = Finding::new(CHECK.name, about, state, words)
        .number("offset", ms, "ms")
        .number("half-of-95%-interval", 1e3 * found.half_95_s, "ms")
        .number("correlation", found.correlation, "")
        .number("turns", found.count as f64, "");
    if let Some(rate) = found.rate {
        finding = finding.number("rate", 1e6 * rate.share, "ppm").number(
            "half-of-its-interval",
            1e6 * rate.half_95,
            "ppm",
        );
    }
    match state {
        State::Look | State::Wrong if beyond > look_s => {
            finding.mend(format!("`time-offset` {:.4} for {estimate}", found.offset_s))
        }
        State::Look | State::Wrong => {
            finding.mend("no constant offset mends a rate: correct the stamps at their source")
        }
        _ => finding,
    }
}
