//! Carrying out a tracking job.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;
use vice_core::error::{DataResult, one_line};

use super::lane::{Fate, Lane};
use super::{Direction, EndReason, Job, LaneEnd, Listener, Progress, TrackRequest};
use crate::desk::Desk;
use crate::store::{By, Cell, Document, StoreError};
use vice_track::Pyramid;

/// How often what was found is written and told.
const BATCH: Duration = Duration::from_millis(200);

/// The frames of each way, in the order in which they are visited; the one where it starts is not among them.
///
/// All frames of the camera are, chosen or not: a point is easier to follow in small steps.
pub(super) fn legs(desk: &Desk, request: &TrackRequest) -> Vec<Vec<usize>> {
    let (Some(first), Some(last)) = (desk.chosen.first(), desk.chosen.last()) else { return vec![] };
    let start = request.frame;
    let forward = || {
        let end =
            request.until.filter(|u| *u > start).unwrap_or(*last).min(desk.frames.len().saturating_sub(1));
        (start + 1..=end).collect()
    };
    let backward = || {
        let end = request.until.filter(|u| *u < start).unwrap_or(*first);
        (end..start).rev().collect()
    };
    match request.direction {
        Direction::Forward => vec![forward()],
        Direction::Backward => vec![backward()],
        Direction::Both => vec![forward(), backward()],
    }
}

/// Tracks until every point's lane has ended, the job is stopped, or something cannot be written.
pub(super) fn run(desk: &Desk, listener: &dyn Listener, job: &Job, request: &TrackRequest) {
    let mut runner = Runner {
        desk,
        listener,
        job,
        request,
        last_batch: Instant::now(),
        ends: Vec::new(),
        remarks: BTreeMap::new(),
        bad_frames: 0,
    };
    let outcome = runner.run();
    let remarks = runner.remarks();
    let ends: Vec<String> = runner.ends.iter().map(end_text).collect();
    let said: Vec<String> = ends.into_iter().chain(remarks.clone()).collect();
    job.update(listener, |state| {
        state.state = match &outcome {
            Ok(()) if job.is_stopped() => Progress::Stopped,
            Ok(()) => Progress::Done,
            Err(_) => Progress::Failed,
        };
        if state.state == Progress::Done {
            state.done = state.total;
        }
        state.message = match outcome {
            Ok(()) => (!said.is_empty()).then(|| said.join("; ")),
            Err(error) => Some(error),
        };
        state.ends = runner.ends;
        state.remarks = remarks;
    });
}

fn end_text(end: &LaneEnd) -> String {
    let LaneEnd { point, frame, why, gap_s } = end;
    match why {
        EndReason::Lost => format!("{point} is lost in frame {frame}, {gap_s:.2} s after the one before"),
        EndReason::LeftImage => format!("{point} leaves the image in frame {frame}"),
        EndReason::Changed => format!("{point} was changed where tracking started"),
    }
}

struct Runner<'a> {
    desk: &'a Desk,
    listener: &'a dyn Listener,
    job: &'a Job,
    request: &'a TrackRequest,
    last_batch: Instant,
    ends: Vec<LaneEnd>,
    /// What else became of points, by point and way.
    remarks: BTreeMap<(String, usize), String>,
    bad_frames: usize,
}

impl Runner<'_> {
    fn run(&mut self) -> Result<(), String> {
        let start = self.request.frame;
        let image = self.pyramid(start).map_err(|e| e.to_string())?;
        let mut done = 0;
        for (way, frames) in legs(self.desk, self.request).into_iter().enumerate() {
            let mut lanes = self.lanes(&image, way)?;
            self.leg(&mut lanes, &frames, &mut done)?;
            if frames.first().is_some_and(|f| *f < start) {
                self.commit(|document, desk| lanes.iter().flat_map(|l| l.headed(document, desk)).collect())?;
            }
            let ends: Vec<LaneEnd> = lanes.iter().filter_map(|lane| self.end(lane, &frames)).collect();
            self.ends.extend(ends);
        }
        Ok(())
    }

    fn end(&self, lane: &Lane, frames: &[usize]) -> Option<LaneEnd> {
        let start = self.request.frame;
        let (why, frame) = match lane.fate? {
            Fate::Lost(frame) => (EndReason::Lost, frame),
            Fate::LeftImage(frame) => (EndReason::LeftImage, frame),
            Fate::Void => (EndReason::Changed, start),
        };
        let at = frames.iter().position(|f| *f == frame);
        let before = at.and_then(|at| at.checked_sub(1)).map_or(start, |at| frames[at]);
        let gap_s = self.desk.frames[frame].since(self.desk.frames[before]).as_secs_f64().abs();
        Some(LaneEnd { point: lane.point.clone(), frame, why, gap_s })
    }

    fn lanes(&mut self, image: &Arc<Pyramid>, way: usize) -> Result<Vec<Lane>, String> {
        let request = self.request;
        let stamp = self.desk.frames[request.frame];
        let mut lanes = Vec::new();
        for point in &request.points {
            // Gone since the job was accepted: then there is nothing to start from.
            let Some(px) = self.desk.store().document().get(point, stamp).map(|o| o.px) else { continue };
            match Lane::start(point, request.frame, px, image) {
                Ok(lane) => lanes.push(lane),
                Err(error) => {
                    self.remarks.insert((point.clone(), way), format!("{point}: {error}"));
                }
            }
        }
        if lanes.is_empty() {
            return Err(self.remarks().unwrap_or_else(|| "nothing is left to track".to_string()));
        }
        Ok(lanes)
    }

    fn leg(&mut self, lanes: &mut [Lane], frames: &[usize], done: &mut usize) -> Result<(), String> {
        let mut next = frames.first().map(|frame| self.pyramid(*frame));
        for (i, frame) in frames.iter().enumerate() {
            if self.job.is_stopped() {
                break;
            }
            {
                let store = self.desk.store();
                lanes.iter_mut().for_each(|lane| lane.look_ahead(store.document(), self.desk, *frame));
            }
            if lanes.iter().all(|lane| lane.over) {
                *done += frames.len() - i;
                break;
            }
            let image = match next.take() {
                Some(Ok(image)) => Some(image),
                Some(Err(error)) => {
                    // One frame less is a larger step, no more.
                    tracing::warn!("frame {frame} is left out of tracking: {error}");
                    self.bad_frames += 1;
                    None
                }
                None => None,
            };
            let following = lanes.iter().any(Lane::is_followed);
            let after = frames.get(i + 1).filter(|_| following);
            // The next image is decoded while this one is searched.
            let ((), decoded) = rayon::join(
                || lanes.par_iter_mut().for_each(|lane| lane.step(self.desk, *frame, image.as_ref())),
                || after.map(|frame| self.pyramid(*frame)),
            );
            next = decoded;
            *done += 1;
            if self.last_batch.elapsed() >= BATCH {
                self.write(lanes, *done)?;
            }
        }
        self.write(lanes, *done)
    }

    /// Writes what was found so far as a part of the job's step. A stopped job writes nothing more: what stopped it may
    /// have been an undo.
    fn write(&mut self, lanes: &mut [Lane], done: usize) -> Result<(), String> {
        self.last_batch = Instant::now();
        self.commit(|document, desk| lanes.iter_mut().flat_map(|lane| lane.cells(document, desk)).collect())?;
        self.job.update(self.listener, |state| state.done = done);
        Ok(())
    }

    fn commit(&self, cells: impl FnOnce(&Document, &Desk) -> Vec<Cell>) -> Result<(), String> {
        let mut store = self.desk.store();
        if self.job.is_stopped() {
            return Ok(());
        }
        let cells = cells(store.document(), self.desk);
        let id = self.job.state().id;
        let committed = store.commit(By::Track, self.label(), Some(id), cells);
        let changed = committed.map_err(|e: StoreError| one_line(&e))?;
        if !changed.points.is_empty() {
            self.listener.changed(&store, &changed);
        }
        Ok(())
    }

    fn label(&self) -> String {
        let request = self.request;
        let way = match request.direction {
            Direction::Forward => "forwards",
            Direction::Backward => "backwards",
            Direction::Both => "both ways",
        };
        format!("track {} {way} from frame {}", request.points.join(", "), request.frame)
    }

    fn remarks(&self) -> Option<String> {
        let mut remarks: Vec<String> = self.remarks.values().cloned().collect();
        if self.bad_frames > 0 {
            remarks.push(format!("{} frames could not be decoded", self.bad_frames));
        }
        (!remarks.is_empty()).then(|| remarks.join("; "))
    }

    fn pyramid(&self, frame: usize) -> DataResult<Arc<Pyramid>> {
        let image = self.desk.dataset.image(&self.desk.camera_name, frame)?;
        Ok(Arc::new(Pyramid::for_tracking(&image)?))
    }
}
