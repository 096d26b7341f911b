//! A pose stream with poses too far apart to be interpolated, such as the key frames of a SLAM system.

use super::{Selection, Stream};
use crate::statistics::middle;
use crate::suspicion::Suspicion;
use crate::time::{Span, Stamp};
use crate::trajectory::{NoPose, Trajectory};

/// Says so where half of the evaluated frames or more lie between two poses that are too far apart.
pub(super) fn suspicion(
    stream: &Stream,
    selection: &Selection<'_>,
    frames: &[Stamp],
    max_gap: Span,
) -> Option<Suspicion> {
    let trajectory = &stream.trajectory;
    let in_gaps: Vec<Stamp> = selection
        .in_window
        .iter()
        .map(|frame| frames[*frame])
        .filter(|stamp| matches!(trajectory.pose_at(*stamp, max_gap), Err(NoPose::Gap { .. })))
        .collect();
    if in_gaps.is_empty() || 2 * in_gaps.len() < selection.in_window.len() {
        return None;
    }
    let spacing = trajectory.median_spacing()?;
    let mut away: Vec<Span> = in_gaps.iter().map(|stamp| distance(trajectory, *stamp)).collect();
    let away = middle(&mut away, Ord::cmp)?;
    let wide = spacing.max(max_gap);
    Some(
        Suspicion::new("sparse-poses", &stream.name, "the poses are too far apart to be interpolated")
            .evidence(format!(
                "a pose every {} s, --max-gap is {} s; {} of {} frames lie in a gap, the nearest pose {} s away",
                spacing.to_short_text(),
                max_gap.to_short_text(),
                in_gaps.len(),
                selection.in_window.len(),
                away.to_short_text()
            ))
            .advice(format!(
                "take the poses of all frames, not of the key frames only; or give --max-gap {}, which makes straight \
                 lines of what lies between",
                Span::from_nanos(wide.as_nanos().saturating_add(wide.as_nanos() / 10)).to_short_text()
            )),
    )
}

fn distance(trajectory: &Trajectory, stamp: Stamp) -> Span {
    trajectory.stamps()[trajectory.nearest(stamp)].since(stamp).abs()
}
