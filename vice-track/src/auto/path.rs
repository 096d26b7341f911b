//! One point, and where it was seen.

use vice_core::camera::Pixel;

/// Whether a label may start at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ground {
    /// It may; with how far away that is, metres along the axis, where that is known.
    Fit(Option<f64>),
    /// It may not: nothing says how far away it is, or it is at an edge.
    Unfit,
}

/// Why a point was followed no further.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// There was no more to follow it through.
    Open,
    Left,
    Lost,
    Doubtful,
    NoWayBack,
}

/// A point in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    pub(super) px: Pixel,
    /// What the tracker says.
    pub(super) confidence: f32,
    /// How far off the way back ended, of the block of frames that it was followed through; NaN where none was gone.
    pub(super) back_px: f32,
}

/// Of places for which everything speaks so many are further off than a pixel, and of those for which nothing does.
const MISSED: [f64; 2] = [0.002, 0.1];
/// And so many more of those that were not held against the others, or not gone back to.
const MISSED_UNCHECKED: f64 = 0.035;

/// How sure a place is: the share of such places that lie within a pixel of where their key frame's point is.
///
/// Fitted to 34 000 labels of rendered flights, of a floor of bricks, with motion blur and under changing light, and of a
/// hand-held camera before tags: see docs/labels.md.
pub(super) fn confidence(seen: &Seen, off: f64) -> f64 {
    let back = f64::from(seen.back_px);
    let fall = |x: f64| if x.is_nan() { 1.0 } else { 1.0 / (1.0 + x.powi(4)) };
    let speaks = f64::from(seen.confidence) * fall(back) * fall(off / 1.5);
    let unchecked = if back.is_nan() || off.is_nan() { MISSED_UNCHECKED } else { 0.0 };
    1.0 - (MISSED[0] + MISSED[1] * (1.0 - speaks.clamp(0.0, 1.0)) + unchecked)
}

/// One point from where it was chosen.
#[derive(Clone, Debug)]
pub(super) struct Path {
    /// Position where it starts.
    pub(super) start: usize,
    /// From there on, position by position; none where the frame could not be decoded.
    pub(super) seen: Vec<Option<Seen>>,
    pub(super) end: End,
    /// The place that it starts from, where it was given: which point, and which of its places.
    pub(super) given: Option<(usize, usize)>,
    /// Places of checks where labels may start, ascending, with how far away they are.
    pub(super) fit: Vec<(usize, Option<f64>)>,
}

impl Path {
    pub(super) fn at(&self, position: usize) -> Option<&Seen> {
        self.seen.get(position.checked_sub(self.start)?)?.as_ref()
    }

    /// The last position, whether it was seen there or the frame could not be decoded.
    pub(super) fn last(&self) -> usize {
        self.start + self.seen.len().max(1) - 1
    }

    /// Drops what lies behind a position.
    pub(super) fn cut_after(&mut self, position: usize) {
        self.seen.truncate((position + 1).saturating_sub(self.start));
        self.fit.retain(|(p, _)| *p <= position);
    }

    /// A path that was followed through a timeline of so many positions from its end, as one of the timeline itself.
    pub(super) fn turned(mut self, positions: usize) -> Self {
        let last = self.last();
        self.seen.reverse();
        self.start = positions - 1 - last;
        self.fit.iter_mut().for_each(|(p, _)| *p = positions - 1 - *p);
        self.fit.reverse();
        self
    }
}
