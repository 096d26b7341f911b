//! One point of a tracking job.

use std::sync::Arc;

use vice_core::camera::Pixel;
use vice_core::label::{Observation, ObservationSource, Provenance};
use vice_core::time::Stamp;

use crate::desk::Desk;
use crate::store::{Cell, Document};
use vice_track::{DOUBT_CONFIDENCE, Outcome, PointTrack, Pyramid, TrackError, TrackOptions, tracker_version};

/// A point on its way through the frames.
pub(super) struct Lane {
    pub(super) point: String,
    /// The observation that it started from: when that changes, what follows from it is void.
    start: (usize, Pixel),
    track: PointTrack,
    /// What was found and is not written yet, in the order of the frames.
    found: Vec<(usize, Found)>,
    /// Where a stream expected the point last.
    expected: Option<Pixel>,
    /// Why it is no longer followed, where it is not.
    pub(super) fate: Option<Fate>,
    /// Nothing more is to be done for it.
    pub(super) over: bool,
    /// What was written, in the order in which it was visited, with whether it is doubtful.
    written: Vec<(Stamp, bool)>,
}

/// What is known of a frame.
#[derive(Clone, Copy, Debug)]
enum Found {
    Here {
        px: Pixel,
        confidence: f64,
        seeded: bool,
    },
    /// The point was lost before: what an earlier track said of the frame is void.
    Nothing,
}

/// Why a point is no longer followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fate {
    Lost(usize),
    LeftImage(usize),
    /// The observation that it started from has changed.
    Void,
}

impl Lane {
    pub(super) fn start(
        point: &str,
        frame: usize,
        px: Pixel,
        image: &Arc<Pyramid>,
    ) -> Result<Self, TrackError> {
        let track = PointTrack::start(image, px, TrackOptions::default())?;
        Ok(Self {
            point: point.to_string(),
            start: (frame, px),
            track,
            found: Vec::new(),
            expected: Some(px),
            fate: None,
            over: false,
            written: Vec::new(),
        })
    }

    /// Looks at what the labels have in the next frame: the lane ends where something holds, and a lost point's where the
    /// run of an earlier track's observations does.
    pub(super) fn look_ahead(&mut self, document: &Document, desk: &Desk, frame: usize) {
        match document.get(&self.point, desk.frames[frame]) {
            Some(o) if holds(o) => self.over = true,
            None if self.fate.is_some() && desk.is_chosen(frame) => self.over = true,
            _ => {}
        }
    }

    /// Whether the image of the next frame is needed.
    pub(super) const fn is_followed(&self) -> bool {
        self.fate.is_none() && !self.over
    }

    /// Goes on to the next frame; its image is only needed while the point is followed.
    pub(super) fn step(&mut self, desk: &Desk, frame: usize, image: Option<&Arc<Pyramid>>) {
        if self.over {
            return;
        }
        if self.fate.is_some() {
            return self.found.push((frame, Found::Nothing));
        }
        let Some(image) = image else { return };
        let seed = self.seed(desk, frame);
        let step = self.track.step(image, seed);
        let found = match step.outcome {
            Outcome::LeftImage => {
                self.fate = Some(Fate::LeftImage(frame));
                Found::Nothing
            }
            outcome if !outcome.is_found() => {
                self.fate = Some(Fate::Lost(frame));
                Found::Nothing
            }
            _ => Found::Here { px: step.px, confidence: step.confidence, seeded: seed.is_some() },
        };
        self.found.push((frame, found));
    }

    /// Where the point should be next: where it is, moved as a stream says that the image moves there.
    fn seed(&mut self, desk: &Desk, frame: usize) -> Option<Pixel> {
        let before = self.expected?;
        let estimates = desk.estimates.as_ref()?;
        self.expected = estimates.expect(self.start.0, self.start.1, frame);
        let (now, at) = (self.expected?, self.track.px());
        Some(Pixel::new(at.u + now.u - before.u, at.v + now.v - before.v))
    }

    /// The cells of what was found, on the labels as they are now.
    pub(super) fn cells(&mut self, document: &Document, desk: &Desk) -> Vec<Cell> {
        let from = document.get(&self.point, desk.frames[self.start.0]);
        if from.is_none_or(|o| o.px != self.start.1 || o.occluded) {
            self.fate = Some(Fate::Void);
            self.over = true;
            self.found.clear();
            return vec![];
        }
        let mut cells = Vec::new();
        for (frame, found) in std::mem::take(&mut self.found) {
            let stamp = desk.frames[frame];
            let there = document.get(&self.point, stamp);
            if there.is_some_and(holds) {
                // Placed by hand while the track was under way.
                self.over = true;
                break;
            }
            let after = match found {
                Found::Here { px, confidence, seeded } if there.is_some() || desk.is_chosen(frame) => {
                    // The window may reach into the image while the point itself does not.
                    let doubtful = confidence < DOUBT_CONFIDENCE;
                    let inside = desk.camera.contains(px);
                    self.written.extend(inside.then_some((stamp, doubtful)));
                    inside.then(|| Observation {
                        source: ObservationSource::Auto,
                        occluded: there.is_some_and(|o| o.occluded),
                        uncertain: doubtful,
                        provenance: Provenance {
                            confidence: Some(confidence.clamp(0.0, 1.0)),
                            tracker_version: tracker_version(),
                            seeded,
                        },
                        ..Observation::manual(stamp, px)
                    })
                }
                Found::Here { .. } => continue,
                Found::Nothing if there.is_some_and(|o| o.source == ObservationSource::Auto) => None,
                Found::Nothing => continue,
            };
            cells.extend(document.cell(&self.point, stamp, after));
        }
        cells
    }
}

impl Lane {
    /// The cells that make the way back from a key frame a segment of its own: without a key frame ahead of it, what lies before
    /// the one where tracking started would be taken for what the segment before is of. Doubtful observations at its far end
    /// go, since a key frame says what all others are of.
    pub(super) fn headed(&self, document: &Document, desk: &Desk) -> Vec<Cell> {
        let from = document.get(&self.point, desk.frames[self.start.0]);
        if from.is_none_or(|o| !o.keyframe) {
            return vec![];
        }
        let there = |stamp: &Stamp| document.get(&self.point, *stamp).filter(|o| !holds(o));
        let far_first = self.written.iter().rev().filter(|(stamp, _)| there(stamp).is_some());
        let mut cells = Vec::new();
        for (stamp, doubtful) in far_first {
            let after = if *doubtful { None } else { there(stamp).map(|o| o.as_keyframe()) };
            cells.extend(document.cell(&self.point, *stamp, after));
            if !doubtful {
                break;
            }
        }
        cells
    }
}

/// Whether an observation is not the tracker's to change: a person's, a detector's, or the start of a segment.
fn holds(o: &Observation) -> bool {
    o.keyframe || matches!(o.source, ObservationSource::Manual | ObservationSource::Detected)
}
