//! One's own folder: `vice.toml` with a table `[images]`, which `vice init` writes.
//!
//! ```toml
//! [images]
//! imu = "imu.csv"                   # in the body frame
//!
//! [images.cameras.cam0]
//! folder = "rgb"                    # of PNG or JPEG
//! names = "nanoseconds"             # the number in the names is the stamp; or:
//! # list = "rgb.txt"                # stamps, and mostly files; or:
//! # fps = 30.0                      # the pictures are counted, the first of them at start_s
//! # start_s = "1600000000.0"
//! depth = "depth"                   # 16-bit PNG, registered to the camera
//! depth_scale = 1000.0              # counts a metre
//! ```
//!
//! Calibration, pose streams, cloud and floor stand outside of the table: they are the same for every format.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use vice_core::dataset::Floor;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::time::Stamp;
use vice_files::rigid_file::from_toml;
use vice_files::{imu_file, paths, vice_toml};

use super::Layout;
use crate::calibration;
use crate::files::{natural, pictures};
use crate::list::List;
use crate::parts::{CameraPart, DepthPart, Description, Frames, Place, Read, Samples};
use crate::settings::Settings;
use crate::stamps::{self, Unit};

pub(crate) const LAYOUT: Layout = Layout { name: "described by vice.toml", is, describe };

/// Counts a metre where nothing says: millimetres.
pub(crate) const DEPTH_COUNTS: f64 = 1000.0;

#[derive(Deserialize)]
struct File {
    images: Option<ImagesTable>,
    up: Option<String>,
    floor: Option<[f64; 4]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ImagesTable {
    imu: Option<String>,
    cameras: BTreeMap<String, CameraTable>,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraTable {
    folder: String,
    names: Option<Unit>,
    list: Option<String>,
    fps: Option<f64>,
    start_s: Option<Start>,
    depth: Option<String>,
    depth_list: Option<String>,
    depth_scale: Option<f64>,
}

#[derive(Clone, Deserialize)]
#[serde(untagged)]
enum Start {
    Text(String),
    Whole(i64),
    Number(f64),
}

impl Start {
    fn stamp(&self) -> Result<Stamp, String> {
        let text = match self {
            Self::Text(text) => text.clone(),
            Self::Whole(v) => v.to_string(),
            Self::Number(v) => v.to_string(),
        };
        Stamp::parse_seconds(&text).map_err(|e| e.to_string())
    }
}

fn is(folder: &Path) -> bool {
    let path = folder.join(vice_toml::FILE);
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.lines().any(|line| {
        let line = line.trim_start();
        line.starts_with("[images]") || line.starts_with("[images.")
    })
}

fn describe(folder: &Path, settings: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    let path = folder.join(vice_toml::FILE);
    let text =
        std::fs::read_to_string(&path).map_err(|e| DataError::new("cannot be read").at(&path).because(e))?;
    let file: File = from_toml(&text).map_err(|e| e.at(&path))?;
    let table = file.images.ok_or_else(|| DataError::new("has no table [images]").at(&path))?;
    let mut cameras: Vec<(String, CameraTable)> = table.cameras.into_iter().collect();
    cameras.sort_by(|a, b| natural(&a.0, &b.0));
    if cameras.is_empty() {
        return Err(DataError::of_kind(ErrorKind::Missing, "names no camera")
            .at(&path)
            .hint("[images.cameras.cam0] describes one"));
    }
    for (name, camera) in cameras {
        let part = camera_part(folder, &name, &camera, settings);
        found.cameras.push(part.map_err(|e| {
            DataError::of_kind(e.kind(), format!("[images.cameras.{name}]: {}", e.problem()))
                .hint(e.hint_text().unwrap_or_default().to_string())
                .at(&path)
        })?);
    }
    if let Some(imu) = table.imu {
        let imu = paths::safe_join(folder, &imu)
            .map_err(|e| DataError::new(format!("imu: {}", e.problem())).at(&path))?;
        found.imu = Some(Box::new(move || {
            let file = imu_file::read(&imu)?;
            Ok(Samples { samples: file.samples.into(), suspicions: file.suspicions.into_iter().collect() })
        }));
    }
    // z = 0 is a floor only where somebody says which way is up.
    if file.up.is_none() && file.floor.is_none() {
        found.floor = Floor::Unknown;
    }
    Ok(found)
}

fn camera_part(
    folder: &Path,
    name: &str,
    table: &CameraTable,
    settings: &Settings,
) -> DataResult<CameraPart> {
    let below = |file: &str| paths::safe_join(folder, file);
    let inside =
        if matches!(table.folder.as_str(), "." | "") { folder.to_path_buf() } else { below(&table.folder)? };
    if !inside.is_dir() {
        return Err(DataError::of_kind(
            ErrorKind::Missing,
            format!("there is no folder {}", inside.display()),
        ));
    }
    let ways =
        [table.names.is_some(), table.list.is_some(), table.fps.is_some()].iter().filter(|w| **w).count();
    if ways > 1 {
        return Err(DataError::of_kind(
            ErrorKind::Contradictory,
            "of names, list and fps more than one is given",
        )
        .hint("the stamps come from one of them"));
    }
    if table.start_s.is_some() && (table.names.is_some() || table.list.is_some()) {
        return Err(DataError::of_kind(
            ErrorKind::Contradictory,
            "start_s is of counted pictures, and these have stamps",
        ));
    }
    let start = match &table.start_s {
        Some(start) => start.stamp().map_err(|e| DataError::new(format!("start_s: {e}")))?,
        None => Stamp::default(),
    };
    let list = table.list.as_deref().map(below).transpose()?;
    // Somebody who sets a rate knows better than the file.
    let fps = if table.names.is_none() && list.is_none() { settings.fps().or(table.fps) } else { None };
    let when = When { names: table.names, list, fps, start };
    if when.names.is_none() && when.list.is_none() && when.fps.is_none() {
        return Err(DataError::of_kind(ErrorKind::Missing, "nothing says when its pictures were taken")
            .hint("fill in fps there, or give --set fps=...; else a list of stamps (`list`)"));
    }
    let depth = match &table.depth {
        Some(depth) => {
            let from = if table.depth_scale.is_some() { "vice.toml" } else { "taken for granted" };
            let (metres_per_count, from) =
                settings.metres_per_count(table.depth_scale.unwrap_or(DEPTH_COUNTS), from);
            if !(metres_per_count.is_finite() && metres_per_count > 0.0) {
                return Err(DataError::new("depth_scale is not positive"));
            }
            let depth = below(depth)?;
            let list = table.depth_list.as_deref().map(below).transpose()?;
            Some(DepthPart {
                frames: depth_frames(folder, &depth, list, (&inside, &when)),
                metres_per_count,
                invalid: None,
                from,
            })
        }
        None if table.depth_scale.is_some() || table.depth_list.is_some() => {
            return Err(DataError::of_kind(
                ErrorKind::Contradictory,
                "depth_scale and depth_list are of depth images, and none are named",
            ));
        }
        None => None,
    };
    let own = folder.to_path_buf();
    let shown = name.to_string();
    Ok(CameraPart {
        name: name.to_string(),
        frames: frames(folder, &inside, &when),
        intrinsics: Box::new(move || {
            Err(calibration::missing(
                &own,
                &format!("of {shown}: name a file with `calibration` in vice.toml, or give --calibration"),
            ))
        }),
        place: Place::body(),
        depth,
    })
}

/// When the pictures of a folder were taken.
#[derive(Clone)]
struct When {
    names: Option<Unit>,
    list: Option<PathBuf>,
    fps: Option<f64>,
    start: Stamp,
}

fn frames(folder: &Path, inside: &Path, when: &When) -> Read<Frames> {
    let (folder, inside, when) = (folder.to_path_buf(), inside.to_path_buf(), when.clone());
    Box::new(move || {
        let there = pictures(&inside)?;
        match (&when.list, when.names, when.fps) {
            (Some(list), _, _) => {
                let roots = [inside.as_path(), folder.as_path(), list.parent().unwrap_or(&folder)];
                stamps::by_list(&List::read(list)?, &roots, &there)
            }
            (None, Some(unit), _) => stamps::by_names(&inside, there, unit),
            (None, None, Some(fps)) => stamps::by_index(&inside, there, fps, when.start),
            (None, None, None) => {
                Err(DataError::new("nothing says when the pictures were taken").at(&inside))
            }
        }
    })
}

/// Depth images by a list of their own, else as the pictures; where pictures are counted by a list without names, or have
/// no stamps in theirs, the n-th depth image is of the n-th picture.
fn depth_frames(
    folder: &Path,
    depth: &Path,
    list: Option<PathBuf>,
    (inside, when): (&Path, &When),
) -> Read<Frames> {
    if list.is_some() {
        return frames(folder, depth, &When { list, names: None, fps: None, start: Stamp::default() });
    }
    if when.list.is_none() {
        return frames(folder, depth, when);
    }
    let (colour, depth) = (frames(folder, inside, when), depth.to_path_buf());
    Box::new(move || {
        let (colour, there) = (colour()?, pictures(&depth)?);
        // By the name where the names are the same, else one after the other.
        let by_name: BTreeMap<String, &PathBuf> = there.iter().map(|p| (crate::files::stem(p), p)).collect();
        let same = colour.files.iter().zip(colour.stamps.iter());
        let same: Vec<(Stamp, PathBuf)> = same
            .filter_map(|(f, s)| by_name.get(&crate::files::stem(f)).map(|d| (*s, (*d).clone())))
            .collect();
        if !same.is_empty() {
            return stamps::in_order(&depth, same, Vec::new());
        }
        if there.len() != colour.files.len() {
            return Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!(
                    "{} depth images for {} pictures, and no names that are the same",
                    there.len(),
                    colour.files.len()
                ),
            )
            .at(&depth)
            .hint("`depth_list` in vice.toml names a list of stamps and files"));
        }
        let paired = colour.stamps.iter().copied().zip(there).collect();
        stamps::in_order(&depth, paired, Vec::new())
    })
}
