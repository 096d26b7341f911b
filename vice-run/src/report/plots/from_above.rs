//! Where the streams went, from above.

use crate::result::ResultDocument;
use vice_core::result::{PathPart, Role};

use super::axis::Axis;
use super::panel::{Panel, extremes};
use super::picture::{Anchor, Picture};
use super::{LEFT, Plot, RIGHT, WIDTH, estimate_class};
use crate::text::printable;

/// A path in the plane, and how it is drawn.
pub(crate) struct Track {
    pub(crate) name: String,
    pub(crate) class: String,
    pub(crate) places_m: Vec<(f64, f64)>,
}

/// The paths of a document; those that share no world each start at the origin.
pub(crate) fn from_above(document: &ResultDocument) -> Option<Plot> {
    let common = document.paths.iter().all(|p| p.in_reference_world);
    let mut estimates = 0;
    let tracks: Vec<Track> = document
        .paths
        .iter()
        .filter(|p| !p.poses.is_empty())
        .map(|path| {
            let first = if common { [0.0; 3] } else { path.poses[0].position_m };
            let class = match path.role {
                Role::Reference => "ref".to_string(),
                Role::Estimate => {
                    estimates += 1;
                    estimate_class(estimates - 1).to_string()
                }
            };
            let places_m =
                path.poses.iter().map(|p| (p.position_m[0] - first[0], p.position_m[1] - first[1])).collect();
            Track { name: printable(&path.stream), class, places_m }
        })
        .collect();
    if tracks.iter().all(|t| t.places_m.len() < 2) {
        return None;
    }
    let says = says(document, common);
    Some(Plot { title: "Path from above", svg: draw(&tracks, 0.0).0.into_svg(&says), says })
}

/// Tracks at the same scale in both directions, with their names, and `below` more space under them.
pub(crate) fn draw(tracks: &[Track], below: f64) -> (Picture, f64) {
    let all = || tracks.iter().flat_map(|t| t.places_m.iter().copied());
    let (mut x, mut y) = (Axis::covering(all().map(|p| p.0), 5), Axis::covering(all().map(|p| p.1), 5));
    let width = WIDTH - LEFT - RIGHT;
    // One metre is as long in both directions, within what fits a page.
    let mut height = width * y.span() / x.span();
    if !(140.0..=width).contains(&height) {
        height = height.clamp(140.0, width);
        let (wide, high) = (x.span().max(y.span() * width / height), y.span().max(x.span() * height / width));
        x = Axis::exactly([x.middle() - 0.5 * wide, x.middle() + 0.5 * wide], 5);
        y = Axis::exactly([y.middle() - 0.5 * high, y.middle() + 0.5 * high], 5);
    }
    let legend = 18.0 * tracks.len().div_ceil(3) as f64;
    let panel = Panel { left: LEFT, top: 24.0 + legend, width, height, x, y };
    let bottom = panel.top + height + 42.0;
    let mut picture = Picture::new(WIDTH, bottom + below);
    panel.draw_axes(&mut picture, Some("x (m)"), Some("y (m)"));
    for (place, track) in tracks.iter().enumerate() {
        let (column, row) = (place % 3, place / 3);
        let (left, y) = (12.0 + column as f64 * (WIDTH / 3.0), 12.0 + 18.0 * row as f64);
        picture.line(&track.class, [(left, y - 4.0), (left + 20.0, y - 4.0)]);
        let name: String = track.name.chars().take(20).collect();
        picture.text("name", (left + 26.0, y), Anchor::Start, &name);
    }
    for track in tracks {
        let places: Vec<(f64, f64)> = thinned(&track.places_m);
        picture.line(&track.class, places.iter().map(|p| panel.place(*p)));
        if let (Some(first), Some(last)) = (track.places_m.first(), track.places_m.last()) {
            picture.dots(&track.class, [panel.place(*last)]);
            picture.dots(&format!("big {}", track.class), [panel.place(*first)]);
        }
    }
    (picture, bottom)
}

/// A path is no function of x: every n-th place, and the last.
fn thinned(places: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let step = places.len().div_ceil(1500).max(1);
    let mut kept: Vec<(f64, f64)> = places.iter().copied().step_by(step).collect();
    kept.extend(places.last());
    extremes(&kept, kept.len())
}

fn says(document: &ResultDocument, common: bool) -> String {
    let length = |p: &PathPart| -> f64 {
        let step = |w: &[vice_core::result::PathPose]| {
            (0..3).map(|i| (w[1].position_m[i] - w[0].position_m[i]).powi(2)).sum::<f64>().sqrt()
        };
        p.poses.windows(2).map(step).sum()
    };
    let mut text: Vec<String> = Vec::new();
    for path in document.paths.iter().filter(|p| !p.poses.is_empty()) {
        let errors =
            document.trajectory.iter().find(|t| t.estimate == path.stream && path.role == Role::Estimate);
        let off = errors.and_then(|t| t.rmse_3d_m).map(|m| format!(", RMSE_3D {m:.3} m"));
        text.push(format!(
            "{} {:.2} m long{}",
            printable(&path.stream),
            length(path),
            off.unwrap_or_default()
        ));
    }
    let mut ways: Vec<&str> = document.trajectory.iter().map(|t| t.align.as_str()).collect();
    ways.dedup();
    let aligned = match document.trajectory.first() {
        Some(_) if common => format!("estimates aligned by {}", printable(&ways.join(", "))),
        _ if common => "in the world of the reference".to_string(),
        _ => "each from its own start, since they share no world".to_string(),
    };
    format!("{} ({aligned}); the larger dot is the start.", text.join("; "))
}
