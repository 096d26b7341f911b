//! The paper's last figure: pixel error over time, with the key frames, over the position and angle error.

use vice_core::result::{FrameError, PixelPart, Role, TrajectoryPart};

use super::axis::Axis;
use super::panel::usual_gap;
use super::timeline::Timeline;
use super::{NONE_PX, Plot};
use crate::report::keys::Key;
use crate::report::numbers::{first_and_last, mean_by_frame, px, worst};
use crate::text::printable;

/// The figure of one stream; the lower panels where it is compared with a reference.
pub(crate) fn over_time(
    part: &PixelPart,
    trajectory: Option<&TrajectoryPart>,
    timeline: &Timeline,
    key: &Key,
) -> Option<Plot> {
    if part.samples.is_empty() {
        return None;
    }
    let samples = timeline.curve(part.samples.iter().map(|s| (s.timestamp_ns, s.error_px)));
    let means = timeline.curve(mean_by_frame(part));
    let frames = trajectory.map(|t| t.frames.as_slice()).unwrap_or_default();
    let panels = if frames.is_empty() { 1 } else { 3 };
    let mut picture = Timeline::picture(panels);
    let y = Axis::from_zero(samples.iter().map(|s| s.1).chain([NONE_PX]), 4);
    timeline.panel(&mut picture, (0, panels), ("pixel error, labels and mean", "px"), y, |picture, panel| {
        picture.begin_stream(key);
        panel.dots(picture, key.class, &samples);
        panel.line(picture, key.class, &means, usual_gap(&means));
        picture.end();
        timeline.dots(picture, panel);
    });
    if panels == 3 {
        let errors = |f: fn(&FrameError) -> f64| -> Vec<(f64, f64)> {
            timeline.curve(frames.iter().map(|e| (e.timestamp_ns, f(e))))
        };
        let curves = [
            ("position error, aligned", "m", errors(|e| e.position_m)),
            ("angle error, aligned", "rad", errors(|e| e.angle_rad)),
        ];
        for (index, (title, unit, values)) in (1..).zip(curves) {
            let y = Axis::from_zero(values.iter().map(|v| v.1).chain([0.001]), 4);
            timeline.panel(&mut picture, (index, panels), (title, unit), y, |picture, panel| {
                panel.stream(picture, key, &values);
                timeline.dots(picture, panel);
            });
        }
    }
    let says = says(part, timeline);
    Some(Plot { title: "Error over time", svg: picture.into_svg(&says), says })
}

fn says(part: &PixelPart, timeline: &Timeline) -> String {
    let mut text = match part.pooled_rmse_px {
        Some(rmse) => format!("RMSE_2D {} over {} labels", px(rmse), part.samples.len()),
        None => format!("{} labels", part.samples.len()),
    };
    if let Some(worst) = worst(part) {
        text.push_str(&format!(
            "; the worst is {} at {:.2} s (point {})",
            px(worst.error_px),
            timeline.seconds(worst.timestamp_ns),
            printable(&worst.point.0)
        ));
    }
    text.push_str(". ");
    if let Some((early, late)) = first_and_last(part) {
        let course = if early.max(late) < NONE_PX {
            "It stays"
        } else if late > 1.5 * early {
            "It grows with the time since the key frame"
        } else if early > 1.5 * late {
            "It shrinks with the time since the key frame"
        } else {
            "It does not depend much on the time since the key frame"
        };
        text.push_str(&format!(
            "{course}: {} on average in the first fifth of the segments, {} in the last. ",
            px(early),
            px(late)
        ));
    }
    let plural = if timeline.keyframes_s().len() == 1 { "the key frame" } else { "the key frames" };
    text.push_str(&format!("Black dots mark {plural}, where points start anew"));
    text.push_str(if part.role == Role::Reference {
        "; the reference itself against the labels."
    } else {
        "."
    });
    text
}
