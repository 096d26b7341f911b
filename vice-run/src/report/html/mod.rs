//! The report: one self-contained page that renders result documents.

pub(crate) mod escape;
mod overlay;
mod page;
mod settings;
mod stream;
mod tables;

use crate::error::RunResult;
use crate::request::labels_shown;
use crate::result::ResultDocument;
use maud::{Markup, html};
use vice_core::result::{PixelPart, Role};

use super::frames::Shots;
use super::marks::Marks;
use super::numbers::{px, time_zero};
use super::plots::{estimate_class, from_above};
use crate::text::printable;

/// Bytes of JPEG that all runs of a page share; as base64 they take a third more.
pub const IMAGE_BUDGET_BYTES: usize = 2_400_000;

/// A run to report on.
pub struct Run {
    /// What tells it from the other runs.
    pub name: String,
    /// Its document.
    pub document: ResultDocument,
    /// Its pictures.
    pub shots: Shots,
    /// Sections that others have to add, already rendered.
    pub more: Vec<Section>,
}

/// A section of text lines that another command found, such as a diagnosis.
pub struct Section {
    /// Its heading.
    pub title: String,
    /// A line each.
    pub lines: Vec<String>,
}

impl Run {
    /// A run whose images are still to be added.
    pub fn new(document: ResultDocument, shots: Shots) -> Self {
        Self { name: printable(&document.dataset.name), document, shots, more: vec![] }
    }
}

/// The page.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if a document is none that JSON can hold.
pub fn render(runs: &[Run]) -> RunResult<String> {
    let title = match runs {
        [run] => format!("VICE: {}", run.name),
        runs => format!("VICE: {} runs", runs.len()),
    };
    let content = html! {
        p.brand { "VICE · Visual Inertial Correlation Estimator" }
        @if runs.len() > 1 {
            h1 { (runs.len()) " runs" }
            nav { @for (place, run) in runs.iter().enumerate() { a href={ "#run" (place) } { (run.name) } } }
        }
        @for (place, run) in runs.iter().enumerate() { (section(run, place, runs.len() == 1)) }
    };
    let data: Vec<String> = runs.iter().map(data).collect::<RunResult<_>>()?;
    Ok(page::page(&title, &content, &data))
}

/// A page around content that is no run's, with a script of its own.
pub(crate) fn page_with(title: &str, content: &Markup, script: &str) -> String {
    page::page_with(title, content, &[], script)
}

fn section(run: &Run, place: usize, alone: bool) -> Markup {
    let document = &run.document;
    let marks = Marks::of(document, None);
    let d = &document.dataset;
    html! {
        section id={ "run" (place) } {
            @if alone { h1 { (run.name) } } @else { h2 { (run.name) } }
            p.soft {
                (printable(&d.format)) ", camera " (printable(&d.camera)) ", "
                @match labels_shown(&document.request.labels.file) {
                    Some(labels) => { "labels: " (labels) }
                    None => {
                        (document.used.points.len()) " points labelled in "
                        (printable(&document.request.labels.file.display().to_string()))
                    }
                }
            }
            p { (summary(document)) }
            @if let Some(tracking) = &document.used.tracking {
                @for line in tracking.text().lines() { p.soft { (line) } }
            }
            (cards(document))
            h2 { "The table" }
            (tables::paper(document))
            (tables::scored(document))
            (tables::held_labels(document))
            (tables::doubts(document))
            h2 { "On the images" }
            (overlay::strip(&format!("run{place}"), marks.as_ref(), &run.shots, time_zero(document)))
            @for more in &run.more {
                h2 { (printable(&more.title)) }
                @for line in &more.lines { p { (printable(line)) } }
            }
            @if let Some(plot) = from_above::from_above(document) {
                h2 { "Where it went" }
                div.plots { (stream::figure(&plot)) }
            }
            h2 { "Each stream" }
            (stream::streams(document))
            h2 { "What was left out" }
            (tables::skips(document))
            h2 { "To repeat it" }
            (settings::settings(document))
        }
    }
}

/// The first thing to know, in a sentence.
fn summary(document: &ResultDocument) -> String {
    let scored = |p: &&PixelPart| p.pooled_rmse_px.is_some();
    let Some(depth) = document.pixel.first().map(|p| p.depth.as_str()) else {
        return "Nothing was evaluated.".to_string();
    };
    let of = |role| document.pixel.iter().filter(scored).filter(move |p| p.role == role && p.depth == depth);
    let error = |p: &PixelPart| p.pooled_rmse_px.map(px).unwrap_or_default();
    let mut estimates: Vec<&PixelPart> = of(Role::Estimate).collect();
    estimates.sort_by(|a, b| {
        a.pooled_rmse_px.unwrap_or_default().total_cmp(&b.pooled_rmse_px.unwrap_or_default())
    });
    let list: Vec<String> =
        estimates.iter().map(|p| format!("{} {}", printable(&p.stream), error(p))).collect();
    let mut text = match estimates.as_slice() {
        [] => "No estimate could be scored".to_string(),
        [one] => format!("{} is off by {} RMSE_2D", printable(&one.stream), error(one)),
        _ => format!("RMSE_2D of the estimates: {}", list.join(", ")),
    };
    if let Some(reference) = of(Role::Reference).next() {
        text.push_str(&format!("; the reference, {}: {}", printable(&reference.stream), error(reference)));
    }
    text.push_str(&format!(" (all points, depth from {}).", printable(depth)));
    text
}

/// A number for each stream, with the first depth source.
fn cards(document: &ResultDocument) -> Markup {
    let depth = document.pixel.first().map(|p| p.depth.as_str());
    let parts: Vec<&PixelPart> = document.pixel.iter().filter(|p| Some(p.depth.as_str()) == depth).collect();
    let mut estimates = 0;
    let cards: Vec<(&PixelPart, &str)> = parts
        .into_iter()
        .map(|part| match part.role {
            Role::Reference => (part, "ref"),
            Role::Estimate => {
                estimates += 1;
                (part, estimate_class(estimates - 1))
            }
        })
        .collect();
    html! {
        div.cards {
            @for (part, class) in cards {
                div class={ "card k-" (class) } {
                    div { (printable(&part.stream)) @if part.role == Role::Reference { " (reference)" } }
                    b { (part.pooled_rmse_px.map_or_else(|| "–".to_string(), px)) }
                    div.soft {
                        @if let Some([low, high]) = part.interval_95 { "95 %: " (px(low)) " to " (px(high)) br; }
                        (part.scored) " labels scored"
                        @if !part.skipped.is_empty() { ", " (part.skipped.len()) " skipped" }
                        @if let Some(t) = document.trajectory.iter().find(|t| part.role == Role::Estimate && t.estimate == part.stream) {
                            @if let Some(m) = t.rmse_3d_m { br; "RMSE_3D " (format!("{m:.3}")) " m" }
                            @if let Some(rad) = t.aoe_rad { ", AOE " (format!("{rad:.3}")) " rad" }
                        }
                    }
                }
            }
        }
    }
}

/// The document without what the plots are made of, for machines that read the page.
fn data(run: &Run) -> RunResult<String> {
    let mut document = run.document.clone();
    document.paths.clear();
    document.trajectory.iter_mut().for_each(vice_core::result::TrajectoryPart::drop_plots);
    for part in &mut document.pixel {
        part.samples.clear();
        part.keyframes.clear();
        part.skipped.clear();
    }
    let json = serde_json::to_string(&document)?;
    Ok(escape::json_for_script(&json))
}

#[cfg(test)]
mod tests;
