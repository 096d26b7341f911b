//! Whether a cloud is where the cameras are: one in another frame or unit is not.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Vector3;
use vice_core::suspicion::Suspicion;

use crate::cloud::Cloud;

/// Scans reach farther than they are wide only where they are small: below this nothing is said, metres.
const NEAR_M: f64 = 20.0;

/// How near to the box of the points the key frames come, metres; nothing before the first.
#[derive(Clone, Debug, Default)]
pub(super) struct Nearest(Arc<Mutex<Option<f64>>>);

impl Nearest {
    /// Adds a camera by its place in the frame of the cloud.
    pub(super) fn add(&self, cloud: &Cloud, camera_m: &Vector3<f64>) {
        let [low, high] = cloud.bounds_m();
        let outside = |i: usize| (low[i] - camera_m[i]).max(camera_m[i] - high[i]).max(0.0);
        let distance_m = Vector3::new(outside(0), outside(1), outside(2)).norm();
        let mut held = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *held = Some(held.map_or(distance_m, |known| known.min(distance_m)));
    }

    /// The doubt, where no key frame comes nearer than the cloud is wide.
    pub(super) fn doubt(&self, cloud: &Cloud) -> Option<Suspicion> {
        let nearest_m = (*self.0.lock().unwrap_or_else(PoisonError::into_inner))?;
        let [low, high] = cloud.bounds_m();
        let width_m = (high - low).norm();
        (nearest_m > NEAR_M.max(width_m)).then(|| {
            Suspicion::new(
                "cloud-elsewhere",
                "the cloud",
                "no key frame is near the points: another frame or unit?",
            )
            .evidence(format!("the nearest is {nearest_m:.1} m away, and the cloud is {width_m:.1} m wide"))
            .advice("place it with `world-from-cloud`, or convert it to metres")
        })
    }
}
