//! Two trajectories: from above, and their differences over time.

use vice_core::metrics::associate::PosePairs;
use vice_core::metrics::trajectory::ApeErrors;

use super::axis::Axis;
use super::from_above::{Track, draw};
use super::panel::{Panel, usual_gap};
use super::{LEFT, RIGHT, WIDTH, estimate_class};
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

/// An SVG file of aligned pairs, of one estimate or several.
pub(crate) fn file(estimates: &[(&PosePairs, &str)], reference: &str) -> String {
    let track = |name: &str, class: String, poses: &[vice_core::frames::WorldFromBody]| Track {
        name: ending(&printable(name)),
        class,
        places_m: poses.iter().map(|p| (p.translation().x, p.translation().y)).collect(),
        key: None,
    };
    let class = |index: usize| estimate_class(index).to_string();
    // The reference is drawn as far as the first estimate goes.
    let of_reference =
        estimates.iter().take(1).map(|(pairs, _)| track(reference, "ref".to_string(), pairs.reference()));
    let of_estimates =
        estimates.iter().enumerate().map(|(i, (pairs, name))| track(name, class(i), pairs.estimate()));
    let tracks: Vec<Track> = of_reference.chain(of_estimates).collect();
    let (mut picture, top) = draw(&tracks, 2.0 * (PANEL_HEIGHT + 34.0) + 12.0);
    let first =
        estimates.iter().filter_map(|(pairs, _)| pairs.stamps().first().copied()).min().unwrap_or_default();
    let seconds: Vec<Vec<f64>> = estimates
        .iter()
        .map(|(pairs, _)| pairs.stamps().iter().map(|s| s.since(first).as_secs_f64()).collect())
        .collect();
    let errors: Vec<ApeErrors> = estimates.iter().map(|(pairs, _)| ApeErrors::of(pairs)).collect();
    for (index, title) in ["position error (m)", "angle error (rad)"].into_iter().enumerate() {
        let curves: Vec<Vec<(f64, f64)>> = errors
            .iter()
            .zip(&seconds)
            .map(|(errors, seconds)| {
                let values = if index == 0 { &errors.translation_m } else { &errors.rotation_rad };
                seconds.iter().copied().zip(values.iter().copied()).collect()
            })
            .collect();
        let panel = Panel {
            left: LEFT,
            top: top + 20.0 + index as f64 * (PANEL_HEIGHT + 34.0),
            width: WIDTH - LEFT - RIGHT,
            height: PANEL_HEIGHT,
            x: Axis::exactly(seconds.iter().flatten().copied(), 6),
            y: Axis::from_zero(curves.iter().flatten().map(|v| v.1).chain([0.001]), 4),
        };
        panel.draw_axes(&mut picture, (index == 1).then_some("seconds"), Some(title));
        for (estimate, values) in curves.iter().enumerate() {
            panel.line(&mut picture, &class(estimate), values, usual_gap(values));
        }
    }
    let names: Vec<String> = estimates.iter().map(|(_, name)| printable(name)).collect();
    let poses: Vec<String> = estimates.iter().map(|(pairs, _)| pairs.len().to_string()).collect();
    picture.into_file(&format!(
        "{} against {}, {} poses",
        names.join(", "),
        printable(reference),
        poses.join(", ")
    ))
}
