//! A data set with what a user says in place of what it says itself.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{CloudRef, Dataset, DepthImage, Fact, Floor, Image};
use crate::camera::Camera;
use crate::error::DataResult;
use crate::finding::Finding;
use crate::frames::BodyFromCamera;
use crate::imu::{ImuSample, InertialState};
use crate::suspicion::Suspicion;
use crate::time::Stamp;
use crate::trajectory::{PoseCovariance, Trajectory};

/// A data set whose calibration, floor, cloud or mesh were given by the user. Everything else is as it was, so that nobody
/// behind it has to ask whether anything was overridden.
#[derive(Clone)]
pub struct Calibrated {
    inner: Arc<dyn Dataset>,
    cameras: BTreeMap<String, Camera>,
    extrinsics: BTreeMap<String, BodyFromCamera>,
    floor: Option<Floor>,
    cloud: Option<CloudRef>,
    mesh: Option<CloudRef>,
}

impl Calibrated {
    /// A data set in which nothing is overridden yet.
    pub const fn new(inner: Arc<dyn Dataset>) -> Self {
        Self {
            inner,
            cameras: BTreeMap::new(),
            extrinsics: BTreeMap::new(),
            floor: None,
            cloud: None,
            mesh: None,
        }
    }

    /// Replaces the intrinsics of a camera.
    #[must_use]
    pub fn with_camera(mut self, name: impl Into<String>, camera: Camera) -> Self {
        self.cameras.insert(name.into(), camera);
        self
    }

    /// Replaces the extrinsics of a camera, at all times.
    #[must_use]
    pub fn with_body_from_camera(mut self, name: impl Into<String>, pose: BodyFromCamera) -> Self {
        self.extrinsics.insert(name.into(), pose);
        self
    }

    /// Replaces the floor, at all times.
    #[must_use]
    pub const fn with_floor(mut self, floor: Floor) -> Self {
        self.floor = Some(floor);
        self
    }

    /// Replaces the scan of the scene.
    #[must_use]
    pub fn with_cloud(mut self, cloud: CloudRef) -> Self {
        self.cloud = Some(cloud);
        self
    }

    /// Replaces the faces of the scene.
    #[must_use]
    pub fn with_mesh(mut self, mesh: CloudRef) -> Self {
        self.mesh = Some(mesh);
        self
    }
}

impl Dataset for Calibrated {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn format(&self) -> &str {
        self.inner.format()
    }

    fn cameras(&self) -> Vec<String> {
        self.inner.cameras()
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        self.cameras.get(camera).map_or_else(|| self.inner.camera(camera), |own| Ok(*own))
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        self.inner.frames(camera)
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        self.inner.image(camera, index)
    }

    fn image_file(&self, camera: &str, index: usize) -> DataResult<Option<Vec<u8>>> {
        self.inner.image_file(camera, index)
    }

    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera> {
        self.extrinsics.get(camera).map_or_else(|| self.inner.body_from_camera(camera, stamp), |own| Ok(*own))
    }

    fn streams(&self) -> Vec<String> {
        self.inner.streams()
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        self.inner.trajectory(stream)
    }

    fn pose_covariances(&self, stream: &str) -> DataResult<Vec<PoseCovariance>> {
        self.inner.pose_covariances(stream)
    }

    fn is_relative(&self, stream: &str) -> bool {
        self.inner.is_relative(stream)
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        self.inner.imu()
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        self.inner.inertial_state(stamp)
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        self.inner.depth_image(camera, index)
    }

    fn has_depth(&self, camera: &str) -> bool {
        self.inner.has_depth(camera)
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        self.cloud.as_ref().map_or_else(|| self.inner.cloud(), |own| Ok(Some(own.clone())))
    }

    fn mesh(&self) -> DataResult<Option<CloudRef>> {
        match (&self.mesh, &self.cloud) {
            (Some(own), _) => Ok(Some(own.clone())),
            // A scan in place of the data set's is in place of its faces too.
            (None, Some(cloud)) => Ok(Some(cloud.clone())),
            (None, None) => self.inner.mesh(),
        }
    }

    fn floor(&self, keyframe: Stamp) -> DataResult<Floor> {
        self.floor.map_or_else(|| self.inner.floor(keyframe), Ok)
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        self.inner.suspicions()
    }

    fn checks(&self) -> Vec<Finding> {
        self.inner.checks()
    }

    fn facts(&self) -> Vec<Fact> {
        self.inner.facts()
    }
}
