//! Automatic labels in the place of a file: `auto`, or `auto:N` for N points.

use std::path::Path;

use crate::error::{RunError, RunResult};

/// Points that are labelled where nobody says how many: enough to outvote those that go wrong.
pub const DEFAULT_POINTS: usize = 40;
/// More are refused: there is no room for them in an image.
pub const MOST_POINTS: usize = 1000;

const NAME: &str = "auto";

/// How many points a request asks for that names automatic labels; `None` for one that names a file. A file of that name
/// is named `./auto`.
///
/// # Errors
/// [`RunError`] of the kind usage for a count that is none.
pub fn points_asked(labels: &Path) -> RunResult<Option<usize>> {
    let Some(text) = labels.to_str() else { return Ok(None) };
    if text == NAME {
        return Ok(Some(DEFAULT_POINTS));
    }
    let Some(count) = text.strip_prefix("auto:") else { return Ok(None) };
    match count.parse() {
        Ok(points) if (1..=MOST_POINTS).contains(&points) => Ok(Some(points)),
        _ => Err(RunError::usage(
            "labels",
            format!("`{text}`: the number of points is not within 1 to {MOST_POINTS}"),
        )
        .advise("`auto`, or `auto:4` for four points; a file of that name is `./auto`")),
    }
}

/// Whether a request names automatic labels and no file.
pub fn is_auto(labels: &Path) -> bool {
    !matches!(points_asked(labels), Ok(None))
}

/// What a person reads in the place of the file's name.
pub fn labels_shown(labels: &Path) -> Option<String> {
    let points = points_asked(labels).ok().flatten()?;
    Some(format!("automatic, {points} point{}", if points == 1 { "" } else { "s" }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn automatic_labels_are_told_from_files() {
        let asked = |text: &str| points_asked(Path::new(text)).map_err(|e| e.to_string());
        assert_eq!(asked("auto"), Ok(Some(DEFAULT_POINTS)));
        assert_eq!(asked("auto:4"), Ok(Some(4)));
        assert_eq!(asked("./auto"), Ok(None));
        assert_eq!(asked("auto.json"), Ok(None));
        for wrong in ["auto:0", "auto:", "auto:x", "auto:1001"] {
            assert!(asked(wrong).unwrap_err().contains("1 to 1000"), "{wrong}");
            assert!(is_auto(Path::new(wrong)), "no file is meant");
        }
        assert_eq!(labels_shown(Path::new("auto:1")).unwrap(), "automatic, 1 point");
    }
}
