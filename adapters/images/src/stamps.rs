//! When pictures were taken: by their names, by a list, or by how many they are.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};

use crate::files::{name, number_in, stem};
use crate::list::{List, Row};
use crate::parts::Frames;

/// Pictures a second that are assumed where nothing says.
pub(crate) const ASSUMED_FPS: f64 = 30.0;

/// What the number in a picture's name counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Unit {
    Seconds,
    Milliseconds,
    Microseconds,
    Nanoseconds,
}

impl Unit {
    /// The name in `vice.toml`.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        }
    }

    pub(crate) fn parse(self, text: &str) -> Result<Stamp, vice_core::time::TimeError> {
        match self {
            Self::Seconds => Stamp::parse_seconds(text),
            Self::Milliseconds => Stamp::parse_millis(text),
            Self::Microseconds => Stamp::parse_micros(text),
            Self::Nanoseconds => Stamp::parse_nanos(text),
        }
    }
}

/// Frames in the order of their stamps.
///
/// # Errors
/// [`DataError`] if there are none, or two have one stamp.
pub(crate) fn in_order(
    folder: &Path,
    mut frames: Vec<(Stamp, PathBuf)>,
    suspicions: Vec<Suspicion>,
) -> DataResult<Frames> {
    if frames.is_empty() {
        return Err(DataError::of_kind(ErrorKind::Missing, "holds no PNG or JPEG").at(folder));
    }
    // Stable: of two with one stamp the first in the folder's order is named first.
    frames.sort_by_key(|(stamp, _)| *stamp);
    if let Some(pair) = frames.windows(2).find(|w| w[0].0 == w[1].0) {
        return Err(DataError::of_kind(
            ErrorKind::Contradictory,
            format!(
                "{} and {} have the same stamp, {} ns",
                name(&pair[0].1),
                name(&pair[1].1),
                pair[0].0.as_nanos()
            ),
        )
        .at(folder)
        .hint("take one of them away, or give a list of stamps and files (`list` in vice.toml)"));
    }
    let (stamps, files): (Vec<Stamp>, Vec<PathBuf>) = frames.into_iter().unzip();
    Ok(Frames { stamps: stamps.into(), files, suspicions })
}

/// Stamps that are the numbers in the names.
pub(crate) fn by_names(folder: &Path, pictures: Vec<PathBuf>, unit: Unit) -> DataResult<Frames> {
    let mut frames = Vec::with_capacity(pictures.len());
    for picture in pictures {
        let stem = stem(&picture);
        let text = number_in(&stem).ok_or_else(|| no_number(&picture))?;
        let stamp = unit.parse(text).map_err(|e| {
            DataError::of_kind(ErrorKind::Corrupt, format!("the name is no time in {}: {e}", unit.name()))
                .at(&picture)
                .hint("`names` in vice.toml says the unit")
        })?;
        frames.push((stamp, picture));
    }
    in_order(folder, frames, Vec::new())
}

fn no_number(picture: &Path) -> DataError {
    DataError::of_kind(ErrorKind::Missing, "the name holds no number that could say when it was taken")
        .at(picture)
        .hint("give a list of stamps (`list`) or `fps` in vice.toml, or move it out of the folder")
}

/// Stamps at even distances: the number in the name over the rate; without numbers the place in natural order. The first
/// picture is taken at `start`.
pub(crate) fn by_index(folder: &Path, pictures: Vec<PathBuf>, fps: f64, start: Stamp) -> DataResult<Frames> {
    let first = first_number(&pictures);
    counted_from(folder, pictures, fps, (first, start))
}

/// The smallest number in the names; 0 where one has none.
pub(crate) fn first_number(pictures: &[PathBuf]) -> u64 {
    numbers(pictures).and_then(|n| n.into_iter().min()).unwrap_or(0)
}

fn numbers(pictures: &[PathBuf]) -> Option<Vec<u64>> {
    pictures.iter().map(|p| number_in(&stem(p)).and_then(|n| n.parse().ok())).collect()
}

/// The same, where a picture of the number `first` is taken at `start`: cameras that count together.
pub(crate) fn counted_from(
    folder: &Path,
    pictures: Vec<PathBuf>,
    fps: f64,
    (first, start): (u64, Stamp),
) -> DataResult<Frames> {
    let numbers = numbers(&pictures).unwrap_or_else(|| (0..pictures.len() as u64).collect());
    let mut frames = Vec::with_capacity(pictures.len());
    for (number, picture) in numbers.into_iter().zip(pictures) {
        frames
            .push((at_index(number.saturating_sub(first), fps, start).map_err(|e| e.at(&picture))?, picture));
    }
    in_order(folder, frames, Vec::new())
}

/// The stamp of the n-th tick of a rate.
pub(crate) fn at_index(index: u64, fps: f64, start: Stamp) -> DataResult<Stamp> {
    if !(fps.is_finite() && fps > 0.0) {
        return Err(DataError::of_kind(ErrorKind::Usage, format!("fps = {fps} is no rate")));
    }
    let after = (index as f64 * 1e9 / fps).round();
    let span = (after < 9e18).then(|| Span::from_nanos(after as i64));
    span.and_then(|span| start.checked_add(span)).ok_or_else(|| {
        DataError::new(format!("picture {index} at {fps} Hz lies beyond what a stamp can hold"))
            .hint("the number in the name may be a stamp: `names = \"nanoseconds\"` in vice.toml")
    })
}

/// What is to be said where stamps were made up.
pub(crate) fn made(folder: &Path, fps: f64) -> Suspicion {
    Suspicion::new(
        "stamps-made",
        folder.display().to_string(),
        "the pictures have no stamps: they are counted",
    )
    .evidence(format!("one every 1/{fps} s"))
    .advice("--set fps=... says the rate; what is measured per second or against an IMU depends on it")
}

/// Stamps and files of a list. Names of files are relative to one of `roots`, the first that has the first of them; a
/// list without names is of the pictures in natural order.
pub(crate) fn by_list(list: &List, roots: &[&Path], pictures: &[PathBuf]) -> DataResult<Frames> {
    match list.rows.first() {
        Some(Row { file: Some(_), .. }) => named(list, roots, pictures),
        _ => counted(list, pictures),
    }
}

fn counted(list: &List, pictures: &[PathBuf]) -> DataResult<Frames> {
    if list.rows.len() != pictures.len() {
        let folder = pictures.first().and_then(|p| p.parent()).unwrap_or(Path::new("")).display().to_string();
        return Err(DataError::of_kind(
            ErrorKind::Contradictory,
            format!("{} stamps for the {} pictures of {folder}", list.rows.len(), pictures.len()),
        )
        .at(&list.path)
        .hint("one stamp a picture is expected; a list with the names of the files may leave some out"));
    }
    let frames = list.rows.iter().zip(pictures).map(|(row, p)| (row.stamp, p.clone())).collect();
    in_list_order(list, frames, Vec::new())
}

fn named(list: &List, roots: &[&Path], pictures: &[PathBuf]) -> DataResult<Frames> {
    let mut there: HashMap<PathBuf, bool> = pictures.iter().map(|p| (p.clone(), false)).collect();
    // The names may be relative to the list, to the recording or to the pictures' folder.
    let hits = |root: &&&Path| {
        list.rows.iter().filter_map(|r| r.file.as_deref()).take(50).filter(|f| root.join(f).is_file()).count()
    };
    let best = roots.iter().rev().max_by_key(hits).copied().unwrap_or(Path::new(""));
    let (mut frames, mut missing, mut first_missing) = (Vec::new(), 0_u64, None);
    for row in &list.rows {
        let Some(file) = &row.file else {
            return Err(list.error(row.line, "the row names no file, as others do"));
        };
        let path = vice_files::paths::safe_join(best, file)
            .map_err(|e| list.error(row.line, e.problem()))?
            .components()
            .collect::<PathBuf>();
        match there.get_mut(&path) {
            Some(seen) => *seen = true,
            None if path.is_file() => {}
            None => {
                missing += 1;
                first_missing.get_or_insert_with(|| file.clone());
            }
        }
        frames.push((row.stamp, path));
    }
    let mut suspicions = Vec::new();
    let about = list.path.display().to_string();
    if missing > 0 && missing < frames.len() as u64 {
        suspicions.push(
            Suspicion::new("pictures-missing", &about, "pictures that the list names are not there")
                .evidence(format!(
                    "{missing} of {}, the first is {}; their stamps are used all the same",
                    frames.len(),
                    first_missing.unwrap_or_default()
                )),
        );
    }
    let unlisted: BTreeMap<&PathBuf, ()> =
        there.iter().filter(|(_, seen)| !**seen).map(|(path, _)| (path, ())).collect();
    if let Some((first, ())) = unlisted.first_key_value() {
        suspicions.push(
            Suspicion::new(
                "pictures-not-listed",
                &about,
                "pictures that the list does not name are left out",
            )
            .evidence(format!(
                "{} of {}, the first is {}",
                unlisted.len(),
                pictures.len(),
                name(first)
            )),
        );
    }
    in_list_order(list, frames, suspicions)
}

/// A list is in the order of time, and says so by its line where it is not.
fn in_list_order(
    list: &List,
    frames: Vec<(Stamp, PathBuf)>,
    suspicions: Vec<Suspicion>,
) -> DataResult<Frames> {
    if let Some(at) = frames.windows(2).position(|w| w[0].0 >= w[1].0) {
        let (before, after) = (frames[at].0, frames[at + 1].0);
        let what = if before == after {
            format!("stamp {after} ns appears twice: two pictures have one stamp")
        } else {
            format!("stamp {after} ns is earlier than the one before, {before} ns")
        };
        return Err(list.error(list.rows[at + 1].line, what));
    }
    let folder = list.path.parent().unwrap_or(Path::new(""));
    in_order(folder, frames, suspicions)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(names: &[&str]) -> Vec<PathBuf> {
        names.iter().map(PathBuf::from).collect()
    }

    #[test]
    fn names_are_stamps_in_their_unit() {
        let frames = |names: &[&str], unit| by_names(Path::new("f"), paths(names), unit);
        let found = frames(&["1305031102.175304.png", "1305031102.143333.png"], Unit::Seconds).unwrap();
        assert_eq!(found.stamps[0].as_nanos(), 1_305_031_102_143_333_000);
        assert_eq!(found.files[0], Path::new("1305031102.143333.png"), "in the order of time");
        let found = frames(&["a_12.jpg"], Unit::Milliseconds).unwrap();
        assert_eq!(found.stamps[0].as_nanos(), 12_000_000);
        let error = frames(&["left.png"], Unit::Seconds).unwrap_err().to_string();
        assert!(error.starts_with("left.png: ") && error.contains("no number"), "{error}");
        let error = frames(&["a_7.png", "b_7.png"], Unit::Seconds).unwrap_err().to_string();
        assert!(error.contains("a_7.png and b_7.png have the same stamp"), "{error}");
        assert!(frames(&[], Unit::Seconds).unwrap_err().to_string().contains("no PNG or JPEG"));
    }

    #[test]
    fn pictures_are_counted_at_a_rate() {
        let start = Stamp::from_nanos(1_000);
        let found = by_index(Path::new("f"), paths(&["f3.png", "f4.png", "f13.png"]), 10.0, start).unwrap();
        let ns: Vec<i64> = found.stamps.iter().map(|s| s.as_nanos()).collect();
        assert_eq!(ns, [1_000, 100_001_000, 1_000_001_000]);
        let found = by_index(Path::new("f"), paths(&["a.png", "b.png"]), 2.0, start).unwrap();
        assert_eq!(found.stamps[1].as_nanos(), 500_001_000, "without numbers by their order");
        let fails = |names: &[&str], fps: f64| by_index(Path::new("f"), paths(names), fps, start).is_err();
        assert!(fails(&["1.png"], 0.0) && fails(&["1.png"], f64::NAN));
        assert!(fails(&["1.png", "18000000000000000000.png"], 0.1));
    }
}
