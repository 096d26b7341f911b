//! The part of the page about each stream.

use maud::{Markup, PreEscaped, html};
use vice_core::result::{PixelPart, Role};

use crate::report::keys::Key;
use crate::report::plots::timeline::Timeline;
use crate::report::plots::{Plot, correlation, over_time, spread, vectors};
use crate::result::ResultDocument;
use crate::text::printable;

/// Sections of all streams, with the first depth source that they have. `under` names a picture for the error vectors.
pub(crate) fn streams(
    document: &ResultDocument,
    keys: &[Key],
    timeline: &Timeline,
    under: Option<&str>,
) -> Markup {
    html! {
        @for key in keys {
            @if let Some(part) = document.pixel.iter().find(|p| p.stream == key.stream && p.role == key.role) {
                h3 {
                    span class={ "key k-" (key.class) } {}
                    (key.name)
                    @if key.role == Role::Reference { " (reference)" }
                }
                p.soft { "depth from " (printable(&part.depth)) }
                (plots(document, part, key, timeline, under))
            }
        }
    }
}

fn plots(
    document: &ResultDocument,
    part: &PixelPart,
    key: &Key,
    timeline: &Timeline,
    under: Option<&str>,
) -> Markup {
    let trajectory = document
        .trajectory
        .iter()
        .find(|t| part.role == Role::Estimate && t.estimate == part.stream && !t.frames.is_empty());
    let plots = [
        over_time::over_time(part, trajectory, timeline, key),
        trajectory.and_then(|t| correlation::against_truth(part, t, key.class)),
        vectors::vectors(part, document.dataset.image_size_px, key.class, under),
        spread::histogram(part, key.class),
        spread::per_point(part, key.class),
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
