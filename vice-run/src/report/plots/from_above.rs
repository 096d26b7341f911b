//! Where the streams went, from above.

use crate::result::ResultDocument;
use vice_core::result::{PathPart, Role};

use super::axis::Axis;
use super::coordinates::{Placed, placed};
use super::panel::{Panel, extremes};
use super::picture::{Anchor, Picture};
use super::{LEFT, Plot, RIGHT, WIDTH};
use crate::report::keys::Key;

/// Names beside each other.
const COLUMNS: usize = 2;

/// A path in the plane, and how it is drawn.
pub(crate) struct Track {
    pub(crate) name: String,
    pub(crate) class: String,
    pub(crate) places_m: Vec<(f64, f64)>,
    /// Its stream, on a page that can hide it.
    pub(crate) key: Option<Key>,
}

/// The paths of a document; where there is no reference each starts at the origin.
pub(crate) fn from_above(document: &ResultDocument, keys: &[Key]) -> Option<Plot> {
    let placed = placed(document, keys);
    let tracks: Vec<Track> = placed
        .paths
        .iter()
        .map(|(key, path)| {
            let first = if placed.common { [0.0; 3] } else { path.poses[0].position_m };
            let places_m =
                path.poses.iter().map(|p| (p.position_m[0] - first[0], p.position_m[1] - first[1])).collect();
            Track {
                name: key.name.clone(),
                class: key.class.to_string(),
                places_m,
                key: Some((*key).clone()),
            }
        })
        .collect();
    if tracks.iter().all(|t| t.places_m.len() < 2) {
        return None;
    }
    let says = says(document, &placed);
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
    let legend = 18.0 * tracks.len().div_ceil(COLUMNS) as f64;
    let panel = Panel { left: LEFT, top: 24.0 + legend, width, height, x, y };
    let bottom = panel.top + height + 42.0;
    let mut picture = Picture::new(WIDTH, bottom + below);
    panel.draw_axes(&mut picture, Some("x (m)"), Some("y (m)"));
    for (place, track) in tracks.iter().enumerate() {
        let (column, row) = (place % COLUMNS, place / COLUMNS);
        let (left, y) = (12.0 + column as f64 * (WIDTH / COLUMNS as f64), 12.0 + 18.0 * row as f64);
        picture.line(&track.class, [(left, y - 4.0), (left + 20.0, y - 4.0)]);
        let name: String = track.name.chars().take(20).collect();
        picture.text("name", (left + 26.0, y), Anchor::Start, &name);
    }
    for track in tracks {
        if let Some(key) = &track.key {
            picture.begin_stream(key);
        }
        let places: Vec<(f64, f64)> = thinned(&track.places_m);
        picture.line(&track.class, places.iter().map(|p| panel.place(*p)));
        if let (Some(first), Some(last)) = (track.places_m.first(), track.places_m.last()) {
            picture.dots(&track.class, [panel.place(*last)]);
            picture.dots(&format!("big {}", track.class), [panel.place(*first)]);
        }
        if track.key.is_some() {
            picture.end();
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

fn says(document: &ResultDocument, placed: &Placed<'_>) -> String {
    let length = |p: &PathPart| -> f64 {
        let step = |w: &[vice_core::result::PathPose]| {
            (0..3).map(|i| (w[1].position_m[i] - w[0].position_m[i]).powi(2)).sum::<f64>().sqrt()
        };
        p.poses.windows(2).map(step).sum()
    };
    let mut text: Vec<String> = Vec::new();
    for (key, path) in &placed.paths {
        let errors =
            document.trajectory.iter().find(|t| t.estimate == path.stream && path.role == Role::Estimate);
        let off = errors.and_then(|t| t.rmse_3d_m).map(|m| format!(", RMSE_3D {m:.3} m"));
        text.push(format!("{} {:.2} m long{}", key.name, length(path), off.unwrap_or_default()));
    }
    format!("{} ({}); the larger dot is the start.", text.join("; "), placed.words(document))
}
