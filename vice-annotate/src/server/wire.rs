//! The JSON that the page gets. Stamps are text: they exceed what a double holds.

use std::collections::BTreeMap;

use serde::Serialize;
use vice_core::label::{Observation, ObservationSource};
use vice_core::time::Stamp;

use crate::jobs::JobState;
use crate::notes::{Notes, Stretch};
use crate::store::{Changed, Document, Store};

/// One observation.
#[derive(Debug, Serialize)]
pub(super) struct ObservationWire {
    frame: usize,
    stamp_ns: String,
    u: f64,
    v: f64,
    source: ObservationSource,
    keyframe: bool,
    occluded: bool,
    uncertain: bool,
    confidence: Option<f64>,
    seeded: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    tracker_version: Option<u32>,
}

/// A point with all its observations at frames.
#[derive(Debug, Serialize)]
pub(super) struct PointWire {
    name: String,
    observations: Vec<ObservationWire>,
}

/// A frame that is labelled.
#[derive(Debug, Serialize)]
pub(super) struct FrameWire {
    pub(super) frame: usize,
    pub(super) stamp_ns: String,
    pub(super) time_s: f64,
}

/// Frames in which a person says there is nothing to label of a point, both ends among them.
#[derive(Debug, Serialize)]
pub(super) struct EmptyWire {
    point: String,
    from: usize,
    to: usize,
}

/// What was said to be empty, in frames: a stretch without any is left out.
pub(super) fn empty(notes: &Notes, frames: &[Stamp]) -> Vec<EmptyWire> {
    let one = |point: &str, stretch: &Stretch| {
        let from = frames.partition_point(|f| *f < stretch.from);
        let to = frames.partition_point(|f| *f <= stretch.to).checked_sub(1)?;
        (from <= to).then(|| EmptyWire { point: point.to_string(), from, to })
    };
    notes.empty().iter().flat_map(|(point, list)| list.iter().filter_map(move |s| one(point, s))).collect()
}

/// All that the page starts from.
#[derive(Debug, Serialize)]
pub(super) struct StateWire<'a> {
    pub(super) revision: u64,
    pub(super) dataset: &'a str,
    pub(super) format: &'a str,
    pub(super) camera: &'a str,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) labels_file: String,
    pub(super) writable: bool,
    pub(super) read_only_reason: Option<String>,
    pub(super) save_problem: Option<String>,
    pub(super) frames: Vec<FrameWire>,
    pub(super) points: Vec<PointWire>,
    pub(super) can_undo: bool,
    pub(super) can_redo: bool,
    pub(super) floor_suggestions: bool,
    pub(super) depth_known: bool,
    pub(super) empty: Vec<EmptyWire>,
    pub(super) streams: Vec<String>,
    pub(super) jobs: Vec<JobState>,
    pub(super) doubt_below: f64,
    pub(super) version: &'a str,
    pub(super) keys: &'a BTreeMap<String, Vec<String>>,
}

/// What a change did: whole lanes of the points that it touched.
#[derive(Debug, Serialize)]
pub(crate) struct ChangeWire {
    revision: u64,
    points: Vec<PointWire>,
    removed: Vec<String>,
    can_undo: bool,
    can_redo: bool,
    by: &'static str,
    label: String,
}

impl ChangeWire {
    pub(crate) fn new(store: &Store, changed: &Changed, frames: &[Stamp]) -> Self {
        let (there, removed): (Vec<_>, Vec<_>) =
            changed.points.iter().cloned().partition(|p| store.document().point(p).is_some());
        Self {
            revision: changed.revision,
            points: there.iter().filter_map(|name| point(store.document(), name, frames)).collect(),
            removed,
            can_undo: store.can_undo(),
            can_redo: store.can_redo(),
            by: changed.by.name(),
            label: changed.label.clone(),
        }
    }
}

/// All points in the natural order of their names.
pub(super) fn points(document: &Document, frames: &[Stamp]) -> Vec<PointWire> {
    let Ok(labels) = document.labels() else { return vec![] };
    labels.points().iter().filter_map(|p| point(document, &p.name, frames)).collect()
}

fn point(document: &Document, name: &str, frames: &[Stamp]) -> Option<PointWire> {
    let observations = document.point(name)?.values().filter_map(|o| observation(o, frames));
    Some(PointWire { name: name.to_string(), observations: observations.collect() })
}

/// `None` at a stamp that is no frame: it cannot be shown.
fn observation(o: &Observation, frames: &[Stamp]) -> Option<ObservationWire> {
    Some(ObservationWire {
        frame: frames.binary_search(&o.stamp).ok()?,
        stamp_ns: o.stamp.to_string(),
        u: o.px.u,
        v: o.px.v,
        source: o.source,
        keyframe: o.keyframe,
        occluded: o.occluded,
        uncertain: o.uncertain,
        confidence: o.provenance.confidence,
        seeded: o.provenance.seeded,
        tracker_version: o.provenance.tracker_version,
    })
}
