//! Lists of image files: `data.csv` of a camera.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;
use vice_files::{paths, rows};

/// Stamps before 1971: beside a sensor at today's epoch these are in a coarser unit than nanoseconds.
const PLAUSIBLE_SINCE_NS: i64 = 31_536_000_000_000_000;

/// The frames of a camera, by stamp.
#[derive(Debug)]
pub(crate) struct Listing {
    /// Strictly increasing.
    pub(crate) stamps: Arc<[Stamp]>,
    names: Vec<String>,
    folder: PathBuf,
}

impl Listing {
    /// Reads `data.csv` in a sensor's folder. No image is opened.
    pub(crate) fn read(sensor: &Path) -> DataResult<Self> {
        let path = sensor.join("data.csv");
        Self::read_file(sensor, &path).map_err(|e| e.at(&path))
    }

    fn read_file(sensor: &Path, path: &Path) -> DataResult<Self> {
        let folder = sensor.join("data");
        let links = links_in(&folder);
        let mut rows = rows::open(path)?;
        let (mut stamps, mut names): (Vec<Stamp>, Vec<String>) = (Vec::new(), Vec::new());
        while let Some(row) = rows.next_row()? {
            row.expect_columns(2)?;
            let stamp = row.nanos(0)?;
            check_order(stamps.last().copied(), stamp).map_err(|e| e.line(row.line()))?;
            let name = row.field(1).unwrap_or_default();
            paths::check_relative(name).map_err(|e| e.line(row.line()))?;
            // Only links can lead elsewhere; looking at every image of a long flight would be slow on a network disk.
            if name.contains(['/', '\\']) || links.contains(name) {
                paths::safe_join(&folder, name).map_err(|e| DataError::new(e.problem()).line(row.line()))?;
            }
            stamps.push(stamp);
            names.push(name.to_string());
        }
        if stamps.is_empty() {
            return Err(DataError::new("the list holds no frames"));
        }
        Ok(Self { stamps: stamps.into(), names, folder })
    }

    /// Path of an image; it is checked again, since files may have changed.
    pub(crate) fn path(&self, index: usize) -> DataResult<PathBuf> {
        let name = self.names.get(index).ok_or_else(|| {
            DataError::new(format!("frame {index} does not exist: there are {}", self.names.len()))
                .at(&self.folder)
        })?;
        paths::safe_join(&self.folder, name)
    }
}

/// Checks that stamps of a list strictly increase.
pub(crate) fn check_order(previous: Option<Stamp>, stamp: Stamp) -> DataResult<()> {
    match previous {
        Some(previous) if stamp == previous => Err(DataError::new(format!("stamp {stamp} ns appears twice"))),
        Some(previous) if stamp < previous => {
            Err(DataError::new(format!("stamp {stamp} ns is earlier than the one before, {previous} ns")))
        }
        _ => Ok(()),
    }
}

/// Checks that two sensors have their stamps in the same unit; the one with the smaller stamps is named.
///
/// Times that count from zero are fine, as long as both do.
pub(crate) fn check_unit(a: (&Path, (Stamp, Stamp)), b: (&Path, (Stamp, Stamp))) -> DataResult<()> {
    let coarse = |range: (Stamp, Stamp)| range.1.as_nanos() < PLAUSIBLE_SINCE_NS;
    let (suspect, other) = match (coarse(a.1), coarse(b.1)) {
        (true, false) => (a, b),
        (false, true) => (b, a),
        _ => return Ok(()),
    };
    let error = vice_core::time_unit::unit_mixup(other.1, suspect.1).unwrap_or_else(|| {
        let ((from, to), (other_from, other_to)) = (suspect.1, other.1);
        DataError::new(format!(
            "the stamps run from {from} to {to} ns, where {other_from} to {other_to} ns is expected"
        ))
    });
    Err(error.at(suspect.0).hint(format!("compared with {}", other.0.display())))
}

/// Names in a folder that are symbolic links. A folder that cannot be read has none: opening an image will say so.
fn links_in(folder: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    entries
        .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_symlink()))
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect()
}
