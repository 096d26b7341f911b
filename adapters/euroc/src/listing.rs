//! Lists of image files: `data.csv` of a camera.

use std::collections::{BTreeSet, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use vice_core::error::{DataError, DataResult};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_files::columns::{Quantity, TimeUnit};
use vice_files::heading::{Heading, TimeColumn};
use vice_files::rows::Beginning;
use vice_files::{image_file, paths, rows};

/// Stamps before 1971: beside a sensor at today's epoch these are in a coarser unit than nanoseconds.
const PLAUSIBLE_SINCE_NS: i64 = 31_536_000_000_000_000;

/// Pictures that are looked for, at most, to see how large they are.
const MOST_LOOKED_AT: usize = 100;

/// The frames of a camera, by stamp.
#[derive(Debug)]
pub(crate) struct Listing {
    /// Strictly increasing.
    pub(crate) stamps: Arc<[Stamp]>,
    names: Vec<String>,
    folder: PathBuf,
    /// Pictures that are not there.
    pub(crate) suspicion: Option<Suspicion>,
}

impl Listing {
    /// Reads `data.csv` in a sensor's folder. No image is opened.
    pub(crate) fn read(sensor: &Path) -> DataResult<Self> {
        let path = sensor.join("data.csv");
        Self::read_file(sensor, &path).map_err(|e| e.at(&path))
    }

    fn read_file(sensor: &Path, path: &Path) -> DataResult<Self> {
        let folder = sensor.join("data");
        let there = Pictures::in_folder(&folder);
        let mut rows = rows::open(path)?;
        let beginning = rows.begin()?;
        let mut columns = Columns::find(&beginning)?;
        let (mut stamps, mut names): (Vec<Stamp>, Vec<String>) = (Vec::new(), Vec::new());
        let (mut missing, mut first_missing) = (0_u64, None);
        while let Some(row) = rows.next_row()? {
            row.expect_columns(2)?;
            let stamp = columns.time.stamp(&row)?;
            check_order(stamps.last().copied(), stamp).map_err(|e| e.line(row.line()))?;
            let name = row.field(columns.name).unwrap_or_default();
            paths::check_relative(name).map_err(|e| e.line(row.line()))?;
            // Only links can lead elsewhere; looking at every image of a long flight would be slow on a network disk.
            let below = name.contains(['/', '\\']);
            if below || there.links.contains(name) {
                paths::safe_join(&folder, name).map_err(|e| DataError::new(e.problem()).line(row.line()))?;
            }
            if !below && !there.names.contains(name) {
                missing += 1;
                first_missing.get_or_insert_with(|| name.to_string());
            }
            stamps.push(stamp);
            names.push(name.to_string());
        }
        if stamps.is_empty() {
            return Err(DataError::new("the list holds no frames"));
        }
        // Where no picture is there at all, the pictures were left at home: labels need their stamps only.
        let some_missing = missing > 0 && missing < names.len() as u64;
        let suspicion = some_missing.then(|| {
            Suspicion::new(
                "pictures-missing",
                path.display().to_string(),
                "pictures that the list names are not there",
            )
            .evidence(format!(
                "{missing} of {}, the first is {}; their stamps are used all the same",
                names.len(),
                first_missing.unwrap_or_default()
            ))
        });
        Ok(Self { stamps: stamps.into(), names, folder, suspicion })
    }

    /// Size of the first picture that is there, and its path; `None` where there is none.
    pub(crate) fn first_picture(&self) -> Option<(PathBuf, (u32, u32))> {
        // One that is missing is mostly one of many: looking for it at all of them would be slow.
        let few = self.names.iter().take(MOST_LOOKED_AT);
        few.filter_map(|name| paths::safe_join(&self.folder, name).ok())
            .find_map(|path| image_file::dimensions(&path).ok().map(|size| (path, size)))
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
            "the stamps run from {from} to {to} ns, where {other_from} to {other_to} ns is expected: they count from \
             their own start, the others from 1970"
        ))
    });
    Err(error.at(suspect.0).hint(format!("compared with {}", other.0.display())))
}

/// Names in a folder. One that cannot be read has none: opening an image will say so.
#[derive(Default)]
struct Pictures {
    names: HashSet<String>,
    links: BTreeSet<String>,
}

impl Pictures {
    fn in_folder(folder: &Path) -> Self {
        let mut found = Self::default();
        for entry in std::fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok) {
            let name = entry.file_name().to_string_lossy().into_owned();
            if entry.file_type().is_ok_and(|kind| kind.is_symlink()) {
                found.links.insert(name.clone());
            }
            found.names.insert(name);
        }
        found
    }
}

/// Where a list has its stamps and names of files.
struct Columns {
    time: TimeColumn,
    name: usize,
}

impl Columns {
    fn find(beginning: &Beginning) -> DataResult<Self> {
        let by_place = Self { time: TimeColumn::new(0, Some(TimeUnit::Nanos)), name: 1 };
        let named = |heading: &Heading| -> DataResult<Option<Self>> {
            let (Some(time), Some(name)) = (heading.time()?, heading.column(Quantity::File, None)?) else {
                return Ok(None);
            };
            heading.check_width(beginning.columns, time.columns().chain([name]))?;
            Ok(Some(Self { time: time.small_in(TimeUnit::Nanos), name }))
        };
        if let Some(heading) = &beginning.heading {
            if heading.times().is_empty() {
                // Not a heading, then: a first row that is broken.
                let first = heading.names().first().map_or("", |n| n.text.as_str());
                return Err(
                    DataError::new(format!("column 1: `{first}` is no time stamp")).line(heading.line())
                );
            }
            if beginning.columns == 0 {
                return Ok(by_place);
            }
            return Ok(named(heading)?.unwrap_or(by_place));
        }
        let of_comment = beginning.comments.iter().filter(|h| h.names().len() == beginning.columns);
        Ok(of_comment.map(named).find_map(Result::transpose).transpose()?.unwrap_or(by_place))
    }
}
