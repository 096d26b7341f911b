//! Frames with labels and carried points over them. The strip scrolls by itself; a slider is added by the script.

use std::fmt::Write;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use vice_core::camera::Pixel;
use vice_core::time::Stamp;

use crate::report::frames::{Shot, Shots};
use crate::report::marks::{FrameMarks, Marks};
use crate::report::plots::estimate_class;
use crate::text::printable;

/// Streams beyond this have no switch of their own.
const MAX_SWITCHES: usize = 7;
/// Frames on paper.
const PRINTED: usize = 4;

/// The strip of frames, and what is wrong with it.
/// `id` tells the strips of a page apart.
pub(crate) fn strip(id: &str, marks: Option<&Marks>, shots: &Shots, zero: Stamp) -> Markup {
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
            input.o0 id={ (id) "o0" } type="checkbox" checked;
            label for={ (id) "o0" } { span.key.k-label {} "label" }
            @for (place, carrier) in marks.carriers.iter().take(MAX_SWITCHES).enumerate() {
                input class={ "o" (place + 1) } id={ (id) "o" (place + 1) } type="checkbox" checked;
                label for={ (id) "o" (place + 1) } {
                    span class={ "key k-" (class(carrier.estimate)) } {}
                    (printable(&carrier.name))
                }
            }
            div.strip tabindex="0" aria-label="frames, scroll sideways" data-first=(first) {
                @for (stamp, shot) in &shots.frames {
                    @let at = format!("{:.2} s", stamp.since(zero).as_secs_f64());
                    figure.pick[printed.contains(&stamp)] data-at=(at) {
                        div.shot {
                            img alt={ "frame at " (at) } src=(data_uri(shot));
                            @if let Some(frame) = marks.frames.get(stamp) { (PreEscaped(drawn(marks, frame, shot))) }
                        }
                        figcaption { (caption(marks, *stamp, &at)) }
                    }
                }
            }
            div.slider hidden { input type="range" min="0" max="0" value="0" aria-label="frame"; output {} }
        }
        p.note {
            "Rings: labels, filled where a point starts anew. Dots: where each stream carried the point with depth from "
            (printable(&marks.depth)) "; a line leads from the label. "
            (shots.frames.len()) " of " (marks.frames.len()) " labelled frames are shown, the worst first."
        }
        @if let Some(problem) = &shots.problem {
            p.warn { "Some images are missing: " (printable(problem)) }
        }
    }
}

fn class(estimate: Option<usize>) -> &'static str {
    estimate.map_or("ref", estimate_class)
}

fn data_uri(shot: &Shot) -> String {
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

/// The marks as SVG in the pixels of the image.
fn drawn(marks: &Marks, frame: &FrameMarks, shot: &Shot) -> String {
    let [width, height] = shot.size_px;
    let size = f64::from(width) / 120.0;
    let mut svg = format!("<svg viewBox=\"-0.5 -0.5 {width} {height}\" aria-hidden=\"true\">");
    let near = |px: Pixel| px.u.abs() < 1e5 && px.v.abs() < 1e5;
    for mark in frame.values() {
        let Some(label) = mark.label_px.filter(|px| near(*px)) else { continue };
        for (index, px, _) in mark.carried.iter().filter(|c| near(c.1)) {
            let class = class(marks.carriers.get(*index).and_then(|c| c.estimate));
            let group = (index + 1).min(MAX_SWITCHES);
            let _ = write!(
                svg,
                "<g class=\"m{group}\"><path class=\"tie c-{class}\" d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>{}</g>",
                label.u,
                label.v,
                px.u,
                px.v,
                dot(*px, size * 0.45, &format!("c-{class}"))
            );
        }
        svg.push_str("<g class=\"m0\">");
        if mark.keyframe {
            svg.push_str(&dot(label, size * 0.35, "c-label"));
        }
        svg.push_str(&ring(label, size * 1.25, "c-label"));
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
