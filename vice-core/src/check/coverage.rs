//! Whether poses are there when frames are taken, and by the same clock.

use super::Check;
use crate::finding::{Finding, State, short};
use crate::time::{Span, Stamp};
use crate::time_unit::mixed_up;
use crate::trajectory::{NoPose, Trajectory};

/// What this check is.
pub const CHECK: Check = Check {
    name: "coverage",
    title: "poses at the frames",
    looks_at: "whether frames lie within a pose stream, and within its gaps; stamps of another epoch or unit",
    threshold: "wrong where no frame has a pose, look where more than 2 % have none",
    source: "what evaluate skips and counts",
};

/// More frames without a pose than this are worth a look, a share.
const SHARE: f64 = 0.02;

/// Whether a stream has a pose at the frames. `mend_time`: the words that move its stamps.
pub fn coverage(frames: (&str, &[Stamp]), stream: (&str, &Trajectory), max_gap: Span) -> Finding {
    let ((camera, frames), (name, trajectory)) = (frames, stream);
    let about = format!("{camera} / {name}");
    let (Some(first), Some(last)) = (frames.first().copied(), frames.last().copied()) else {
        return Finding::new(CHECK.name, about, State::Unknown, "the camera has no frames");
    };
    let (mut before, mut after, mut gaps) = (0_u32, 0_u32, 0_u32);
    for frame in frames {
        match trajectory.pose_at(*frame, max_gap) {
            Ok(_) => {}
            Err(NoPose::BeforeStart) => before += 1,
            Err(NoPose::AfterEnd) => after += 1,
            Err(_) => gaps += 1,
        }
    }
    let none = f64::from(before + after + gaps);
    let share = none / frames.len() as f64;
    let numbers = |finding: Finding| {
        finding
            .number("frames", frames.len() as f64, "")
            .number("before-the-first-pose", f64::from(before), "")
            .number("after-the-last-pose", f64::from(after), "")
            .number("in-gaps", f64::from(gaps), "")
            .number("first-pose-after-first-frame", trajectory.start().since(first).as_secs_f64(), "s")
    };
    let apart = trajectory.end() < first || trajectory.start() > last;
    let has = |n: u32| if n == 1 { "frame has" } else { "frames have" };
    if apart {
        let unit = mixed_up(("poses", (trajectory.start(), trajectory.end())), ("frames", (first, last)));
        let says = format!(
            "poses and frames have no time in common: {} to {} ns against {first} to {last} ns{}",
            trajectory.start(),
            trajectory.end(),
            unit.as_ref().map_or_else(String::new, |u| format!(": {u}"))
        );
        return numbers(Finding::new(CHECK.name, about, State::Wrong, says))
            .mend("`time-offset` moves the stamps; `estimate-as` from-zero, stamps-s, stamps-ms or stamps-us reads them otherwise");
    }
    if share > SHARE {
        let state = State::Look;
        let says = format!(
            "{} % of the frames have no pose: {before} lie before the first, {after} after the last, {gaps} in gaps wider than {} s",
            short(100.0 * share),
            short(max_gap.as_secs_f64())
        );
        return numbers(Finding::new(CHECK.name, about, state, says)).mend(
            "labels there are skipped; `start` leaves out the beginning, `max-gap` bridges wider gaps",
        );
    }
    let count = none as u32;
    numbers(Finding::new(
        CHECK.name,
        about,
        State::Ok,
        format!("{count} of {} {} no pose", frames.len(), has(count)),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Rigid;

    fn stream(from_ms: i64, to_ms: i64) -> Trajectory {
        let rows =
            (from_ms..=to_ms).step_by(50).map(|m| (Stamp::from_nanos(m * 1_000_000), Rigid::identity()));
        Trajectory::from_poses(rows).unwrap()
    }

    #[test]
    fn frames_without_poses_are_counted() {
        let frames: Vec<Stamp> =
            (0..100).map(|i| Stamp::from_nanos(1_000_000_000 + i * 50_000_000)).collect();
        let said = |t: &Trajectory| coverage(("cam0", &frames), ("est", t), Span::from_millis(100));
        assert_eq!(said(&stream(0, 9_000)).state, State::Ok);
        let late = said(&stream(2_000, 9_000));
        assert!(late.state == State::Look && late.says.contains("20 lie before"), "{}", late.says);
        assert_eq!(said(&stream(20_000, 30_000)).state, State::Wrong);
        let seconds = (1..7).map(|s| (Stamp::from_nanos(s), Rigid::identity()));
        let unit = said(&Trajectory::from_poses(seconds).unwrap());
        assert!(
            unit.state == State::Wrong && unit.says.contains("seconds read as nanoseconds"),
            "{}",
            unit.says
        );
    }
}
