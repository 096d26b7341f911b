//! What there is to see of one stream with one depth source.

use crate::result::ResultDocument;
use maud::{Markup, PreEscaped, html};
use vice_core::result::{PixelPart, Role};

use crate::report::numbers::time_zero;
use crate::report::plots::{Plot, correlation, estimate_class, over_time, spread, vectors};
use crate::text::printable;

/// Sections of all streams; the first depth source open, the others to be opened.
pub(crate) fn streams(document: &ResultDocument) -> Markup {
    let mut names: Vec<(&str, Role)> = Vec::new();
    for part in &document.pixel {
        if !names.contains(&(part.stream.as_str(), part.role)) {
            names.push((&part.stream, part.role));
        }
    }
    html! {
        @for (name, role) in &names {
            @let parts: Vec<&PixelPart> =
                document.pixel.iter().filter(|p| p.stream == *name && p.role == *role).collect();
            @let class = class(&names, name, *role);
            h3 {
                span class={ "key k-" (class) } {}
                (printable(name))
                @if *role == Role::Reference { " (reference)" }
            }
            @for (place, part) in parts.iter().enumerate() {
                @if place == 0 {
                    p.soft { "depth from " (printable(&part.depth)) }
                    (plots(document, part, class))
                } @else {
                    details {
                        summary { "with depth from " (printable(&part.depth)) }
                        (plots(document, part, class))
                    }
                }
            }
        }
    }
}

/// The colour of a stream: its place among the estimates.
pub(crate) fn class(names: &[(&str, Role)], name: &str, role: Role) -> &'static str {
    match role {
        Role::Reference => "ref",
        Role::Estimate => {
            let mut estimates = names.iter().filter(|n| n.1 == Role::Estimate);
            estimate_class(estimates.position(|n| n.0 == name).unwrap_or(0))
        }
    }
}

fn plots(document: &ResultDocument, part: &PixelPart, class: &str) -> Markup {
    let trajectory = document
        .trajectory
        .iter()
        .find(|t| part.role == Role::Estimate && t.estimate == part.stream && !t.frames.is_empty());
    let plots = [
        over_time::over_time(part, trajectory, time_zero(document), class),
        trajectory.and_then(|t| correlation::against_truth(part, t, class)),
        vectors::vectors(part, document.dataset.image_size_px, class),
        spread::histogram(part, class),
        spread::per_point(part, class),
    ];
    let plots: Vec<Plot> = plots.into_iter().flatten().collect();
    html! {
        @if plots.is_empty() {
            @if part.scored == 0 {
                p.warn { "No label could be scored; the reasons stand below." }
            } @else {
                p.warn { "The result lists no samples (it was written with --samples none), so that there is nothing to plot." }
            }
        } @else {
            div.plots { @for plot in &plots { (figure(plot)) } }
        }
    }
}

/// A plot with its sentence.
pub(crate) fn figure(plot: &Plot) -> Markup {
    html! {
        figure {
            h4 { (plot.title) }
            (PreEscaped(&plot.svg))
            figcaption { (plot.says) }
        }
    }
}
