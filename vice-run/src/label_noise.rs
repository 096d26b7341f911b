//! The noise of labels under RMSE_2D.
//!
//! Squares of independent errors add: where labels alone are off by `n`, an error of `r` is one of the poses of
//! `sqrt(r² - n²)`. So the lower end of an interval is that of the poses without the labels' noise; the value and the upper
//! end stay, since how much of them is noise is not known of these labels.

use std::path::Path;

use serde::Deserialize;
use vice_core::result::{Figure, PixelPart};

use crate::error::{RunError, RunResult};
use crate::place::Place;

/// The schema of comparisons of labels.
pub const SCHEMA: &str = "vice.label-compare/1";

/// What is read of a comparison.
#[derive(Deserialize)]
struct Compared {
    schema: String,
    floor_px: Option<f64>,
}

/// The floor of a comparison of labels in a file, pixels.
///
/// # Errors
/// [`RunError`] if the file is no comparison of labels, or found no floor.
pub fn read_floor(file: &Path) -> RunResult<f64> {
    let place = Place::of_file(file)?;
    let shown = vice_files::address::shown_path(file);
    let wrong = |what: String| RunError::usage("label-noise", format!("{}: {what}", shown.display()));
    let text = std::fs::read(place.path()).map_err(|e| {
        RunError::missing(format!("{}: cannot be read", shown.display())).because(e).of("label-noise")
    })?;
    let advice = "make one with `vice labels compare A B --json FILE`";
    let comparison: Compared = serde_json::from_slice(&text)
        .map_err(|e| wrong(format!("is no comparison of labels: {e}")).advise(advice))?;
    if comparison.schema != SCHEMA {
        return Err(wrong(format!("the schema is `{}`, not {SCHEMA}", comparison.schema)).advise(advice));
    }
    match comparison.floor_px {
        Some(floor) if floor >= 0.0 && floor.is_finite() => Ok(floor),
        Some(floor) => Err(wrong(format!("the floor is {floor} px"))),
        None => Err(wrong(
            "no segment has two labels of both, so that nothing is known of their noise".to_string(),
        )),
    }
}

/// Takes the noise of the labels off the lower ends of the intervals.
pub(crate) fn put_into(part: &mut PixelPart, floor_px: f64) {
    let mut share = 1.0;
    if let Some([low, _]) = &mut part.interval_95 {
        share = share_of_poses(*low, floor_px);
        *low *= share;
    }
    // Other units are the same errors.
    for figure in part.held.iter_mut().flat_map(|h| [&mut h.mrad, &mut h.mm]).flatten() {
        lower(figure, share);
    }
    for window in part.by_age.iter_mut().chain(&mut part.by_distance) {
        let share =
            window.px.and_then(|px| px.interval_95).map_or(1.0, |[low, _]| share_of_poses(low, floor_px));
        for figure in [&mut window.px, &mut window.mrad, &mut window.mm].into_iter().flatten() {
            lower(figure, share);
        }
    }
}

fn share_of_poses(low_px: f64, floor_px: f64) -> f64 {
    if low_px <= floor_px { 0.0 } else { (1.0 - (floor_px / low_px).powi(2)).sqrt() }
}

fn lower(figure: &mut Figure, share: f64) {
    if let Some([low, _]) = &mut figure.interval_95 {
        *low *= share;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_add() {
        assert_eq!(share_of_poses(5.0, 3.0), 0.8);
        assert_eq!(share_of_poses(2.0, 2.0), 0.0);
        assert_eq!(share_of_poses(2.0, 0.0), 1.0);
    }

    #[test]
    fn only_a_comparison_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("noise.json");
        let read = |text: &str| {
            std::fs::write(&file, text).unwrap();
            read_floor(&file).map_err(|e| e.to_string())
        };
        assert_eq!(read(&format!("{{\"schema\": \"{SCHEMA}\", \"floor_px\": 0.4, \"more\": 1}}")), Ok(0.4));
        assert!(
            read(&format!("{{\"schema\": \"{SCHEMA}\", \"floor_px\": null}}"))
                .unwrap_err()
                .contains("no segment")
        );
        assert!(read("{\"schema\": \"x\", \"floor_px\": 1}").unwrap_err().contains("schema"));
        assert!(read("no").unwrap_err().contains("labels compare"));
        assert!(read_floor(Path::new("nowhere.json")).unwrap_err().to_string().contains("nowhere.json"));
    }
}
