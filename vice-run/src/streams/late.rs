//! Whether an estimate's clock is another one than the reference's: said, never mended by itself.

use vice_core::check::State;
use vice_core::check::clock::{clock_offset, finding};
use vice_core::check::turning::Turning;
use vice_core::evaluate::Stream;
use vice_core::suspicion::Suspicion;

/// Longer streams are left to `vice check`: an evaluation should not wait for it.
const MOST_POSES: usize = 200_000;
/// Offsets that are looked at, seconds to either side.
const RANGE_S: f64 = 1.0;

/// What is wrong with the clock of an estimate; `None` where it is right, or not known.
pub(super) fn clock(reference: &Stream, estimate: &Stream) -> Option<Suspicion> {
    if reference.trajectory.len().max(estimate.trajectory.len()) > MOST_POSES {
        return None;
    }
    let (a, b) = (Turning::of_poses(&reference.trajectory)?, Turning::of_poses(&estimate.trajectory)?);
    let found = finding(&reference.name, &estimate.name, &clock_offset(&a, &b, Some(RANGE_S)));
    if found.state != State::Wrong {
        return None;
    }
    // What was added already is part of what mends it.
    let mut suspicion = found.suspicion()?;
    if estimate.time_offset != vice_core::time::Span::ZERO {
        suspicion.advice.push_str(&format!(
            " beside the {} s that are added already",
            estimate.time_offset.to_seconds_text()
        ));
    }
    Some(suspicion)
}
