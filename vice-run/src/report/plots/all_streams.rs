//! All streams in one plot: the pixel error, which starts anew at each key frame, over the errors that motion capture
//! tells, as the paper's last figure has them.

use vice_core::result::{MotionError, PixelPart, Role, TrajectoryPart};

use super::axis::Axis;
use super::timeline::Timeline;
use super::{NONE_PX, Plot};
use crate::report::keys::{Key, of};
use crate::report::numbers::{mean_by_frame, means, px};
use crate::result::ResultDocument;

/// The curve of a stream.
type Curve<'a> = (&'a Key, Vec<(f64, f64)>);

/// The plot, with the first depth source.
pub(crate) fn all_streams(document: &ResultDocument, keys: &[Key], timeline: &Timeline) -> Option<Plot> {
    let depth = &document.pixel.first()?.depth;
    let parts: Vec<(&Key, &PixelPart)> = document
        .pixel
        .iter()
        .filter(|p| p.depth == *depth && !p.samples.is_empty())
        .filter_map(|p| Some((of(keys, &p.stream, p.role)?, p)))
        .collect();
    if parts.is_empty() {
        return None;
    }
    let pixels: Vec<Curve<'_>> =
        parts.iter().map(|(key, part)| (*key, timeline.curve(mean_by_frame(part)))).collect();
    let estimates: Vec<(&Key, &TrajectoryPart)> = document
        .trajectory
        .iter()
        .filter_map(|t| Some((of(keys, &t.estimate, Role::Estimate)?, t)))
        .collect();
    let moved = |value: fn(&MotionError) -> f64| -> Vec<Curve<'_>> {
        estimates.iter().map(|(key, t)| (*key, since_keyframe(t, timeline, value))).collect()
    };
    let aligned = |value: fn(&vice_core::result::FrameError) -> f64| -> Vec<Curve<'_>> {
        let curve = |t: &TrajectoryPart| timeline.curve(t.frames.iter().map(|f| (f.timestamp_ns, value(f))));
        estimates.iter().map(|(key, t)| (*key, curve(t))).collect()
    };
    let all = [
        ("pixel error, mean of the points", "px", pixels),
        ("position error since the key frame", "m", moved(|m| m.position_m)),
        ("angle error since the key frame", "rad", moved(|m| m.angle_rad)),
        ("position error, aligned", "m", aligned(|f| f.position_m)),
        ("angle error, aligned", "rad", aligned(|f| f.angle_rad)),
    ];
    let panels: Vec<_> = all.into_iter().filter(|(_, _, c)| c.iter().any(|c| !c.1.is_empty())).collect();
    let mut picture = Timeline::picture(panels.len());
    for (index, (title, unit, curves)) in panels.iter().enumerate() {
        let least = if index == 0 { NONE_PX } else { 0.001 };
        let y = Axis::from_zero(curves.iter().flat_map(|c| c.1.iter().map(|v| v.1)).chain([least]), 4);
        timeline.panel(&mut picture, (index, panels.len()), (title, unit), y, |picture, panel| {
            for (key, values) in curves {
                panel.stream(picture, key, values);
            }
            timeline.dots(picture, panel);
        });
    }
    let says = says(&parts, estimates.is_empty());
    Some(Plot { title: "All streams over time", svg: picture.into_svg(&says), says })
}

/// The mean over the key frames that labels at a stamp started from.
fn since_keyframe(
    part: &TrajectoryPart,
    timeline: &Timeline,
    value: fn(&MotionError) -> f64,
) -> Vec<(f64, f64)> {
    let values = part.since_keyframe.iter().map(|m| (m.timestamp_ns, value(m)));
    timeline.curve(means(values.filter(|(_, value)| value.is_finite())))
}

fn says(parts: &[(&Key, &PixelPart)], alone: bool) -> String {
    let of = |(key, part): &(&Key, &PixelPart)| Some(format!("{} {}", key.name, px(part.pooled_rmse_px?)));
    let list: Vec<String> = parts.iter().filter_map(of).collect();
    let truth = if alone {
        " No estimate could be compared with a reference, so that only pixels are shown."
    } else {
        ""
    };
    format!(
        "RMSE_2D: {}. Black dots mark the key frames, where points start anew and the pixel error begins at zero; dotted lines carry them through all panels.{truth}",
        list.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::keys::keys;
    use crate::report::testing::{document, keyframe, part, sample};
    use vice_core::result::FrameError;
    use vice_core::time::Stamp;

    fn both() -> ResultDocument {
        let second = 1_000_000_000;
        let samples: Vec<_> = (1..9).map(|i| sample("a", i * second, i as f64)).collect();
        let mut one = part("one", &samples);
        one.keyframes = vec![keyframe("a", 0)];
        let mut document = document(vec![one, part("two", &samples)]);
        document.trajectory.push(TrajectoryPart {
            estimate: "one".to_string(),
            reference: "truth".to_string(),
            align: "se3".to_string(),
            matched: 8,
            rmse_3d_m: Some(0.1),
            aoe_rad: None,
            roe_rad: None,
            problem: None,
            frames: (0..9)
                .map(|i| FrameError {
                    timestamp_ns: Stamp::from_nanos(i * second),
                    position_m: 0.1,
                    angle_rad: 0.01,
                    evaluated: true,
                })
                .collect(),
            since_keyframe: [1, 2]
                .map(|k| MotionError {
                    keyframe_ns: Stamp::from_nanos(k),
                    timestamp_ns: Stamp::from_nanos(3 * second),
                    position_m: k as f64,
                    angle_rad: 0.0,
                })
                .to_vec(),
        });
        document
    }

    #[test]
    fn a_stream_without_a_reference_changes_no_panel_of_the_others() {
        let document = both();
        let timeline = Timeline::of(&document);
        let plot = all_streams(&document, &keys(&document), &timeline).unwrap();
        assert_eq!(plot.svg.matches("class=\"view\"").count(), 5);
        assert!(plot.says.contains("one") && plot.says.contains("two"), "{}", plot.says);
        // Every panel has the same seconds from left to right.
        assert_eq!(plot.svg.matches("data-x0=\"0\" data-x1=\"8\"").count(), 5);
        let curve = since_keyframe(&document.trajectory[0], &timeline, |m| m.position_m);
        assert_eq!(curve, [(3.0, 1.5)]);
    }

    #[test]
    fn without_any_reference_there_are_pixels_only() {
        let mut document = both();
        document.trajectory.clear();
        let plot = all_streams(&document, &keys(&document), &Timeline::of(&document)).unwrap();
        assert_eq!(plot.svg.matches("class=\"view\"").count(), 1);
        assert!(plot.says.contains("only pixels"));
    }
}
