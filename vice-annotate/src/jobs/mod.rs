//! Work in the background: tracking from an observation to later or earlier frames, until a point is lost or a person has
//! placed it, and looking for calibration targets.

mod detect;
mod lane;
mod run;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use serde::{Deserialize, Serialize};
use vice_core::error::{DataError, DataResult};

pub use detect::DetectRequest;
use vice_detect::DetectOptions;

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

/// What a job does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum JobKind {
    /// Follows points through the images.
    Track,
    /// Looks for calibration targets.
    Detect,
}

/// Why a point was not followed any further.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EndReason {
    /// It was not found again.
    Lost,
    /// It left the image.
    LeftImage,
    /// The observation that tracking started from was changed.
    Changed,
}

/// Where the tracking of a point ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LaneEnd {
    /// The point.
    pub point: String,
    /// The first frame without it.
    pub frame: usize,
    /// Why.
    pub why: EndReason,
    /// Time to that frame from the one before on the way, seconds: over a long one much can have changed.
    pub gap_s: f64,
}

/// A job as others see it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JobState {
    /// Its number.
    pub id: u64,
    /// What it does.
    pub kind: JobKind,
    /// The points, of a tracking job.
    pub points: Vec<String>,
    /// Which way, of a tracking job.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<Direction>,
    /// Frames that are done.
    pub done: usize,
    /// Frames at most.
    pub total: usize,
    /// How it stands.
    pub state: Progress,
    /// What became of the points, or what was found.
    pub message: Option<String>,
    /// Where points were followed no further.
    pub ends: Vec<LaneEnd>,
    /// What `message` says beyond `ends`.
    pub remarks: Option<String>,
}

impl JobState {
    const fn new(id: u64, kind: JobKind, total: usize) -> Self {
        Self {
            id,
            kind,
            points: vec![],
            direction: None,
            done: 0,
            total,
            state: Progress::Running,
            message: None,
            ends: vec![],
            remarks: None,
        }
    }
}

/// Who is told of what happens. Changes are told while the labels are locked, so that they come in order.
pub trait Listener: Send + Sync {
    /// The labels have changed.
    fn changed(&self, store: &Store, changed: &Changed);
    /// A job has moved on.
    fn job(&self, job: &JobState);
}

/// A job under way or finished.
struct Job {
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
pub struct Accepted {
    job: Arc<Job>,
    work: Work,
}

enum Work {
    Track(TrackRequest),
    Detect(DetectOptions),
}

impl Jobs {
    /// Accepts a request to track. Tracking under way for the same points is stopped: the newer one knows better.
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
        let total = run::legs(desk, &request).iter().map(Vec::len).sum();
        let state = JobState {
            points: request.points.clone(),
            direction: Some(request.direction),
            ..JobState::new(id, JobKind::Track, total)
        };
        self.stop_where(|other| other.points.iter().any(|p| request.points.contains(p)));
        Ok(self.add(state, Work::Track(request)))
    }

    /// Accepts a request to look for targets. A search under way is stopped.
    ///
    /// # Errors
    /// [`StoreError`] if the asker's revision is stale, nothing can be written, or there is no such target.
    pub fn accept_detect(
        &self,
        desk: &Desk,
        request: &DetectRequest,
    ) -> Result<(Accepted, JobState), StoreError> {
        let options = request.options().map_err(StoreError::Refused)?;
        let mut store = desk.store();
        store.check_known(request.revision)?;
        let id = store.new_job();
        drop(store);
        self.stop_where(|other| other.kind == JobKind::Detect);
        Ok(self.add(JobState::new(id, JobKind::Detect, desk.chosen.len()), Work::Detect(options)))
    }

    fn add(&self, state: JobState, work: Work) -> (Accepted, JobState) {
        let job = Arc::new(Job { state: Mutex::new(state.clone()), stop: AtomicBool::new(false) });
        let mut list = lock(&self.list);
        let finished = list.iter().filter(|j| j.state().state != Progress::Running).count();
        let mut too_many = finished.saturating_sub(REMEMBERED);
        list.retain(|j| {
            let drop = too_many > 0 && j.state().state != Progress::Running;
            too_many -= usize::from(drop);
            !drop
        });
        list.push(Arc::clone(&job));
        (Accepted { job, work }, state)
    }

    /// Runs a job to its end.
    pub fn run(desk: &Desk, listener: &dyn Listener, accepted: &Accepted) {
        match &accepted.work {
            Work::Track(request) => run::run(desk, listener, &accepted.job, request),
            Work::Detect(options) => detect::run(desk, listener, &accepted.job, options),
        }
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
