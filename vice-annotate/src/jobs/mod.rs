//! Tracking in the background: from an observation to later or earlier frames, until a point is lost or a person has
//! placed it.

mod lane;
mod run;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use serde::{Deserialize, Serialize};
use vice_core::error::{DataError, DataResult};

use crate::desk::Desk;
use crate::store::{Changed, Store, StoreError, lock};

/// Finished jobs that are still told of.
const REMEMBERED: usize = 8;

/// Where tracking goes in time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// To later frames.
    Forward,
    /// To earlier frames.
    Backward,
    /// To later ones, then to earlier ones.
    Both,
}

/// What is to be tracked.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackRequest {
    /// The revision that the asker has seen.
    pub revision: u64,
    /// The points, each with an observation in the frame.
    pub points: Vec<String>,
    /// Where to start.
    pub frame: usize,
    /// Which way.
    pub direction: Direction,
    /// The last frame, `None` to the end of what is labelled.
    pub until: Option<usize>,
}

/// How a job stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Progress {
    /// Under way.
    Running,
    /// Finished.
    Done,
    /// Stopped by a person; what it did so far holds.
    Stopped,
    /// It could not go on; what it did so far holds.
    Failed,
}

/// A job as others see it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JobState {
    /// Its number.
    pub id: u64,
    /// What it does.
    pub kind: &'static str,
    /// The points.
    pub points: Vec<String>,
    /// Which way.
    pub direction: Direction,
    /// Frames that are done.
    pub done: usize,
    /// Frames at most.
    pub total: usize,
    /// How it stands.
    pub state: Progress,
    /// What became of the points.
    pub message: Option<String>,
}

/// Who is told of what happens. Changes are told while the labels are locked, so that they come in order.
pub trait Listener: Send + Sync {
    /// The labels have changed.
    fn changed(&self, store: &Store, changed: &Changed);
    /// A job has moved on.
    fn job(&self, job: &JobState);
}

/// A job under way or finished.
pub(crate) struct Job {
    pub(crate) request: TrackRequest,
    state: Mutex<JobState>,
    stop: AtomicBool,
}

impl Job {
    fn state(&self) -> JobState {
        lock(&self.state).clone()
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }

    fn update(&self, listener: &dyn Listener, change: impl FnOnce(&mut JobState)) {
        let state = {
            let mut state = lock(&self.state);
            change(&mut state);
            state.clone()
        };
        listener.job(&state);
    }
}

/// The jobs of one desk.
#[derive(Default)]
pub struct Jobs {
    list: Mutex<Vec<Arc<Job>>>,
}

/// A job that was accepted, and now has to be run on a thread that may take its time.
pub struct Accepted(Arc<Job>);

impl Jobs {
    /// Accepts a request. Jobs under way for the same points are stopped: the newer one knows better.
    ///
    /// # Errors
    /// [`StoreError`] if the asker's revision is stale, nothing can be written, or a point has no observation to
    /// start from.
    pub fn accept(&self, desk: &Desk, request: TrackRequest) -> Result<(Accepted, JobState), StoreError> {
        let mut store = desk.store();
        store.check_known(request.revision)?;
        check(desk, &store, &request).map_err(StoreError::Refused)?;
        let id = store.new_job();
        drop(store);
        let state = JobState {
            id,
            kind: "track",
            points: request.points.clone(),
            direction: request.direction,
            done: 0,
            total: run::legs(desk, &request).iter().map(Vec::len).sum(),
            state: Progress::Running,
            message: None,
        };
        let job = Arc::new(Job { request, state: Mutex::new(state.clone()), stop: AtomicBool::new(false) });
        self.stop_where(|other| other.points.iter().any(|p| job.request.points.contains(p)));
        let mut list = lock(&self.list);
        let finished = list.iter().filter(|j| j.state().state != Progress::Running).count();
        let mut too_many = finished.saturating_sub(REMEMBERED);
        list.retain(|j| {
            let drop = too_many > 0 && j.state().state != Progress::Running;
            too_many -= usize::from(drop);
            !drop
        });
        list.push(Arc::clone(&job));
        Ok((Accepted(job), state))
    }

    /// Runs a job to its end.
    pub fn run(desk: &Desk, listener: &dyn Listener, accepted: &Accepted) {
        run::run(desk, listener, &accepted.0);
    }

    /// The jobs, oldest first.
    pub fn states(&self) -> Vec<JobState> {
        lock(&self.list).iter().map(|j| j.state()).collect()
    }

    /// Stops a job; false if there is none of that number.
    pub fn stop(&self, id: u64) -> bool {
        self.stop_where(|job| job.id == id)
    }

    /// Stops all jobs.
    pub fn stop_all(&self) {
        self.stop_where(|_| true);
    }

    fn stop_where(&self, wanted: impl Fn(&JobState) -> bool) -> bool {
        let mut any = false;
        for job in lock(&self.list).iter().filter(|j| wanted(&j.state())) {
            job.stop.store(true, Ordering::Release);
            any = true;
        }
        any
    }
}

fn check(desk: &Desk, store: &Store, request: &TrackRequest) -> DataResult<()> {
    let stamp = desk.checks().stamp(request.frame)?;
    if let Some(until) = request.until {
        desk.checks().stamp(until)?;
    }
    if request.points.is_empty() {
        return Err(DataError::new("no point is named"));
    }
    for (i, point) in request.points.iter().enumerate() {
        if request.points[..i].contains(point) {
            return Err(DataError::new(format!("point {point} is named twice")));
        }
        let frame = request.frame;
        let from = store.document().get(point, stamp).ok_or_else(|| {
            DataError::new(format!(
                "point {point} is not labelled in frame {frame}, where tracking should start"
            ))
        })?;
        if from.occluded {
            return Err(DataError::new(format!("point {point} is marked as occluded in frame {frame}")));
        }
    }
    Ok(())
}
