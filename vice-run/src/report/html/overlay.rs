//! Frames with labels and carried points over them. Without a script they scroll; the script shows one at a time.

use std::fmt::Write;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use vice_core::camera::Pixel;
use vice_core::time::Stamp;

use super::escape::push_escaped;
use crate::report::frames::{Shot, Shots};
use crate::report::keys::{Key, of_carrier};
use crate::report::marks::{FrameMarks, Marks};
use crate::text::printable;

/// Frames on paper.
const PRINTED: usize = 4;

/// The strip of frames, and what is wrong with it.
pub(crate) fn strip(marks: Option<&Marks>, keys: &[Key], shots: &Shots, zero: Stamp) -> Markup {
    let (Some(marks), false) = (marks, shots.frames.is_empty()) else {
        let why = shots.problem.clone().unwrap_or_else(|| "there is none".to_string());
        return html! { p.warn { "No images to draw on: " (printable(&why)) } };
    };
    let order = marks.by_interest();
    let worst = order.iter().find(|s| shots.frames.contains_key(s));
    let first = shots.frames.keys().position(|s| Some(s) == worst).unwrap_or(0);
    let printed: Vec<&Stamp> = order.iter().filter(|s| shots.frames.contains_key(s)).take(PRINTED).collect();
    html! {
        div.frames {
            div.strip tabindex="0" role="group" aria-label="frames: arrow keys step, space plays" data-first=(first) {
                @for (stamp, shot) in &shots.frames {
                    @let seconds = stamp.since(zero).as_secs_f64();
                    @let at = format!("{seconds:.2} s");
                    figure.pick[printed.contains(&stamp)] data-t=(seconds) {
                        div.shot {
                            img alt={ "frame at " (at) } src=(data_uri(shot));
                            @if let Some(frame) = marks.frames.get(stamp) { (PreEscaped(drawn(marks, keys, frame, shot, false))) }
                        }
                        figcaption { (caption(marks, *stamp, &at)) }
                    }
                }
            }
            div.slider hidden {
                button type="button" class="play" { "Play" }
                input type="range" min="0" max="0" value="0" aria-label="frame";
                output {}
            }
        }
        p.note {
            "Rings: labels, filled where a point starts anew. Dots: where each stream carried the point with depth from "
            (printable(&marks.depth)) "; a line leads from the label. "
            (shots.frames.len()) " of " (marks.frames.len()) " labelled frames are here, and the worst is shown first."
        }
        @if let Some(problem) = &shots.problem {
            p.warn { "Some images are missing: " (printable(problem)) }
        }
    }
}

pub(crate) fn data_uri(shot: &Shot) -> String {
    format!("data:image/jpeg;base64,{}", STANDARD.encode(&shot.jpeg))
}

fn caption(marks: &Marks, stamp: Stamp, at: &str) -> String {
    let mut text = at.to_string();
    for (index, carrier) in marks.carriers.iter().enumerate() {
        if let Some(error) = marks.mean_error_px(stamp, index) {
            let _ = write!(text, " · {} {}", printable(&carrier.name), crate::report::numbers::px(error));
        }
    }
    text
}

/// The marks as SVG in the pixels of the image; with the names of the points where there is room for them.
pub(crate) fn drawn(marks: &Marks, keys: &[Key], frame: &FrameMarks, shot: &Shot, names: bool) -> String {
    let [width, height] = shot.size_px;
    let size = f64::from(width) / 120.0;
    let mut svg = format!("<svg viewBox=\"-0.5 -0.5 {width} {height}\" aria-hidden=\"true\">");
    let near = |px: Pixel| px.u.abs() < 1e5 && px.v.abs() < 1e5;
    for (point, mark) in frame {
        let Some(label) = mark.label_px.filter(|px| near(*px)) else { continue };
        for (index, px, _) in mark.carried.iter().filter(|c| near(c.1)) {
            let key = marks.carriers.get(*index).and_then(|c| of_carrier(keys, c));
            let (class, id) = key.map_or(("ref", 0), |k| (k.class, k.id));
            let _ = write!(
                svg,
                "<g data-s=\"{id}\"><path class=\"tie c-{class}\" d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>{}</g>",
                label.u,
                label.v,
                px.u,
                px.v,
                dot(*px, size * 0.45, &format!("c-{class}"))
            );
        }
        svg.push_str("<g data-s=\"label\">");
        if mark.keyframe {
            svg.push_str(&dot(label, size * 0.35, "c-label"));
        }
        svg.push_str(&ring(label, size * 1.25, "c-label"));
        if names {
            let (x, y) = (label.u + size * 1.7, label.v - size * 1.1);
            let _ = write!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{:.1}\">", size * 2.5);
            push_escaped(&mut svg, &point.0.chars().take(16).collect::<String>());
            svg.push_str("</text>");
        }
        svg.push_str("</g>");
    }
    svg.push_str("</svg>");
    svg
}

fn ring(px: Pixel, radius: f64, class: &str) -> String {
    let circle = |class: &str| {
        format!("<circle class=\"{class}\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius:.1}\"/>", px.u, px.v)
    };
    circle("halo") + &circle(&format!("mk {class}"))
}

/// A filled dot, as a ring as wide as its radius.
fn dot(px: Pixel, radius: f64, class: &str) -> String {
    ring(px, radius, class)
}
