//! What is labelled: one camera of one data set, the frames that were chosen, and the labels.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};

use vice_core::camera::Camera;
use vice_core::dataset::Dataset;
use vice_core::time::Stamp;
use vice_files::address::is_address;
use vice_run::error::{RunError, RunResult};
use vice_run::request::DepthName;
use vice_run::request::{Request, is_auto};

use crate::estimates::Estimates;
use crate::notes::Notes;
use crate::scene::SceneEstimates;
use crate::store::{Checks, Store, Target, lock};

/// A camera with its labels, shared by the server and the jobs.
pub struct Desk {
    /// The data set.
    pub dataset: Arc<dyn Dataset>,
    /// Name of its camera.
    pub camera_name: String,
    /// The camera.
    pub camera: Camera,
    /// All frames of the camera.
    pub frames: Arc<[Stamp]>,
    /// Indices of the frames that are labelled, ascending; at least one.
    pub chosen: Vec<usize>,
    /// The labels.
    pub store: Arc<Mutex<Store>>,
    /// What was said of lanes beside the labels.
    pub notes: Mutex<Notes>,
    /// Pose streams and depth, where there are any.
    pub estimates: Option<Arc<dyn Estimates>>,
}

impl Desk {
    /// Opens the recording of a request and its labels, made with the first point where they are not there yet; with what
    /// its pose streams and depth source add.
    ///
    /// # Errors
    /// [`vice_run::error::RunError`] if something that is asked for is not there, or the labels are of another recording.
    pub fn open(request: &Request) -> RunResult<Self> {
        request.protocol.check()?;
        // Suggestions look at whatever knows the scene, besides the source that dots take their depth from.
        request.depth.check(&[DepthName::ZCam, DepthName::ZMap])?;
        request.depth.check_of_frames()?;
        if is_auto(&request.labels.file) {
            return Err(RunError::usage("labels", "what a person labels needs a file")
                .advise("name one; `vice labels track` makes labels to begin with"));
        }
        if is_address(&request.labels.file) {
            let problem = "labels are written while they are made, and this lies elsewhere";
            return Err(RunError::usage("labels", problem).advise("name a file of this machine"));
        }
        let opened = request.dataset.open()?;
        let chosen = request.protocol.frames(&opened)?;
        let target =
            Target { dataset: opened.dataset.name(), camera: &opened.camera_name, frames: &opened.frames };
        let store = Store::open(&request.labels.file, &target)?;
        let notes = Notes::open(store.path())?;
        let estimates = SceneEstimates::open(request, &opened, &chosen)?;
        Ok(Self {
            dataset: opened.dataset,
            camera_name: opened.camera_name,
            camera: opened.camera,
            frames: opened.frames,
            chosen,
            store: Arc::new(Mutex::new(store)),
            notes: Mutex::new(notes),
            estimates: estimates.map(|e| Arc::new(e) as Arc<dyn Estimates>),
        })
    }

    /// Why the labels cannot be changed, where they cannot.
    pub fn read_only(&self) -> Option<String> {
        self.store().read_only().map(ToString::to_string)
    }

    /// The file of the labels.
    pub fn labels_file(&self) -> PathBuf {
        self.store().path().to_path_buf()
    }

    /// What edits are checked against.
    pub fn checks(&self) -> Checks<'_> {
        Checks { camera: &self.camera, frames: &self.frames }
    }

    /// The labels, locked.
    pub fn store(&self) -> MutexGuard<'_, Store> {
        lock(&self.store)
    }

    /// Whether a frame is one of those that are labelled.
    pub fn is_chosen(&self, frame: usize) -> bool {
        self.chosen.binary_search(&frame).is_ok()
    }
}
