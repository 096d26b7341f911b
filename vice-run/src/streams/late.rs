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

/// The clock of a reference, which those of estimates are held against.
pub(super) struct Clock {
    name: String,
    turning: Turning,
}

impl Clock {
    /// `None` of a stream that is too long, or does not tell how it turns.
    pub(super) fn of(reference: &Stream) -> Option<Self> {
        Some(Self { name: reference.name.clone(), turning: turning(reference)? })
    }

    /// What is wrong with the clock of an estimate; `None` where it is right, or not known.
    pub(super) fn wrong(&self, estimate: &Stream) -> Option<Suspicion> {
        let answer = clock_offset(&self.turning, &turning(estimate)?, Some(RANGE_S));
        let found = finding(&self.name, &estimate.name, &answer);
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
}

fn turning(stream: &Stream) -> Option<Turning> {
    if stream.trajectory.len() > MOST_POSES {
        return None;
    }
    Turning::of_poses(&stream.trajectory)
}
