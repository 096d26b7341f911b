//! How old a sample is, and how far the camera has moved since its key frame.

use crate::time::Stamp;

/// By place among the selected frames.
pub(super) struct Windows<'a> {
    pub(super) stamps: &'a [Stamp],
    /// How far the camera has moved along its path, metres.
    pub(super) moved_m: &'a [f64],
}

impl Windows<'_> {
    /// Time from one frame to another, seconds.
    #[inline]
    pub(super) fn age_s(&self, from: usize, to: u32) -> f64 {
        self.stamps[to as usize].since(self.stamps[from]).as_secs_f64()
    }

    /// Way from one frame to another, metres.
    #[inline]
    pub(super) fn way_m(&self, from: usize, to: u32) -> f64 {
        self.moved_m[to as usize] - self.moved_m[from]
    }
}
