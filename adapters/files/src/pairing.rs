//! Which picture of one list belongs to which of another: by stamps, where the second list has its own clock ticks.

use vice_core::time::{Span, Stamp};

/// Half the time to the nearer neighbour of a frame; a lone frame takes only its own stamp.
pub fn half_period(frames: &[Stamp], index: usize) -> Span {
    let before = index.checked_sub(1).map(|i| frames[index].since(frames[i]));
    let after = frames.get(index + 1).map(|next| next.since(frames[index]));
    let nearer = before.into_iter().chain(after).min().unwrap_or(Span::ZERO);
    Span::from_nanos(nearer.as_nanos() / 2)
}

/// Index of the stamp nearest to another; of two that are equally near the earlier one. `stamps` increase.
pub fn nearest(stamps: &[Stamp], stamp: Stamp) -> Option<usize> {
    let after = stamps.partition_point(|s| *s < stamp);
    let candidates = [after.checked_sub(1), (after < stamps.len()).then_some(after)];
    candidates.into_iter().flatten().min_by_key(|i| stamps[*i].since(stamp).abs())
}

/// The one of `others` that belongs to a frame: the nearest, within half a frame period.
pub fn belonging(frames: &[Stamp], index: usize, others: &[Stamp]) -> Option<usize> {
    let stamp = *frames.get(index)?;
    let found = nearest(others, stamp)?;
    (others[found].since(stamp).abs() <= half_period(frames, index)).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_takes_what_is_nearer_to_it_than_to_its_neighbours() {
        let stamps = |ms: &[i64]| ms.iter().map(|t| Stamp::from_nanos(t * 1_000_000)).collect::<Vec<_>>();
        let frames = stamps(&[0, 30, 60, 200]);
        let depth = stamps(&[14, 44, 76, 195]);
        let found: Vec<Option<usize>> = (0..4).map(|i| belonging(&frames, i, &depth)).collect();
        assert_eq!(found, [Some(0), Some(1), None, Some(3)]);
        assert_eq!(belonging(&frames, 9, &depth), None);
        assert_eq!(belonging(&frames[..1], 0, &depth), None, "a lone frame takes only its own stamp");
        assert_eq!(belonging(&frames[..1], 0, &frames), Some(0));
        assert_eq!(nearest(&[], frames[0]), None);
    }
}
