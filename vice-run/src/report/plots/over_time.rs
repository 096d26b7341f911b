//! The paper's last figure: pixel error over time, with the key frames, over the position and angle error.

use std::collections::BTreeSet;

use vice_core::result::{PixelPart, Role, TrajectoryPart};

use vice_core::time::Stamp;

use super::axis::Axis;
use super::panel::{Panel, usual_gap};
use super::picture::Picture;
use super::{LEFT, NONE_PX, Plot, RIGHT, WIDTH};
use crate::report::numbers::{first_and_last, mean_by_frame, px, worst};
use crate::text::printable;

const PANEL_HEIGHT: f64 = 128.0;
const BETWEEN: f64 = 34.0;
/// More key frames than this are marked by dots alone.
const MAX_LINES: usize = 80;

/// The figure of one stream; the lower panels where it is compared with a reference.
pub(crate) fn over_time(
    part: &PixelPart,
    trajectory: Option<&TrajectoryPart>,
    zero: Stamp,
    class: &str,
) -> Option<Plot> {
    if part.samples.is_empty() {
        return None;
    }
    let seconds = |stamp: Stamp| stamp.since(zero).as_secs_f64();
    let samples: Vec<(f64, f64)> =
        part.samples.iter().map(|s| (seconds(s.timestamp_ns), s.error_px)).collect();
    let means: Vec<(f64, f64)> =
        mean_by_frame(part).into_iter().map(|(stamp, error)| (seconds(stamp), error)).collect();
    let keyframes: BTreeSet<Stamp> = part.keyframes.iter().map(|k| k.timestamp_ns).collect();
    let keyframes: Vec<f64> = keyframes.into_iter().map(seconds).collect();
    let frames = trajectory.map(|t| t.frames.as_slice()).unwrap_or_default();
    let times = samples.iter().map(|s| s.0).chain(keyframes.iter().copied());
    let x = Axis::exactly(times.chain(frames.iter().map(|f| seconds(f.timestamp_ns))), 6);
    let panels = if frames.is_empty() { 1 } else { 3 };
    let height = f64::from(panels) * (PANEL_HEIGHT + BETWEEN) + 22.0;
    let mut picture = Picture::new(WIDTH, height);
    let panel = |index: u8, y: Axis| Panel {
        left: LEFT,
        top: 24.0 + f64::from(index) * (PANEL_HEIGHT + BETWEEN),
        width: WIDTH - LEFT - RIGHT,
        height: PANEL_HEIGHT,
        x: x.clone(),
        y,
    };
    let x_title = |index: i32| (index + 1 == panels).then_some("seconds");

    let pixels = panel(0, Axis::from_zero(samples.iter().map(|s| s.1).chain([NONE_PX]), 4));
    pixels.draw_axes(
        &mut picture,
        x_title(0),
        Some("pixel error (px): each label, and the mean of the points"),
    );
    mark(&mut picture, &pixels, &keyframes);
    pixels.dots(&mut picture, class, &samples);
    let gap = usual_gap(&means);
    pixels.line(&mut picture, class, &means, gap);
    picture.dots("big ink", keyframes.iter().map(|t| pixels.place((*t, 0.0))));
    if panels == 3 {
        let errors = |f: fn(&vice_core::result::FrameError) -> f64| -> Vec<(f64, f64)> {
            frames.iter().map(|e| (seconds(e.timestamp_ns), f(e))).collect()
        };
        let curves = [
            ("position error (m)", errors(|e| e.position_m)),
            ("angle error (rad)", errors(|e| e.angle_rad)),
        ];
        for (index, (title, values)) in (1_u8..).zip(curves) {
            let panel = panel(index, Axis::from_zero(values.iter().map(|v| v.1).chain([0.001]), 4));
            panel.draw_axes(&mut picture, x_title(i32::from(index)), Some(title));
            mark(&mut picture, &panel, &keyframes);
            panel.line(&mut picture, class, &values, usual_gap(&values));
        }
    }
    let says = says(part, zero, keyframes.len());
    Some(Plot { title: "Error over time", svg: picture.into_svg(&says), says })
}

fn mark(picture: &mut Picture, panel: &Panel, keyframes: &[f64]) {
    if keyframes.len() <= MAX_LINES {
        let lines = keyframes.iter().map(|t| {
            let x = panel.place_x(*t);
            ((x, panel.top), (x, panel.top + panel.height))
        });
        picture.strokes("mark", lines);
    }
}

fn says(part: &PixelPart, zero: Stamp, keyframes: usize) -> String {
    let mut text = match part.pooled_rmse_px {
        Some(rmse) => format!("RMSE_2D {} over {} labels", px(rmse), part.samples.len()),
        None => format!("{} labels", part.samples.len()),
    };
    if let Some(worst) = worst(part) {
        text.push_str(&format!(
            "; the worst is {} at {:.2} s (point {})",
            px(worst.error_px),
            worst.timestamp_ns.since(zero).as_secs_f64(),
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
    let plural = if keyframes == 1 { "the key frame" } else { "the key frames" };
    text.push_str(&format!("Black dots mark {plural}, where points start anew"));
    text.push_str(if part.role == Role::Reference {
        "; the reference itself against the labels."
    } else {
        "."
    });
    text
}
