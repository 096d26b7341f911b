//! A manifest of all data sets below a folder.

use std::path::{Path, PathBuf};

use vice_core::dataset::Probe;
use vice_core::error::DataError;
use vice_core::registry::Registry;

use crate::error::RunResult;
use crate::formats;
use crate::report::csv::finished;
use crate::request::{DatasetSpec, IMU_EULER, PluginsSpec};

/// Folders inside of folders that are looked into.
const DEEPEST: usize = 8;

/// A data set that was found.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Found {
    path: PathBuf,
    format: String,
}

/// A manifest as CSV of all data sets below a folder, sorted by path: with the first labels file that lies in each, and
/// its streams as estimates. Paths are relative to `base`, the folder that the manifest will be in, where they lie below
/// it.
///
/// # Errors
/// [`RunError`](crate::error::RunError) if the folder cannot be read or a plugin does not load.
pub fn scan(folder: &Path, base: &Path) -> RunResult<String> {
    if !folder.is_dir() {
        return Err(DataError::of_kind(vice_core::error::ErrorKind::Missing, "no such folder")
            .at(folder)
            .into());
    }
    let registry = formats::registry(&PluginsSpec::default())?;
    let mut found = Vec::new();
    walk(folder, &registry, DEEPEST, &mut found);
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found.dedup();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(["run_id", "group", "dataset", "labels", "estimate"])?;
    for one in &found {
        let name = one.path.strip_prefix(folder).unwrap_or(&one.path).display().to_string();
        let name = if name.is_empty() { file_name(folder) } else { name };
        let labels = labels_in(&one.path).map_or_else(String::new, |p| shown(&p, base));
        let record = [name, one.format.clone(), shown(&one.path, base), labels, estimates(one, &registry)];
        writer.write_record(record)?;
    }
    finished(writer)
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| "run".to_string(), |n| n.to_string_lossy().into_owned())
}

fn shown(path: &Path, base: &Path) -> String {
    path.strip_prefix(base).unwrap_or(path).display().to_string()
}

/// What is a data set is not looked into.
fn walk(path: &Path, registry: &Registry, deepest: usize, found: &mut Vec<Found>) {
    match registry.detect(path) {
        Ok((factory, Probe::Yes)) => {
            found.push(Found { path: path.to_path_buf(), format: factory.info().name });
        }
        Ok((factory, Probe::Collection(paths))) => {
            let format = factory.info().name;
            found.extend(paths.into_iter().map(|path| Found { path, format: format.clone() }));
        }
        _ if deepest > 0 && path.is_dir() => {
            for child in children(path) {
                walk(&child, registry, deepest - 1, found);
            }
        }
        _ => {}
    }
}

fn children(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries
        .filter(|e| !e.file_name().to_string_lossy().starts_with('.'))
        .filter(|e| e.path().symlink_metadata().is_ok_and(|m| !m.is_symlink()))
        .map(|e| e.path())
        .collect();
    paths.sort();
    paths
}

/// `labels.json`, `labels.csv`, or the first in a folder `labels`.
fn labels_in(dataset: &Path) -> Option<PathBuf> {
    let is_labels = |p: &PathBuf| p.extension().is_some_and(|e| e == "json" || e == "csv");
    let beside = ["labels.json", "labels.csv"].map(|name| dataset.join(name));
    let first = beside.into_iter().find(|p| p.is_file());
    first.or_else(|| children(&dataset.join("labels")).into_iter().find(is_labels))
}

/// All streams but the ground truth; else the integration of the IMU.
fn estimates(found: &Found, registry: &Registry) -> String {
    let spec = DatasetSpec {
        path: found.path.clone(),
        format: Some(found.format.clone()),
        ..DatasetSpec::default()
    };
    let streams = spec.open_raw(registry).map(|d| d.streams()).unwrap_or_default();
    let names: Vec<String> = streams.into_iter().filter(|s| s != vice_core::dataset::GROUND_TRUTH).collect();
    if names.is_empty() { IMU_EULER.to_string() } else { names.join(",") }
}
