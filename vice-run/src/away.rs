//! A data set that lies elsewhere: what stands here for it is kept, and what it says names its address.

use std::sync::Arc;

use vice_core::camera::Camera;
use vice_core::dataset::{CloudRef, Dataset, DepthImage, Fact, Floor, Image};
use vice_core::error::DataResult;
use vice_core::finding::Finding;
use vice_core::frames::BodyFromCamera;
use vice_core::imu::{ImuSample, InertialState};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_core::trajectory::{PoseCovariance, Trajectory};

use crate::place::Place;

/// A data set and the place that it is read from.
pub(crate) struct Away {
    pub(crate) inner: Box<dyn Dataset>,
    pub(crate) place: Place<'static>,
}

impl Dataset for Away {
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
        self.place.told(self.inner.camera(camera))
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        self.place.told(self.inner.frames(camera))
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        self.place.told(self.inner.image(camera, index))
    }

    fn image_file(&self, camera: &str, index: usize) -> DataResult<Option<Vec<u8>>> {
        self.place.told(self.inner.image_file(camera, index))
    }

    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera> {
        self.place.told(self.inner.body_from_camera(camera, stamp))
    }

    fn streams(&self) -> Vec<String> {
        self.inner.streams()
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        self.place.told(self.inner.trajectory(stream))
    }

    fn pose_covariances(&self, stream: &str) -> DataResult<Vec<PoseCovariance>> {
        self.inner.pose_covariances(stream)
    }

    fn is_relative(&self, stream: &str) -> bool {
        self.inner.is_relative(stream)
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        self.place.told(self.inner.imu())
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        self.place.told(self.inner.inertial_state(stamp))
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        self.place.told(self.inner.depth_image(camera, index))
    }

    fn has_depth(&self, camera: &str) -> bool {
        self.inner.has_depth(camera)
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        self.place.told(self.inner.cloud())
    }

    fn mesh(&self) -> DataResult<Option<CloudRef>> {
        self.place.told(self.inner.mesh())
    }

    fn floor(&self, keyframe: Stamp) -> DataResult<Floor> {
        self.place.told(self.inner.floor(keyframe))
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        let words = |text: &str| self.place.in_words(text);
        let told = |s: Suspicion| Suspicion {
            about: words(&s.about),
            message: words(&s.message),
            evidence: words(&s.evidence),
            advice: words(&s.advice),
            ..s
        };
        self.inner.suspicions().into_iter().map(told).collect()
    }

    fn checks(&self) -> Vec<Finding> {
        let words = |text: &str| self.place.in_words(text);
        let told =
            |f: Finding| Finding { about: words(&f.about), says: words(&f.says), mend: words(&f.mend), ..f };
        self.inner.checks().into_iter().map(told).collect()
    }

    fn facts(&self) -> Vec<Fact> {
        let facts = self.inner.facts().into_iter();
        facts.map(|fact| Fact { text: self.place.in_words(&fact.text), ..fact }).collect()
    }
}
