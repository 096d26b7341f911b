//! What is labelled: one camera of one data set, the frames that were chosen, and the labels.

use std::sync::{Arc, Mutex, MutexGuard};

use vice_core::camera::Camera;
use vice_core::dataset::Dataset;
use vice_core::time::Stamp;

use crate::estimates::Estimates;
use crate::store::{Checks, Store, lock};

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
    /// Pose streams and depth, where there are any.
    pub estimates: Option<Arc<dyn Estimates>>,
}

impl Desk {
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
