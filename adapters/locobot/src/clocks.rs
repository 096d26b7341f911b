//! Topics whose stamps come from the clock of another machine.
//!
//! A message is recorded a little after its stamp. Where the camera's are recorded a millisecond after theirs and the
//! poses an hour before theirs, the two machines do not agree on the time, and a pose looked up at the stamp of an image is
//! that of another moment.

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
