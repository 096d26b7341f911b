//! What an evaluation asks of the robot: names, where the camera sits in the body, and the floor.

use crate::dataset::{Dataset, Floor, Plane};
use crate::error::DataResult;
use crate::frames::BodyFromCamera;
use crate::suspicion::Suspicion;
use crate::time::Stamp;

/// The robot's camera and its floor. [`FixedRig`] holds them as values, [`DatasetRig`] asks a [`Dataset`].
pub trait Rig: Send + Sync {
    /// Name of the run in tables and documents.
    fn name(&self) -> &str;

    /// Name of the format that the run was read from.
    fn format(&self) -> &str;

    /// Name of the camera.
    fn camera_name(&self) -> &str;

    /// Pose of the camera in the body at a stamp: a function of time, since heads pan and tilt.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if it is unknown at that stamp. The frame is skipped and counted.
    fn body_from_camera(&self, stamp: Stamp) -> DataResult<BodyFromCamera>;

    /// The floor as it is known at a key frame.
    ///
    /// # Errors
    /// [`DataError`](crate::error::DataError) if it is unknown at that stamp.
    fn floor(&self, keyframe: Stamp) -> DataResult<Floor>;

    /// What looked wrong in the data that was read so far. Asked when all was read.
    fn suspicions(&self) -> Vec<Suspicion> {
        Vec::new()
    }
}

/// A camera that is bolted to the body, over a floor that does not change: for data that is in memory already.
#[derive(Clone, Debug, PartialEq)]
pub struct FixedRig {
    /// Name of the run.
    pub name: String,
    /// Name of the camera.
    pub camera_name: String,
    /// Pose of the camera in the body: metres, z along the optical axis, x to the right in the image.
    pub body_from_camera: BodyFromCamera,
    /// The floor. Depth sources that do not ask for a floor never look at it.
    pub floor: Floor,
}

impl FixedRig {
    /// A camera over the floor z = 0 of the world, named `camera` in a run named `run`.
    pub fn new(body_from_camera: BodyFromCamera) -> Self {
        Self {
            name: "run".to_string(),
            camera_name: "camera".to_string(),
            body_from_camera,
            floor: Floor::World(Plane::z_zero()),
        }
    }
}

impl Rig for FixedRig {
    fn name(&self) -> &str {
        &self.name
    }

    fn format(&self) -> &'static str {
        "memory"
    }

    fn camera_name(&self) -> &str {
        &self.camera_name
    }

    fn body_from_camera(&self, _: Stamp) -> DataResult<BodyFromCamera> {
        Ok(self.body_from_camera)
    }

    fn floor(&self, _: Stamp) -> DataResult<Floor> {
        Ok(self.floor)
    }
}

/// One camera of a data set. What a user overrides of it is a [`Calibrated`](crate::dataset::Calibrated) around it.
#[derive(Clone, Copy)]
pub struct DatasetRig<'a> {
    dataset: &'a dyn Dataset,
    camera_name: &'a str,
}

impl<'a> DatasetRig<'a> {
    /// The camera of that name.
    pub const fn new(dataset: &'a dyn Dataset, camera_name: &'a str) -> Self {
        Self { dataset, camera_name }
    }
}

impl Rig for DatasetRig<'_> {
    fn name(&self) -> &str {
        self.dataset.name()
    }

    fn format(&self) -> &str {
        self.dataset.format()
    }

    fn camera_name(&self) -> &str {
        self.camera_name
    }

    fn body_from_camera(&self, stamp: Stamp) -> DataResult<BodyFromCamera> {
        self.dataset.body_from_camera(self.camera_name, stamp)
    }

    fn floor(&self, keyframe: Stamp) -> DataResult<Floor> {
        self.dataset.floor(keyframe)
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        self.dataset.suspicions()
    }
}
