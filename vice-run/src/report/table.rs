//! The table on the terminal, in the shape of the paper's, and what was left out.

use vice_core::suspicion::Suspicion;

use crate::request::labels_shown;
use crate::result::ResultDocument;

use super::held::{self, filled, window_name, windows};
use super::rows::{mean_and_deviation, pixels, rows, sizes};
use crate::text::{printable, with_options};

/// The table, the pooled RMSE of each stream, and the skips.
pub fn render(document: &ResultDocument) -> String {
    let sizes = sizes(document);
    let mut grid: Vec<Vec<String>> = Vec::new();
    let mut head = vec!["estimate", "RMSE_3D m", "AOE rad", "ROE rad", "depth"]
        .into_iter()
        .map(String::from)
        .collect::<Vec<_>>();
    for column in ["ref", "est"] {
        for size in &sizes {
            head.push(format!("{column} {size}pt px"));
        }
    }
    grid.push(head);
    for row in rows(document) {
        let three_d = row.trajectory.map(|t| [t.rmse_3d_m, t.aoe_rad, t.roe_rad]).unwrap_or_default();
        let mut cells = vec![printable(row.stream)];
        cells.extend(three_d.map(|v| v.map_or_else(not_available, |v| format!("{v:.3}"))));
        cells.push(printable(row.depth));
        for part in [row.reference, row.estimate] {
            for size in &sizes {
                cells.push(mean_and_deviation(part, *size, "±").unwrap_or_else(not_available));
            }
        }
        grid.push(cells);
    }
    let mut text = heading(document);
    text.push_str(&align(&grid));
    for part in &document.trajectory {
        match &part.problem {
            Some(problem) => text.push_str(&format!(
                "no RMSE_3D of {}: {}\n",
                printable(&part.estimate),
                printable(problem)
            )),
            None => text.push_str(&format!("{}\n", held::poses(part))),
        }
    }
    if let Some(anchor) = held::anchor(document) {
        text.push_str(&format!("{anchor}\n"));
    }
    text.push('\n');
    text.push_str(&pooled(document));
    text.push_str(&held_labels(document));
    text.push_str(&by_age(document));
    text.push_str(&suspicions(document));
    text
}

/// What looks wrong in the data, and what to do about it.
fn suspicions(document: &ResultDocument) -> String {
    if document.suspicions.is_empty() {
        return String::new();
    }
    let line = |s: &Suspicion| format!("- {}\n", printable(&with_options(&s.line())));
    format!("\nwhat looks wrong\n{}", document.suspicions.iter().map(line).collect::<String>())
}

/// The error of the labels that hold, with its interval.
fn held_labels(document: &ResultDocument) -> String {
    if document.pixel.iter().all(|p| p.held.is_none()) {
        return String::new();
    }
    let head = ["stream", "depth", "held px [95 %]", "mrad", "mm", "median px", "set aside"];
    let mut grid = vec![head.map(String::from).to_vec()];
    for part in &document.pixel {
        let Some(held) = &part.held else { continue };
        let bare = |figure: Option<vice_core::result::Figure>| {
            figure.map_or_else(not_available, |f| held::value_and_interval(f.rmse, None))
        };
        grid.push(vec![
            printable(&part.stream),
            printable(&part.depth),
            held::held(part),
            bare(held.mrad),
            bare(held.mm),
            held.median_px.map_or_else(not_available, |v| held::value_and_interval(v, None)),
            held::set_aside(held),
        ]);
    }
    let mut text = format!("\n{}", align(&grid));
    if let Some(floor) = document.used.label_noise_px {
        let told = format!(
            "labels alone are off by {floor:.3} px (`label-noise`): low ends of intervals are without that\n"
        );
        text.push_str(&with_options(&told));
    }
    for remark in document.pixel.iter().flat_map(held::remarks) {
        text.push_str(&format!("{remark}\n"));
    }
    text
}

/// The error by age since the key frame, and by metres moved.
fn by_age(document: &ResultDocument) -> String {
    let names = filled(document);
    if names.is_empty() {
        return String::new();
    }
    let head = ["since the key frame", "depth"].into_iter().map(String::from);
    let mut grid = vec![head.chain(names.iter().map(|n| format!("{n} px"))).collect::<Vec<_>>()];
    for part in document.pixel.iter().filter(|p| p.held.is_some()) {
        let mut cells = vec![printable(&part.stream), printable(&part.depth)];
        cells.extend(names.iter().map(|name| {
            let window = windows(part).find(|w| window_name(w) == *name);
            held::figure(window.and_then(|w| w.px.as_ref()))
        }));
        grid.push(cells);
    }
    format!("\n{}", align(&grid))
}

fn not_available() -> String {
    "-".to_string()
}

fn heading(document: &ResultDocument) -> String {
    let d = &document.dataset;
    let labels = labels_shown(&document.request.labels.file).map_or_else(String::new, |l| {
        let tracking = document.used.tracking.as_ref().map_or_else(String::new, |t| t.text());
        format!("labels: {l}\n{tracking}")
    });
    format!(
        "{} ({}, {}): RMSE_2D in px, mean ± sd over subsets of the points; ref: the reference against the labels, est: the estimate against the labels\n{labels}\n",
        printable(&d.name),
        printable(&d.format),
        printable(&d.camera)
    )
}

fn pooled(document: &ResultDocument) -> String {
    let mut grid =
        vec![["stream", "role", "depth", "pooled px", "scored", "skipped"].map(String::from).to_vec()];
    for part in &document.pixel {
        let reasons: Vec<String> =
            part.skips_by_reason().iter().map(|(r, n)| format!("{n} {}", printable(r))).collect();
        let skipped = match reasons.is_empty() {
            true => "0".to_string(),
            false => format!("{} ({})", part.skipped.len(), reasons.join(", ")),
        };
        grid.push(vec![
            printable(&part.stream),
            format!("{:?}", part.role).to_lowercase(),
            printable(&part.depth),
            part.pooled_rmse_px.map_or_else(not_available, |v| pixels(v, 3)),
            part.scored.to_string(),
            skipped,
        ]);
    }
    align(&grid)
}

/// Columns as wide as their widest cell, the first row underlined.
pub fn align(grid: &[Vec<String>]) -> String {
    let columns = grid.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        grid.iter().filter_map(|r| r.get(column)).map(|c| c.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for (i, row) in grid.iter().enumerate() {
        let cells: Vec<String> = row
            .iter()
            .zip(&widths)
            .map(|(cell, width)| format!("{cell}{}", " ".repeat(width - cell.chars().count())))
            .collect();
        text.push_str(cells.join("  ").trim_end());
        text.push('\n');
        if i == 0 {
            let rule: Vec<String> = widths.iter().map(|w| "-".repeat(*w)).collect();
            text.push_str(&rule.join("  "));
            text.push('\n');
        }
    }
    text
}
