//! The tables: the paper's, what was scored, and what was left out.

use std::collections::BTreeMap;

use crate::result::ResultDocument;
use maud::{Markup, html};
use vice_core::result::{PixelPart, Role};

use crate::report::held;
use crate::report::rows::{mean_and_deviation, pixels, rows, sizes};
use crate::text::{printable, with_options};

const NOT_AVAILABLE: &str = "–";

/// The table in the paper's shape.
pub(crate) fn paper(document: &ResultDocument) -> Markup {
    let sizes = sizes(document);
    html! {
        div.wide {
            table {
                thead {
                    tr {
                        th.t { "" }
                        th.g colspan="3" { "Δ(On-Board, GT)" }
                        th.g { "" }
                        th.g colspan=(sizes.len()) { "Δ(VICE, GT) px" }
                        th.g colspan=(sizes.len()) { "Δ(VICE, On-Board) px" }
                    }
                    tr {
                        th.t { "estimate" }
                        th.g { "RMSE_3D m" } th { "AOE rad" } th { "ROE rad" }
                        th.t.g { "depth" }
                        @for _ in 0..2 {
                            @for (place, size) in sizes.iter().enumerate() {
                                th.g[place == 0] { (size) @if *size == 1 { " point" } @else { " points" } }
                            }
                        }
                    }
                }
                tbody {
                    @for row in rows(document) {
                        tr {
                            td.t { (printable(row.stream)) }
                            @let three_d = row.trajectory.map(|t| [t.rmse_3d_m, t.aoe_rad, t.roe_rad]).unwrap_or_default();
                            @for (place, value) in three_d.into_iter().enumerate() {
                                td.g[place == 0] { (value.map_or_else(|| NOT_AVAILABLE.to_string(), |v| format!("{v:.3}"))) }
                            }
                            td.t.g { (printable(row.depth)) }
                            @for part in [row.reference, row.estimate] {
                                @for (place, size) in sizes.iter().enumerate() {
                                    td.g[place == 0] {
                                        (mean_and_deviation(part, *size, "±").unwrap_or_else(|| NOT_AVAILABLE.to_string()))
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
        p.note {
            "RMSE_2D in pixels, mean ± standard deviation over all sets of so many points. GT: the reference against the labels; \
             On-Board: the estimate against the labels."
        }
        @for part in &document.trajectory {
            @match &part.problem {
                Some(problem) => p.warn { "No RMSE_3D of " (printable(&part.estimate)) ": " (printable(problem)) },
                None => p.note { (held::poses(part)) "." },
            }
        }
        @if let Some(anchor) = held::anchor(document) { p.note { (anchor) "." } }
    }
}

/// The error of the labels that hold with its interval, and by age since the key frame.
pub(crate) fn held_labels(document: &ResultDocument) -> Markup {
    let parts: Vec<&PixelPart> = document.pixel.iter().filter(|p| p.held.is_some()).collect();
    let names = held::filled(document);
    html! {
        @if !parts.is_empty() {
            div.wide {
                table {
                    thead {
                        tr {
                            th.t { "labels that hold" } th.t { "depth" } th { "RMSE_2D px [95 %]" } th { "mrad" } th { "mm" }
                            th { "median px" } th.t { "set aside" }
                            @for name in &names { th { "at " (name) ", px" } }
                        }
                    }
                    tbody { @for part in &parts { (held_row(part, &names)) } }
                }
            }
            p.note {
                "A label is set aside where it, or the key frame that its point started from, is off and the other points at that \
                 time are not. The interval says how RMSE_2D would come out with other points on the same flight; by age, since the \
                 key frame, or by metres moved, it does not depend on how long labels live."
            }
            @for remark in parts.iter().flat_map(|p| held::remarks(p)) { p.warn { (remark) "." } }
        }
    }
}

fn held_row(part: &PixelPart, names: &[String]) -> Markup {
    html! {
        @if let Some(held) = &part.held {
            tr {
                td.t { (printable(&part.stream)) }
                td.t { (printable(&part.depth)) }
                td { (held::held(part)) }
                td { (held::figure(held.mrad.as_ref())) }
                td { (held::figure(held.mm.as_ref())) }
                td { (held.median_px.map_or_else(|| NOT_AVAILABLE.to_string(), |v| held::value_and_interval(v, None))) }
                td.t { (held::set_aside(held)) }
                @for name in names {
                    td { (held::figure(held::windows(part).find(|w| held::window_name(w) == *name).and_then(|w| w.px.as_ref()))) }
                }
            }
        }
    }
}

/// What looks wrong but did not stop the evaluation.
pub(crate) fn doubts(document: &ResultDocument) -> Markup {
    html! {
        @for suspicion in document.suspicions.iter() { p.warn { (printable(&with_options(&suspicion.line()))) } }
    }
}

/// Pooled error, and how much of the labels it rests on.
pub(crate) fn scored(document: &ResultDocument) -> Markup {
    html! {
        div.wide {
            table {
                thead {
                    tr {
                        th.t { "stream" } th.t { "role" } th.t { "depth" } th { "RMSE_2D px, all points" } th { "scored" } th { "skipped" }
                    }
                }
                tbody {
                    @for part in &document.pixel {
                        tr {
                            td.t { (printable(&part.stream)) }
                            td.t { (role(part.role)) }
                            td.t { (printable(&part.depth)) }
                            td { (part.pooled_rmse_px.map_or_else(|| NOT_AVAILABLE.to_string(), |v| pixels(v, 3))) }
                            td { (part.scored) }
                            td { (part.skipped.len()) }
                        }
                    }
                }
            }
        }
    }
}

/// Labels that could not be scored, by reason.
pub(crate) fn skips(document: &ResultDocument) -> Markup {
    /// How many, of which points, from when on.
    type Group<'a> = (usize, Vec<&'a str>, i64);
    // By reason, stream and depth.
    let mut groups: BTreeMap<(&str, &str, &str), Group<'_>> = BTreeMap::new();
    for part in &document.pixel {
        for skip in &part.skipped {
            let key = (skip.reason.name(), part.stream.as_str(), part.depth.as_str());
            let group = groups.entry(key).or_insert((0, vec![], i64::MAX));
            group.0 += 1;
            group.2 = group.2.min(skip.timestamp_ns.as_nanos());
            if !group.1.contains(&&*skip.point.0) && group.1.len() <= 12 {
                group.1.push(&skip.point.0);
            }
        }
    }
    html! {
        @if groups.is_empty() {
            p { "Every label was scored." }
        } @else {
            div.wide {
                table {
                    thead {
                        tr { th.t { "reason" } th.t { "stream" } th.t { "depth" } th { "labels" } th.t { "points" } th { "from, ns" } }
                    }
                    tbody {
                        @for ((reason, stream, depth), (count, points, first)) in groups {
                            tr {
                                td.t { (printable(reason)) }
                                td.t { (printable(stream)) }
                                td.t { (printable(depth)) }
                                td { (count) }
                                td.wrap { (named(&points)) }
                                td { (first) }
                            }
                        }
                    }
                }
            }
            p.note { "What each reason means stands in docs/evaluate.md. Labels that a person marked as occluded do not count against the run." }
        }
    }
}

fn named(points: &[&str]) -> String {
    let shown: Vec<String> = points.iter().take(12).map(|p| printable(p)).collect();
    format!("{}{}", shown.join(", "), if points.len() > 12 { ", …" } else { "" })
}

fn role(role: Role) -> &'static str {
    match role {
        Role::Reference => "reference",
        Role::Estimate => "estimate",
    }
}
