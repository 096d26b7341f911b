//! Frames that are visited, those of them that are labelled, and where new points may start.

use vice_core::time::{Span, Stamp};

/// New points are chosen, and points held against each other, this often.
const CHECK: Span = Span::from_millis(200);

/// The frames of a window in time order. A position counts all of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    stamps: Vec<Stamp>,
    chosen: Vec<bool>,
    /// Positions of checks, ascending: the first chosen one, and further ones about a fifth of a second apart; the last
    /// frame ends the last block.
    checks: Vec<usize>,
}

impl Timeline {
    /// A timeline of ascending frames, and whether each is to be labelled. Frames before the first and behind the last
    /// one to be labelled take no part.
    pub fn new(stamps: &[Stamp], chosen: &[bool]) -> Self {
        let count = stamps.len().min(chosen.len());
        let mut checks: Vec<usize> = Vec::new();
        for position in (0..count).filter(|p| chosen[*p]) {
            // A frame that comes a little early is on time.
            let slack = Span::from_nanos(CHECK.as_nanos() * 9 / 10);
            if checks.last().is_none_or(|last| stamps[position].since(stamps[*last]) >= slack) {
                checks.push(position);
            }
        }
        if count > 0 && checks.last() != Some(&(count - 1)) {
            checks.push(count - 1);
        }
        Self { stamps: stamps[..count].to_vec(), chosen: chosen[..count].to_vec(), checks }
    }

    /// Number of positions.
    pub fn len(&self) -> usize {
        self.stamps.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.stamps.is_empty()
    }

    /// Whether the frame is labelled.
    pub fn is_chosen(&self, position: usize) -> bool {
        self.chosen[position]
    }

    /// How many are labelled.
    pub fn chosen_count(&self) -> usize {
        self.chosen.iter().filter(|c| **c).count()
    }

    /// Seconds from one position to another.
    pub(super) fn seconds(&self, from: usize, to: usize) -> f64 {
        self.stamps[to].since(self.stamps[from]).as_secs_f64()
    }

    /// Positions where points are held against each other and new ones start.
    pub(super) fn checks(&self) -> &[usize] {
        &self.checks
    }
}
