//! Documents of `vice.result/1`, which held settings as text in place of the request.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;
use vice_core::evaluate::Observations;
use vice_core::result::{DatasetPart, PathPart, PixelPart, Role, TrajectoryPart};
use vice_core::suspicion::Suspicions;
use vice_core::time::Span;

use super::{ResultDocument, SCHEMA, Used};
use crate::request::{
    Anchor, DatasetSpec, DepthSpec, EstimateFrame, EstimateSpec, LabelsSpec, Protocol, ReferenceSpec,
    Request, Scoring, StreamsSpec,
};

#[derive(Deserialize)]
pub(super) struct Document {
    #[serde(default)]
    vice_version: String,
    dataset: DatasetPart,
    settings: Settings,
    pixel: Vec<PixelPart>,
    trajectory: Vec<TrajectoryPart>,
    #[serde(default)]
    paths: Vec<PathPart>,
    #[serde(default)]
    suspicions: Suspicions,
}

#[derive(Deserialize)]
struct Settings {
    #[serde(default)]
    dataset: Option<String>,
    labels: String,
    points: Vec<String>,
    fps: Option<f64>,
    start_s: f64,
    duration_s: Option<f64>,
    max_gap_s: f64,
    time_offset_s: f64,
    align: String,
    anchor: String,
    calibration: Option<PathBuf>,
    floor_plane: Option<[f64; 4]>,
    zmap_occlusion: bool,
    estimate_frame: String,
    #[serde(default)]
    other: BTreeMap<String, String>,
}

impl From<Document> for ResultDocument {
    fn from(old: Document) -> Self {
        let used = Used {
            points: old.settings.points.clone(),
            anchor: old.settings.anchor.clone(),
            time_offset_s: old.settings.time_offset_s,
            align: old.settings.align.clone(),
            label_noise_px: None,
            tracking: None,
        };
        Self {
            schema: SCHEMA.to_string(),
            vice_version: old.vice_version,
            request: request(&old.settings, &old.dataset, &old.pixel),
            used,
            dataset: old.dataset,
            pixel: old.pixel,
            trajectory: old.trajectory,
            paths: old.paths,
            suspicions: old.suspicions,
        }
    }
}

/// What was asked for, as far as the settings tell.
fn request(s: &Settings, dataset: &DatasetPart, pixel: &[PixelPart]) -> Request {
    let other = |key: &str| s.other.get(key).map(String::as_str);
    let list = |key: &str| -> Vec<String> {
        other(key).map_or_else(Vec::new, |text| text.split(',').map(str::to_string).collect())
    };
    let numbers = |key: &str| -> Vec<f64> { list(key).iter().filter_map(|v| v.parse().ok()).collect() };
    let span = |seconds: f64| Span::from_secs_f64(seconds).unwrap_or(Span::ZERO);
    let set = |(key, value): (&String, &String)| Some((key.strip_prefix("set ")?.to_string(), value.clone()));
    let mut sources = Vec::new();
    for name in pixel.iter().filter_map(|p| p.depth.parse().ok()) {
        if !sources.contains(&name) {
            sources.push(name);
        }
    }
    let has_reference = pixel.iter().any(|p| p.role == Role::Reference);
    let estimates = list("estimate").len();
    let anchored_on_estimate = pixel.iter().any(|p| p.stream == s.anchor && p.role == Role::Estimate);
    Request {
        dataset: DatasetSpec {
            path: PathBuf::from(s.dataset.clone().unwrap_or_default()),
            format: Some(dataset.format.clone()),
            set: s.other.iter().filter_map(set).collect(),
            camera: Some(dataset.camera.clone()),
            calibration: s.calibration.clone(),
            floor_plane: s.floor_plane,
            ..DatasetSpec::default()
        },
        labels: LabelsSpec {
            file: PathBuf::from(&s.labels),
            points: list("points"),
            // What was the default then.
            observations: other("observations").and_then(|o| o.parse().ok()).unwrap_or(Observations::All),
            noise: None,
        },
        protocol: Protocol { fps: s.fps, start: span(s.start_s), duration: s.duration_s.map(span) },
        streams: StreamsSpec {
            names: Vec::new(),
            estimates: list("estimate").into_iter().map(EstimateSpec::from).collect(),
            reference: ReferenceSpec::from(other("reference").map(str::to_string)),
            estimate_frame: EstimateFrame::from(s.estimate_frame.clone()),
            estimate_as: Vec::new(),
            times: other("times").map(PathBuf::from),
            time_offset: (s.time_offset_s != 0.0).then(|| span(s.time_offset_s)),
            max_gap: span(s.max_gap_s),
            // Without a reference the first estimate was the anchor of all.
            anchor: (anchored_on_estimate && (has_reference || estimates > 1)).then_some(Anchor::Estimate),
            initial_pose: <[f64; 7]>::try_from(numbers("initial-pose")).ok(),
        },
        depth: DepthSpec {
            sources,
            zmap_occlusion: (!s.zmap_occlusion).then_some(false),
            zmap_interpolation: None,
            cloud_voxel_m: other("cloud-voxel").and_then(|v| v.parse().ok()),
            zcam_range_m: <[f64; 2]>::try_from(numbers("zcam-range")).ok(),
            tag_size_m: other("tag-size").and_then(|v| v.parse().ok()),
            tag_family: other("tag-family").and_then(|v| v.parse().ok()),
            stereo_camera: None,
            compare: Some(false),
        },
        scoring: Scoring {
            subsets: list("subsets").iter().filter_map(|v| v.parse().ok()).collect(),
            // The default was one alignment for all streams.
            align: Some(s.align.parse().unwrap_or_default()),
        },
    }
}
