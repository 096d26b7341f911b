//! Topics whose stamps come from the clock of another machine.
//!
//! A message is recorded a little after its stamp. Where the camera's are recorded a millisecond after theirs and the
//! poses an hour before theirs, the two machines do not agree on the time, and a pose looked up at the stamp of an image is
//! that of another moment.

use vice_core::finding::{Finding, State};
use vice_core::suspicion::Suspicion;
use vice_core::time::Span;

use crate::choose::Topics;
use crate::container::Topic;
use crate::index::Index;

/// A difference that no transport or filter makes.
const TOO_MUCH: Span = Span::from_millis(1000);

/// Topics that are recorded all the time much later or earlier after their stamps than the camera: a transform that is
/// dated ahead now and then, or a pose that was held back, says nothing of clocks.
pub(crate) fn doubt(topics: &[Topic], chosen: &Topics, index: &Index) -> Option<Suspicion> {
    let camera = chosen.color.or(chosen.cameras.first().copied())?;
    let (least, most) = index.delays.of(camera)?;
    let is_apart = |(low, high): (Span, Span)| low - most > TOO_MUCH || least - high > TOO_MUCH;
    let seconds = |span: Span| span.as_secs_f64();
    let off: Vec<String> = (0..topics.len())
        .filter_map(|topic| Some((topic, index.delays.of(topic)?)))
        .filter(|(topic, delay)| !index.images.contains_key(topic) && is_apart(*delay))
        .map(|(topic, delay)| format!("{} {:.3} s", topics[topic].name, seconds(delay.0)))
        .collect();
    if off.is_empty() {
        return None;
    }
    let message = "the stamps of the camera and of others seem to come from clocks that differ";
    Some(
        Suspicion::new("clocks-differ", format!("topic {}", topics[camera].name), message)
            .evidence(format!(
                "recorded {:.3} s after their stamps, of {}",
                seconds(least),
                crate::tf::list(&off)
            ))
            .advice("--time-offset shifts the estimates; `--set stamps=record` takes the time of recording"),
    )
}

/// Name of the finding about delays.
const DELAY: &str = "delay";
/// Delays whose least one moves by more than this, at more than this rate, are two clocks.
const DRIFT: Span = Span::from_millis(20);
const DRIFT_SHARE: f64 = 1e-5;
/// Delays beyond this are another epoch, such as simulated time: their drift is that of the simulation.
const OTHER_EPOCH: Span = Span::from_millis(1_000_000_000);

/// How long after their stamps the messages of each topic were recorded: a topic whose least delay moves is stamped by a
/// clock that runs at another rate than the recorder's.
pub(crate) fn delays(topics: &[Topic], index: &Index) -> Vec<Finding> {
    let millis = |span: Span| 1e3 * span.as_secs_f64();
    let mut found = Vec::new();
    let (mut least, mut most, mut count, mut other) = (f64::INFINITY, f64::NEG_INFINITY, 0_u32, 0_u32);
    for (topic, Topic { name, .. }) in topics.iter().enumerate() {
        let Some((low, high)) = index.delays.of(topic) else { continue };
        if low.abs() > OTHER_EPOCH {
            other += 1;
            continue;
        }
        count += 1;
        (least, most) = (least.min(millis(low)), most.max(millis(high)));
        let Some((drift, time)) = index.delays.drift(topic) else { continue };
        let share = drift.as_secs_f64() / time.as_secs_f64().max(1e-3);
        if drift.abs() > DRIFT && share.abs() > DRIFT_SHARE {
            let says = format!(
                "the time from stamp to recording moves by {:.0} ms in {:.0} s: its stamps are of a clock that runs at another rate than the recorder's",
                millis(drift),
                time.as_secs_f64()
            );
            found.push(
                Finding::new(DELAY, format!("topic {name}"), State::Look, says)
                    .number("drift", millis(drift), "ms")
                    .number("rate", 1e6 * share, "ppm")
                    .number("least", millis(low), "ms")
                    .number("most", millis(high), "ms")
                    .mend("where others are stamped by the recorder's clock, `--set stamps=record` takes its time"),
            );
        }
    }
    if found.is_empty() && count > 0 {
        let says = format!(
            "{count} topics were recorded {least:.0} to {most:.0} ms after their stamps, without drift"
        );
        found.push(
            Finding::new(DELAY, "", State::Ok, says).number("least", least, "ms").number("most", most, "ms"),
        );
    }
    if other > 0 {
        let says = format!(
            "{other} topics have stamps of another epoch than the recording's, such as simulated time"
        );
        found.push(Finding::new(DELAY, "", State::Unknown, says));
    }
    found
}
