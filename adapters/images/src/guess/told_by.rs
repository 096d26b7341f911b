//! What tells when pictures were taken: a list beside them, or their names.

use std::path::{Path, PathBuf};

use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

use crate::files::{entries, number_in, stem};
use crate::list::List;
use crate::stamps::Unit;

/// The list that is of these pictures: it names one of them, or has a stamp for each.
pub(super) fn list_of(
    there: &[PathBuf],
    files: &[PathBuf],
    folder: &Path,
    trajectories: &[(PathBuf, Trajectory)],
) -> Option<PathBuf> {
    let place = there.first()?.parent()?;
    let tables = |p: &&PathBuf| p.extension().is_some_and(|e| e == "txt" || e == "csv");
    let beside = entries(place).unwrap_or_default();
    let above = place.parent().map(|p| entries(p).unwrap_or_default()).unwrap_or_default();
    let mut candidates: Vec<PathBuf> = files.iter().filter(tables).cloned().collect();
    if place != folder {
        candidates.extend(beside.iter().chain(&above).filter(tables).filter(|p| p.is_file()).cloned());
    }
    candidates.retain(|p| p.parent() == Some(folder) && !trajectories.iter().any(|(t, _)| t == p));
    let lists: Vec<List> = candidates.iter().filter_map(|p| List::read(p).ok()).collect();
    let names_one = |list: &&List| {
        let named = list.rows.iter().take(100).filter_map(|r| r.file.as_deref());
        named.into_iter().any(|file| there.iter().any(|p| p.ends_with(file)))
    };
    let times = |list: &&List| {
        let stem = stem(&list.path).to_ascii_lowercase();
        list.rows.iter().all(|r| r.file.is_none())
            && list.rows.len() == there.len()
            && ["time", "stamp"].iter().any(|w| stem.contains(w))
    };
    lists.iter().find(names_one).or_else(|| lists.iter().find(times)).map(|list| list.path.clone())
}

/// The unit of the numbers in the names, where they can be stamps: today's epoch, or fractions of seconds.
pub(super) fn unit_of(there: &[PathBuf]) -> Option<Unit> {
    let stems: Vec<String> = there.iter().map(|p| stem(p)).collect();
    let numbers: Vec<&str> = stems.iter().map(|s| number_in(s)).collect::<Option<_>>()?;
    let fraction = numbers.iter().any(|n| n.contains('.'));
    let unit = if fraction {
        Unit::Seconds
    } else {
        // A stamp of today's epoch has so many digits.
        let digits = numbers.iter().map(|n| n.trim_start_matches('0').len()).max()?;
        let today = numbers.iter().all(|n| n.trim_start_matches('0').len() == digits);
        match digits {
            10 if today => Unit::Seconds,
            13 if today => Unit::Milliseconds,
            16 if today => Unit::Microseconds,
            19 if today => Unit::Nanoseconds,
            // Nanoseconds from the start of a simulation: too large to count pictures.
            8..=18 => Unit::Nanoseconds,
            _ => return None,
        }
    };
    let mut stamps: Vec<Stamp> = numbers.iter().map(|n| unit.parse(n).ok()).collect::<Option<_>>()?;
    stamps.sort();
    stamps.windows(2).all(|w| w[0] < w[1]).then_some(unit)
}
