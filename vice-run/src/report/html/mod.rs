//! The report: one self-contained page that renders result documents.

mod answers;
pub(crate) mod escape;
mod moments;
mod overlay;
mod page;
mod settings;
mod stream;
mod tables;

use crate::error::RunResult;
use crate::request::labels_shown;
use crate::result::ResultDocument;
use maud::{Markup, html};
use vice_core::result::Role;

use super::assessment::Assessment;
use super::frames::Shots;
use super::keys::{Key, keys};
use super::marks::Marks;
use super::numbers::time_zero;
use super::plots::timeline::Timeline;
use super::plots::{all_streams, coordinates, depth_difference, from_above};
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
    /// What a diagnosis and the checks say of it.
    pub assessment: Assessment,
    /// When and where the page was made, if it is to say so: without, the same input makes the same bytes.
    pub stamp: Option<String>,
}

impl Run {
    /// A run with what was found out about it.
    pub fn new(document: ResultDocument, shots: Shots, assessment: Assessment) -> Self {
        Self { name: printable(&document.dataset.name), document, shots, assessment, stamp: None }
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
    let keys = keys(document);
    let marks = Marks::of(document, None);
    let timeline = Timeline::of(document);
    let zero = time_zero(document);
    let under = format!("under{place}");
    let shown = middle_frame(&run.shots);
    let plots = |plots: Vec<super::plots::Plot>| html! { div.plots { @for plot in &plots { (stream::figure(plot)) } } };
    html! {
        section.run id={ "run" (place) } {
            @if alone { h1 { (run.name) } } @else { h2 { (run.name) } }
            (facts(run))
            (answers::answers(document, &keys, &run.assessment))
            (switches(&keys))
            h2 { "The table" }
            (tables::paper(document))
            (tables::scored(document))
            (tables::held_labels(document))
            (tables::doubts(document))
            h2 { "Over time" }
            (plots(
                all_streams::all_streams(document, &keys, &timeline)
                    .into_iter()
                    .chain(coordinates::coordinates(document, &keys, &timeline))
                    .chain(from_above::from_above(document, &keys))
                    .collect()
            ))
            h2 { "On the images" }
            (overlay::strip(marks.as_ref(), &keys, &run.shots, zero))
            @if let Some(marks) = &marks {
                (moments::moments(marks, &keys, &run.shots, zero))
                (moments::pieces(marks, &keys, &run.shots, zero))
            }
            @let depths = depth_difference::depth_differences(document, &keys, &timeline);
            @if !depths.is_empty() {
                h2 { "Depth" }
                (plots(depths))
            }
            h2 { "Each stream" }
            @if let Some((_, shot)) = shown {
                svg.hold aria-hidden="true" {
                    symbol id=(under) viewBox={ "0 0 " (shot.size_px[0]) " " (shot.size_px[1]) } preserveAspectRatio="none" {
                        image width=(shot.size_px[0]) height=(shot.size_px[1]) preserveAspectRatio="none" href=(overlay::data_uri(shot)) {}
                    }
                }
            }
            (stream::streams(document, &keys, &timeline, shown.map(|_| under.as_str())))
            h2 { "What was left out" }
            (tables::skips(document))
            h2 { "To repeat it" }
            (settings::settings(document))
        }
    }
}

/// A frame from the middle of the flight, to draw on.
fn middle_frame(shots: &Shots) -> Option<(&vice_core::time::Stamp, &super::frames::Shot)> {
    shots.frames.iter().nth(shots.frames.len() / 2)
}

/// What the page is about and how it was made, in a few lines.
fn facts(run: &Run) -> Markup {
    let document = &run.document;
    let d = &document.dataset;
    html! {
        p.soft {
            (printable(&d.format)) ", camera " (printable(&d.camera)) ", "
            @match labels_shown(&document.request.labels.file) {
                Some(labels) => { "labels: " (labels) }
                None => {
                    (document.used.points.len()) " points labelled in "
                    (printable(&document.request.labels.file.display().to_string()))
                }
            }
            ". VICE " (printable(&document.vice_version))
            @if let Some(stamp) = &run.stamp { ", " (printable(stamp)) }
        }
        @if let Some(tracking) = &document.used.tracking {
            @for line in tracking.text().lines() { p.soft { (line) } }
        }
        @if let Some(command) = settings::command(document) { pre.asked { (printable(&command)) } }
    }
}

/// The streams with their colours, to be switched off where scripts run; else the key of all plots.
fn switches(keys: &[Key]) -> Markup {
    html! {
        div.switches role="group" aria-label="streams" {
            span data-switch="label" { span.key.k-label {} "label" }
            @for key in keys {
                span data-switch=(key.id) {
                    span class={ "key k-" (key.class) } {}
                    (key.name)
                    @if key.role == Role::Reference { " (reference)" }
                }
            }
            span.hint hidden {
                "Keys: 1 to 9 streams, ← → frames, space plays, + − zoom, 0 all. Drag over a plot to zoom in time, double-click to go back."
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
