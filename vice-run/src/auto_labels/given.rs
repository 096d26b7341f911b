//! Labels that are gone on from.

use std::path::Path;

use vice_core::label::{LabelSet, PointLabels};
use vice_core::suspicion::Suspicions;
use vice_core::time::Stamp;
use vice_files::{address, labels};
use vice_track::auto::{Given, GivenPlace};

use crate::error::{RunError, RunResult};
use crate::open::Opened;
use crate::place::Place;

/// The labels of a file.
pub(super) struct Givens {
    pub(super) labels: LabelSet,
    pub(super) suspicions: Suspicions,
}

impl Givens {
    /// Reads a file of labels of this camera.
    ///
    /// # Errors
    /// [`RunError`] if it cannot be read, or is of another camera or image size.
    pub(super) fn read(file: &Path, opened: &Opened) -> RunResult<Self> {
        let place = Place::of_file(file)?;
        let read = place.told(labels::read_file(place.path(), Some(&opened.frames)))?;
        let shown = address::shown_path(file);
        let read =
            read.of_camera(&opened.camera_name, &opened.dataset.cameras()).map_err(|e| e.at(&shown))?;
        read.check_image_size(opened.camera.width(), opened.camera.height()).map_err(|e| e.at(&shown))?;
        let wrong = |what: String| RunError::usage("from", format!("{}: {what}", shown.display()));
        for point in read.labels.points() {
            if let Some(o) = point.observations.iter().find(|o| !opened.camera.contains(o.px)) {
                return Err(wrong(format!(
                    "point {} at {} ns is at ({:.1}, {:.1}), outside of the {}x{} image",
                    point.name,
                    o.stamp,
                    o.px.u,
                    o.px.v,
                    opened.camera.width(),
                    opened.camera.height()
                )));
            }
        }
        let mut stamps = read.labels.points().iter().flat_map(|p| &p.observations).map(|o| o.stamp);
        if !stamps.any(|s| opened.frames.binary_search(&s).is_ok()) {
            return Err(wrong(format!("none of the labels is at a frame of camera {}", opened.camera_name)));
        }
        Ok(Self { labels: read.labels, suspicions: read.suspicions })
    }

    pub(super) fn names(&self) -> Vec<String> {
        self.labels.points().iter().map(|p| p.name.clone()).collect()
    }

    /// What each point has in a window of frames. Labels at no frame are passed over here, and counted by whoever scores.
    pub(super) fn in_window(&self, stamps: &[Stamp]) -> Vec<Given> {
        self.labels.points().iter().map(|point| in_window(point, stamps)).collect()
    }
}

fn in_window(point: &PointLabels, stamps: &[Stamp]) -> Given {
    let place = |o: vice_core::label::Observation| {
        let position = stamps.binary_search(&o.stamp).ok()?;
        Some(GivenPlace { position, px: o.px, keyframe: o.keyframe, occluded: o.occluded })
    };
    let behind = stamps.last().and_then(|last| point.observations.iter().find(|o| o.stamp > *last));
    Given {
        places: point.observations.iter().filter_map(place).collect(),
        continues: behind.is_some_and(|o| !o.keyframe),
    }
}
