//! A diagnosis as text.

use std::fmt::Write;

use vice_core::diagnose::{DiagnosisDocument, VerdictKind};

use super::table;
use crate::request::{Request, labels_shown};
use crate::text::printable;
use crate::tracking_summary::TrackingSummary;

/// The diagnosis as text.
pub fn render(document: &DiagnosisDocument) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write_text(&mut text, document);
    text
}

/// Where the labels come from, where no person made them, and how: lines ahead of a diagnosis.
pub fn labels_line(request: &Request, tracking: Option<&TrackingSummary>) -> String {
    let how = tracking.map(TrackingSummary::text).unwrap_or_default();
    labels_shown(&request.labels.file).map_or_else(String::new, |labels| format!("labels: {labels}\n{how}"))
}

fn write_text(text: &mut String, document: &DiagnosisDocument) -> std::fmt::Result {
    let (labels, verdict) = (&document.labels, &document.verdict);
    writeln!(
        text,
        "{}, {} with {}: {:.3} px over {} labels of {} points ({} {}, {:.1} s)\n",
        printable(&document.dataset),
        printable(&document.stream),
        printable(&document.depth),
        document.rmse_px,
        labels.scored,
        labels.points,
        labels.blocks,
        labels.blocks_of,
        labels.seconds,
    )?;
    let mut grid = vec![
        ["flaw, fitted alone [95 %]", "leaves px", "explains", "likelier", "labels show"]
            .map(String::from)
            .to_vec(),
    ];
    for flaw in &document.flaws {
        let shown = match flaw.rank {
            0 => "nothing of it".to_string(),
            rank if rank == flaw.of => "it".to_string(),
            rank => format!("{rank} of {} directions", flaw.of),
        };
        grid.push(vec![
            flaw.text.clone(),
            format!("{:.3}", flaw.rmse_px),
            format!("{:.0} %", flaw.explained_percent),
            format!("{:+.0}", flaw.likelier),
            shown,
        ]);
    }
    text.push_str(&table::align(&grid));
    writeln!(text, "\nverdict: {}", verdict.sentence)?;
    match verdict.kind {
        VerdictKind::Named => {
            let [low, high] = [100.0 * verdict.sureness, 100.0].map(|v: f64| v.min(99.9));
            writeln!(text, "sureness: {low:.1} %{}", if low < high { "" } else { " or more" })?;
            for correction in &verdict.corrections {
                writeln!(text, "correction: {correction}")?;
            }
        }
        VerdictKind::CannotTell => writeln!(text, "sureness: {:.1} %", 100.0 * verdict.sureness)?,
        _ => {}
    }
    for help in &verdict.labels_that_help {
        writeln!(text, "labels that would help: {help}")?;
    }
    Ok(())
}
