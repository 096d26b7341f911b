//! Two trajectories: from above, and their differences over time.

use vice_core::metrics::associate::PosePairs;
use vice_core::metrics::trajectory::ApeErrors;

use super::axis::Axis;
use super::from_above::{Track, draw};
use super::panel::{Panel, usual_gap};
use super::{LEFT, RIGHT, WIDTH};
use crate::text::printable;

const PANEL_HEIGHT: f64 = 110.0;

/// The end of a path, which tells more than its beginning.
fn ending(name: &str) -> String {
    let count = name.chars().count();
    if count <= 20 {
        name.to_string()
    } else {
        std::iter::once('…').chain(name.chars().skip(count - 19)).collect()
    }
}

/// An SVG file of aligned pairs.
pub(crate) fn file(pairs: &PosePairs, reference: &str, estimate: &str) -> String {
    let track = |name: &str, class: &str, poses: &[vice_core::frames::WorldFromBody]| Track {
        name: ending(&printable(name)),
        class: class.to_string(),
        places_m: poses.iter().map(|p| (p.translation().x, p.translation().y)).collect(),
    };
    let tracks = [track(reference, "ref", pairs.reference()), track(estimate, "e0", pairs.estimate())];
    let (mut picture, top) = draw(&tracks, 2.0 * (PANEL_HEIGHT + 34.0) + 12.0);
    let errors = ApeErrors::of(pairs);
    let first = pairs.stamps().first().copied().unwrap_or_default();
    let seconds: Vec<f64> = pairs.stamps().iter().map(|s| s.since(first).as_secs_f64()).collect();
    let curves = [("position error (m)", &errors.translation_m), ("angle error (rad)", &errors.rotation_rad)];
    for (index, (title, values)) in curves.into_iter().enumerate() {
        let values: Vec<(f64, f64)> = seconds.iter().copied().zip(values.iter().copied()).collect();
        let panel = Panel {
            left: LEFT,
            top: top + 20.0 + index as f64 * (PANEL_HEIGHT + 34.0),
            width: WIDTH - LEFT - RIGHT,
            height: PANEL_HEIGHT,
            x: Axis::exactly(seconds.iter().copied(), 6),
            y: Axis::from_zero(values.iter().map(|v| v.1).chain([0.001]), 4),
        };
        panel.draw_axes(&mut picture, (index == 1).then_some("seconds"), Some(title));
        panel.line(&mut picture, "e0", &values, usual_gap(&values));
    }
    picture.into_file(&format!(
        "{} against {}, {} poses",
        printable(estimate),
        printable(reference),
        pairs.len()
    ))
}
