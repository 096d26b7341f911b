//! A request as the command line that asks for the same.

use std::path::Path;

use vice_files::address::{shown, shown_path};

use super::Request;
use crate::text::shell_word;

pub(super) fn of(request: &Request) -> String {
    let mut words: Vec<String> = vec!["vice".to_string(), "evaluate".to_string()];
    words.push(told(&request.dataset.path));
    for (name, value) in options(request) {
        words.extend([format!("--{name}"), value]);
    }
    words.iter().map(|w| shell_word(w)).collect::<Vec<_>>().join(" ")
}

fn told(path: &Path) -> String {
    shown_path(path).display().to_string()
}

fn options(request: &Request) -> Vec<(&'static str, String)> {
    let mut options = Vec::new();
    let mut add = |name, value: Option<String>| options.extend(value.map(|v| (name, v)));
    let list = |values: Vec<String>| (!values.is_empty()).then(|| values.join(","));
    let numbers = |values: &[f64]| list(values.iter().map(f64::to_string).collect());
    let Request { dataset, labels, protocol, streams, depth, scoring } = request;
    add("format", dataset.format.clone());
    add("camera", dataset.camera.clone());
    for (key, value) in &dataset.set {
        add("set", Some(format!("{key}={}", shown(value))));
    }
    for file in &dataset.plugins.files {
        add("plugin", Some(file.display().to_string()));
    }
    add("calibration", dataset.calibration.as_deref().map(told));
    add("intrinsics", dataset.intrinsics.and_then(|k| numbers(&k)));
    add("distortion", dataset.distortion.as_ref().map(ToString::to_string));
    add("image-size", dataset.image_size.map(|size| size.to_string()));
    add("body-from-camera", dataset.body_from_camera.as_deref().and_then(numbers));
    add("cloud", dataset.cloud.as_deref().map(told));
    add("mesh", dataset.mesh.as_deref().map(told));
    add("world-from-cloud", dataset.world_from_cloud.as_deref().map(told));
    add("floor-plane", dataset.floor_plane.and_then(|p| numbers(&p)));
    add("labels", Some(told(&labels.file)));
    add("points", list(labels.points.clone()));
    let observations =
        (labels.observations != Default::default()).then(|| labels.observations.name().to_string());
    add("observations", observations);
    add("label-noise", labels.noise.as_deref().map(told));
    add("fps", protocol.fps.map(|v| v.to_string()));
    add("start", (protocol.start != Default::default()).then(|| protocol.start.as_secs_f64().to_string()));
    add("duration", protocol.duration.map(|d| d.as_secs_f64().to_string()));
    add("estimate", list(streams.estimates.iter().map(ToString::to_string).collect()));
    add("reference", streams.reference.clone().into());
    let frame = streams.estimate_frame.to_string();
    add("estimate-frame", (frame != "body").then_some(frame));
    add("estimate-as", list(streams.estimate_as.iter().map(ToString::to_string).collect()));
    add("times", streams.times.as_deref().map(told));
    add("time-offset", streams.time_offset.map(|s| s.as_secs_f64().to_string()));
    let gap = (streams.max_gap != super::DEFAULT_MAX_GAP).then(|| streams.max_gap.as_secs_f64().to_string());
    add("max-gap", gap);
    add("anchor", streams.anchor.as_ref().map(ToString::to_string));
    add("initial-pose", streams.initial_pose.and_then(|p| numbers(&p)));
    add("depth", list(depth.sources.iter().map(|n| n.name().to_string()).collect()));
    add("zmap-interpolation", depth.zmap_interpolation.map(|i| i.name().to_string()));
    add("zmap-occlusion", depth.zmap_occlusion.map(|on| if on { "on" } else { "off" }.to_string()));
    add("cloud-voxel", depth.cloud_voxel_m.map(|v| v.to_string()));
    add("zcam-range", depth.zcam_range_m.and_then(|r| numbers(&r)));
    add("tag-size", depth.tag_size_m.map(|v| v.to_string()));
    add("tag-family", depth.tag_family.map(|f| f.name().to_string()));
    add("stereo-camera", depth.stereo_camera.clone());
    add("depth-check", depth.compare.map(|on| if on { "on" } else { "off" }.to_string()));
    add("subsets", list(scoring.subsets.iter().map(usize::to_string).collect()));
    add("align", scoring.align.map(|a| a.name().to_string()));
    options
}
