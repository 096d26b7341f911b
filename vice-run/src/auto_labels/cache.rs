//! Automatic labels that were made before, in the user's cache folder.
//!
//! A file is named by all that the labels depend on: the request for them, the version of the tracker, the camera, the
//! stamps of the frames, pictures and depth images at a few of them, and the poses that place the camera. What cannot be
//! read is made anew; where nothing can be written that is said, and all goes on.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use vice_core::error::one_line;
use vice_core::label::LabelSet;
use vice_core::suspicion::Suspicions;
use vice_files::atomic::{Overwrite, write};
use vice_files::labels;
use vice_track::TRACKER_VERSION;

use super::{Tracked, TrackingSpec};
use crate::error::RunResult;
use crate::progress::Progress;
use crate::scene::Scene;
use crate::text::hex;
use crate::tracking_summary::TrackingSummary;

/// The cache folder, in place of the user's.
const CACHE: &str = "VICE_CACHE";
const SCHEMA: &str = "vice.auto-labels/2";
/// Pictures that stand for all of them.
const SAMPLED: usize = 5;

/// Labels as they are kept.
#[derive(Serialize, Deserialize)]
struct Kept {
    schema: String,
    labels: serde_json::Value,
    summary: TrackingSummary,
    suspicions: Suspicions,
}

/// Labels, how they came about, and what should be known of them.
pub(crate) struct Remembered {
    pub(crate) labels: LabelSet,
    pub(crate) summary: TrackingSummary,
    pub(crate) suspicions: Suspicions,
}

/// The labels of a recording, from the cache where they are there.
///
/// # Errors
/// [`crate::error::RunError`] if they have to be made and cannot be.
pub(crate) fn labels_of(
    spec: &TrackingSpec,
    scene: &Scene,
    progress: &Progress<'_>,
) -> RunResult<Remembered> {
    let file = folder().and_then(|folder| Some(folder.join(name(spec, scene)?)));
    if let Some(kept) = file.as_ref().and_then(|file| std::fs::read(file).ok())
        && let Some(remembered) = read(&kept)
    {
        return Ok(remembered);
    }
    let tracked = spec.run_on(scene, progress)?;
    let bytes = bytes(&tracked)?;
    match &file {
        Some(file) => {
            let made = file.parent().map_or(Ok(()), std::fs::create_dir_all);
            let written = made.map_err(|e| e.to_string()).and_then(|()| {
                write(file, Overwrite::Replace, |w| w.write_all(&bytes)).map_err(|e| one_line(&e))
            });
            if let Err(reason) = written {
                tracing::warn!("the automatic labels are not kept for the next time: {reason}");
            }
        }
        None => {
            tracing::warn!("the automatic labels are not kept for the next time: name a folder in {CACHE}")
        }
    }
    // As they are read the next time, to the last bit.
    match read(&bytes) {
        Some(remembered) => Ok(remembered),
        None => Ok(Remembered {
            summary: tracked.summary(),
            labels: tracked.labels,
            suspicions: tracked.suspicions,
        }),
    }
}

fn bytes(tracked: &Tracked) -> RunResult<Vec<u8>> {
    let mut text = Vec::new();
    labels::write_json(&mut text, &tracked.labels)?;
    let kept = Kept {
        schema: SCHEMA.to_string(),
        labels: serde_json::from_slice(&text)?,
        summary: tracked.summary(),
        suspicions: tracked.suspicions.clone(),
    };
    Ok(serde_json::to_vec(&kept)?)
}

fn read(bytes: &[u8]) -> Option<Remembered> {
    let kept: Kept = serde_json::from_slice(bytes).ok().filter(|k: &Kept| k.schema == SCHEMA)?;
    let labels = labels::read_json(&serde_json::to_vec(&kept.labels).ok()?).ok()?;
    Some(Remembered { labels, summary: kept.summary, suspicions: kept.suspicions })
}

fn folder() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os(CACHE).filter(|f| !f.is_empty()) {
        return Some(PathBuf::from(folder).join("labels"));
    }
    directories::ProjectDirs::from("", "", "vice").map(|dirs| dirs.cache_dir().join("labels"))
}

/// The file's name: what it is of, for people, and the hash of all that it depends on; `None` where that cannot be read.
fn name(spec: &TrackingSpec, scene: &Scene) -> Option<String> {
    let opened = &scene.opened;
    let mut hasher = Sha256::new();
    let mut add = |text: &str| {
        hasher.update((text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    };
    add(SCHEMA);
    add(env!("CARGO_PKG_VERSION"));
    add(TRACKER_VERSION);
    let own = TrackingSpec { dataset: Default::default(), ..spec.clone() };
    add(&serde_json::to_string(&own).ok()?);
    add(&format!("{} {} {}", opened.dataset.name(), opened.dataset.format(), opened.camera_name));
    add(&format!(
        "{:?} {:?} {:?}",
        opened.camera.fx_fy_cx_cy(),
        opened.camera.model(),
        spec.dataset.floor_plane
    ));
    add(&opened.frames.iter().map(|s| s.as_nanos().to_string()).collect::<Vec<_>>().join(" "));
    let cloud = opened.dataset.cloud().ok()?;
    add(&format!("{:?}", cloud.as_ref().map(|c| (c.world_from_cloud, scan(c)))));
    if let Some(anchor) = &scene.anchor {
        anchor.iter().for_each(|(stamp, pose)| add(&format!("{stamp} {:?}", pose.to_row_major())));
    }
    let chosen = spec.protocol.frames(opened).ok()?;
    for k in 0..SAMPLED {
        let frame = *chosen.get(k * (chosen.len() - 1) / (SAMPLED - 1))?;
        if let Ok(image) = opened.dataset.image(&opened.camera_name, frame) {
            add(&format!("{} {} {}", image.width(), image.height(), hex(&Sha256::digest(image.data()))));
        }
        if let Ok(Some(depth)) = opened.dataset.depth_image(&opened.camera_name, frame) {
            let values: Vec<u8> = depth.z_m().iter().flat_map(|z| z.to_le_bytes()).collect();
            add(&hex(&Sha256::digest(values)));
        }
    }
    let hash = hex(&hasher.finalize());
    let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_') { c } else { '_' };
    let what: String =
        format!("{}-{}", opened.dataset.name(), opened.camera_name).chars().map(plain).take(60).collect();
    Some(format!("{what}-{}.json", &hash[..24]))
}

/// What tells a scan from another one without reading it.
fn scan(cloud: &vice_core::dataset::CloudRef) -> String {
    use vice_core::dataset::CloudSource;
    match &cloud.source {
        CloudSource::File(path) => {
            let meta = std::fs::metadata(path).ok();
            let time = meta.as_ref().and_then(|m| m.modified().ok());
            format!("{} {:?} {:?}", path.display(), meta.as_ref().map(std::fs::Metadata::len), time)
        }
        CloudSource::Points(points) => {
            let bytes: Vec<u8> =
                points.iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(f32::to_le_bytes).collect();
            hex(&Sha256::digest(bytes))
        }
        _ => String::new(),
    }
}
