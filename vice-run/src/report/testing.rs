//! Documents for the tests of what renders them.

use std::collections::BTreeMap;

use crate::request::Request;
use crate::result::{ResultDocument, SCHEMA, Used};
use vice_core::camera::Pixel;
use vice_core::result::{DatasetPart, KeyframePart, PixelPart, PointName, Role, Sample, Skip};
use vice_core::skip::SkipReason;
use vice_core::suspicion::Suspicions;
use vice_core::time::Stamp;

/// A name that would run, close, colour or compute wherever it is not escaped.
pub(crate) const HOSTILE: &str = "=x</script><script>alert(1)</script>\"'&\\input{y}%\u{1b}[31m\u{2028}$_^~#";

/// A sample at a stamp in nanoseconds.
pub(crate) fn sample(point: &str, stamp_ns: i64, error_px: f64) -> Sample {
    Sample {
        point: PointName(point.into()),
        timestamp_ns: Stamp::from_nanos(stamp_ns),
        label_px: Pixel::new(10.0, 20.0),
        tracked_px: Pixel::new(10.0 + error_px, 20.0),
        error_px,
    }
}

/// A key frame at a stamp in nanoseconds.
pub(crate) fn keyframe(point: &str, stamp_ns: i64) -> KeyframePart {
    KeyframePart {
        point: PointName(point.into()),
        timestamp_ns: Stamp::from_nanos(stamp_ns),
        label_px: Some(Pixel::new(10.0, 20.0)),
        depth_z_m: 2.0,
        point_world_m: None,
        on_edge: false,
        triangulated: None,
    }
}

/// A part of an estimate with floor depth and these samples.
pub(crate) fn part(stream: &str, samples: &[Sample]) -> PixelPart {
    PixelPart {
        stream: stream.to_string(),
        role: Role::Estimate,
        depth: "floor".to_string(),
        rmse_px: BTreeMap::from([(1, None)]),
        pooled_rmse_px: super::numbers::rms(&samples.iter().map(|s| s.error_px).collect::<Vec<_>>()),
        held_rmse_px: None,
        interval_95: None,
        held: None,
        by_age: vec![],
        by_distance: vec![],
        scored: samples.len() as u64,
        skipped: vec![],
        keyframes: vec![],
        depth_doubts: vec![],
        triangulation: None,
        samples: samples.to_vec(),
    }
}

/// A document of these parts.
pub(crate) fn document(pixel: Vec<PixelPart>) -> ResultDocument {
    ResultDocument {
        schema: SCHEMA.to_string(),
        vice_version: "0".to_string(),
        dataset: DatasetPart {
            name: "run".to_string(),
            format: "euroc".to_string(),
            camera: "cam0".to_string(),
            image_size_px: Some([752, 480]),
            first_frame_ns: Some(Stamp::from_nanos(0)),
        },
        request: Request::default(),
        used: Used::default(),
        pixel,
        trajectory: vec![],
        paths: vec![],
        suspicions: Suspicions::new(),
    }
}

/// A document in which every text from data is hostile.
pub(crate) fn hostile_document() -> ResultDocument {
    let second = 1_000_000_000;
    let samples: Vec<Sample> = (1..6).map(|i| sample(HOSTILE, i * second, i as f64)).collect();
    let mut part = part(HOSTILE, &samples);
    part.depth = HOSTILE.to_string();
    part.keyframes.push(keyframe(HOSTILE, 0));
    part.skipped.push(Skip {
        point: PointName(HOSTILE.into()),
        timestamp_ns: Stamp::from_nanos(9),
        reason: SkipReason::Occluded,
    });
    let mut document = document(vec![part]);
    document.dataset.name = HOSTILE.to_string();
    document.dataset.format = HOSTILE.to_string();
    document.dataset.camera = HOSTILE.to_string();
    document.request.labels.file = HOSTILE.into();
    document.used.anchor = HOSTILE.to_string();
    document.used.points = vec![HOSTILE.to_string()];
    document.request.dataset.set.insert(HOSTILE.to_string(), HOSTILE.to_string());
    document.vice_version = HOSTILE.to_string();
    document
}
