//! Which frames the window keeps, and finding frames by their stamps.

use super::Window;
use crate::time::Stamp;

/// Finds frames by their exact stamp. Labels mostly go from one frame to the next, so that is looked at first.
pub(super) struct FrameFinder<'a> {
    frames: &'a [Stamp],
    next: usize,
}

impl<'a> FrameFinder<'a> {
    pub(super) const fn new(frames: &'a [Stamp]) -> Self {
        Self { frames, next: 0 }
    }

    #[inline]
    pub(super) fn find(&mut self, stamp: Stamp) -> Option<usize> {
        let frame = match self.frames.get(self.next) {
            Some(next) if *next == stamp => self.next,
            _ => self.frames.binary_search(&stamp).ok()?,
        };
        self.next = frame + 1;
        Some(frame)
    }
}

/// The frames of the window.
pub(super) struct KeptFrames {
    first: Stamp,
    last: Stamp,
    /// With a rate, the frames nearest to its ticks; without, all.
    ticked: Option<Vec<bool>>,
}

impl KeptFrames {
    pub(super) fn new(frames: &[Stamp], window: &Window) -> Self {
        let first = frames[0] + window.start;
        let last = window.duration.map_or(Stamp::MAX, |d| first + d);
        let ticked = window.fps.map(|fps| {
            let period_ns = 1e9 / fps;
            let end = last.min(frames[frames.len() - 1]);
            let mut ticked = vec![false; frames.len()];
            let mut next_frame = frames.partition_point(|s| *s < first);
            // Ticks between two frames all choose one of the two, so that walking frames, not ticks, bounds the work.
            while next_frame < frames.len() {
                let before = next_frame.checked_sub(1).filter(|i| frames[*i] >= first);
                let stamp = frames[next_frame];
                let from_ns = before.map_or(0, |i| frames[i].since(first).as_nanos()) as f64;
                let to_ns = stamp.since(first).as_nanos() as f64;
                let middle = before.map_or(f64::NEG_INFINITY, |_| 0.5 * (from_ns + to_ns));
                let limit_ns = end.since(first).as_nanos() as f64;
                let first_tick = (from_ns / period_ns).ceil();
                let last_tick = (to_ns.min(limit_ns) / period_ns).floor();
                if first_tick <= last_tick {
                    // A tick in the middle chooses the earlier frame.
                    if let Some(before) = before.filter(|_| first_tick * period_ns <= middle) {
                        ticked[before] = true;
                    }
                    if last_tick * period_ns > middle {
                        ticked[next_frame] = true;
                    }
                }
                next_frame += 1;
            }
            ticked
        });
        Self { first, last, ticked }
    }

    #[inline]
    pub(super) fn covers(&self, stamp: Stamp) -> bool {
        stamp >= self.first && stamp <= self.last
    }

    #[inline]
    pub(super) fn has(&self, frame: usize) -> bool {
        self.ticked.as_ref().is_none_or(|t| t[frame])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Span;

    fn kept(millis: &[i64], fps: f64, duration_ms: Option<i64>) -> Vec<usize> {
        let frames: Vec<Stamp> = millis.iter().map(|m| Stamp::from_nanos(m * 1_000_000)).collect();
        let window =
            Window { fps: Some(fps), duration: duration_ms.map(Span::from_millis), ..Window::default() };
        let ticked = KeptFrames::new(&frames, &window).ticked.unwrap();
        (0..frames.len()).filter(|i| ticked[*i]).collect()
    }

    #[test]
    fn each_tick_keeps_its_nearest_frame() {
        let twenty_hz: Vec<i64> = (0..21).map(|i| 1000 + 50 * i).collect();
        assert_eq!(kept(&twenty_hz, 10.0, None), (0..21).step_by(2).collect::<Vec<_>>());
        assert_eq!(kept(&twenty_hz, 10.0, Some(300)), [0, 2, 4, 6]);
        // Ticks at 0, 100, 200 ...: 130 is nearest to 100, 180 to 200, and 500 to those from 340 on.
        assert_eq!(kept(&[0, 60, 130, 180, 500], 10.0, None), [0, 2, 3, 4]);
        assert_eq!(kept(&[0], 10.0, None), [0]);
        let window = Window { start: Span::from_nanos(90), fps: None, ..Window::default() };
        assert_eq!(window.frames(&[0, 100, 200].map(Stamp::from_nanos)), [1, 2]);
        assert_eq!(Window::default().frames(&[]), [0_usize; 0]);
        // Faster than the frames: all are kept.
        assert_eq!(kept(&[0, 10, 20, 33], 1000.0, None), [0, 1, 2, 3]);
    }
}
