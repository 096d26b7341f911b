//! How RMSE_2D answers to each flaw: a panel each, a line for each axis.

use vice_core::diagnose::{Curve, SensitivityDocument};

use super::flaw_units::{axis, shown_unit};
use super::plots::axis::Axis;
use super::plots::panel::Panel;
use super::plots::picture::{Anchor, Picture};
use super::plots::{LEFT, RIGHT, WIDTH, estimate_class};

const PANEL_HEIGHT: f64 = 120.0;
const PANEL_PITCH: f64 = 196.0;
const TOP: f64 = 52.0;

/// A file of its own.
pub fn draw(document: &SensitivityDocument) -> String {
    // Curves of a flaw that are shown in the same unit share a panel.
    let panels: Vec<&[Curve]> =
        document.curves.chunk_by(|a, b| a.flaw == b.flaw && shown_unit(a).0 == shown_unit(b).0).collect();
    let mut picture = Picture::new(WIDTH, TOP + PANEL_PITCH * panels.len() as f64);
    picture.text(
        "title",
        (12.0, 18.0),
        Anchor::Start,
        "RMSE_2D with each flaw injected; dashed: from here on a diagnosis finds it",
    );
    for (index, curves) in panels.iter().enumerate() {
        draw_panel(&mut picture, document, curves, TOP + PANEL_PITCH * index as f64);
    }
    picture.into_file(&says(document))
}

fn draw_panel(picture: &mut Picture, document: &SensitivityDocument, curves: &[Curve], top: f64) {
    let Some(first) = curves.first() else { return };
    let (unit, scale) = shown_unit(first);
    let points = || curves.iter().flat_map(|c| &c.points);
    let panel = Panel {
        left: LEFT,
        top,
        width: WIDTH - LEFT - RIGHT,
        height: PANEL_HEIGHT,
        x: Axis::exactly(points().map(|p| p.size * scale), 6),
        y: Axis::from_zero(points().map(|p| p.rmse_px), 4),
    };
    panel.draw_axes(picture, Some(&format!("{}, {unit}", first.flaw.words())), Some("RMSE_2D, px"));
    let now = panel.place_y(document.rmse_px);
    picture.line("mark", [(panel.left, now), (panel.left + panel.width, now)]);
    for (index, curve) in curves.iter().enumerate() {
        let class = estimate_class(index);
        let values: Vec<(f64, f64)> = curve.points.iter().map(|p| (p.size * scale, p.rmse_px)).collect();
        panel.line(picture, class, &values, f64::INFINITY);
        if let (Some((_, end)), false) = (values.last(), axis(curve).is_empty()) {
            // Curves that end near each other must not have their names on top of each other.
            let place = (panel.left + panel.width - 4.0 - 14.0 * index as f64, panel.place_y(*end) - 4.0);
            picture.text("name", place, Anchor::End, axis(curve));
        }
        // Where a diagnosis begins to find it.
        if let Some(found) = curve.found_from.filter(|f| curve.points.last().is_some_and(|p| *f <= p.size)) {
            let x = panel.place_x(found * scale);
            picture.line(&format!("{class} dashed"), [(x, top), (x, top + PANEL_HEIGHT)]);
        }
    }
}

fn says(document: &SensitivityDocument) -> String {
    let hidden = document.curves.iter().filter(|c| c.found_from.is_none()).count();
    format!(
        "RMSE_2D of {} over the size of {} injected errors, {:.2} pixels with none; dashed: the smallest size that a \
         diagnosis finds; {hidden} of them these labels cannot show.",
        document.stream,
        document.curves.len(),
        document.rmse_px
    )
}
