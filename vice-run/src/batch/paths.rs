//! Paths of a manifest, which are relative to it, as paths that can be opened.

use std::path::{Path, PathBuf};

use vice_files::address::is_address;

use crate::request::{EstimateFrame, EstimateSpec, ReferenceSpec, Request, is_auto};

/// The request with paths from where the program runs. A name that may be a stream or a file is a file where there is
/// one beside the manifest.
pub(super) fn resolved(request: &Request, base: &Path) -> Request {
    let mut request = request.clone();
    let join = |path: &mut PathBuf| {
        if !path.as_os_str().is_empty() && !is_address(&*path) {
            *path = base.join(&*path);
        }
    };
    join(&mut request.dataset.path);
    if !is_auto(&request.labels.file) {
        join(&mut request.labels.file);
    }
    request.labels.noise.iter_mut().for_each(join);
    let own = &mut request.dataset;
    [&mut own.calibration, &mut own.cloud, &mut own.mesh, &mut own.world_from_cloud]
        .into_iter()
        .flatten()
        .for_each(join);
    request.dataset.plugins.files.iter_mut().for_each(join);
    request.streams.times.iter_mut().for_each(join);
    if let EstimateFrame::File(file) = &mut request.streams.estimate_frame {
        join(file);
    }
    for value in request.dataset.set.values_mut() {
        *value = if_file(base, value);
    }
    let estimate = |spec: &mut EstimateSpec| match spec {
        EstimateSpec::Named(name) => *name = if_file(base, name),
        EstimateSpec::Relative(path) => join(path),
        EstimateSpec::ImuEuler => {}
    };
    request.streams.estimates.iter_mut().for_each(estimate);
    if let ReferenceSpec::Named(spec) = &mut request.streams.reference {
        estimate(spec);
    }
    request
}

fn if_file(base: &Path, name: &str) -> String {
    let path = base.join(name);
    if !name.is_empty() && path.is_file() { path.to_string_lossy().into_owned() } else { name.to_string() }
}

/// All that is read beside the data set.
pub(super) fn files(resolved: &Request) -> Vec<PathBuf> {
    let mut files = resolved.inputs();
    files.extend(resolved.dataset.plugins.files.iter().cloned());
    files.extend(resolved.dataset.set.values().map(PathBuf::from).filter(|p| is_address(p) || p.is_file()));
    files.retain(|f| *f != resolved.dataset.path);
    files
}
