//! A data set that a plugin reads in another process, behind the core's trait.

use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use vice_core::camera::Camera;
use vice_core::dataset::{CloudRef, Dataset, DepthImage, Fact, Floor, Image, OpenOptions};
use vice_core::error::{DataError, DataResult, one_line};
use vice_core::finding::{Finding, State};
use vice_core::frames::BodyFromCamera;
use vice_core::imu::{ImuSample, InertialState};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

use super::calls;
use super::codec::{Carried, Reader, Writer};
use super::process::Process;
use super::values::{Frames, Samples};

/// An open data set; its process ends when it is dropped.
pub(super) struct IsolatedDataset {
    process: Process,
    format: String,
    opened: Opened,
    frames: Mutex<Vec<(String, Arc<[Stamp]>)>>,
    imu: OnceLock<Arc<[ImuSample]>>,
}

/// What an opened data set has.
struct Opened {
    name: String,
    cameras: Vec<String>,
    has_depth: Vec<bool>,
    streams: Vec<String>,
    relative: Vec<bool>,
}

impl Carried for Opened {
    fn put(&self, out: &mut Writer) {
        out.put(&self.name)
            .list(&self.cameras)
            .list(&self.has_depth)
            .list(&self.streams)
            .list(&self.relative);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, String> {
        Ok(Self {
            name: from.get()?,
            cameras: from.list()?,
            has_depth: from.list()?,
            streams: from.list()?,
            relative: from.list()?,
        })
    }
}

/// A list as the whole answer.
struct List<T>(Vec<T>);

impl<T: Carried> Carried for List<T> {
    fn put(&self, out: &mut Writer) {
        out.list(&self.0);
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, String> {
        from.list().map(Self)
    }
}

/// The bytes of a stored file, where there is one.
struct Stored(Option<Vec<u8>>);

impl Carried for Stored {
    fn put(&self, out: &mut Writer) {
        out.put(&self.0.is_some()).bytes(self.0.as_deref().unwrap_or_default());
    }

    fn take(from: &mut Reader<'_>) -> Result<Self, String> {
        let is_there = from.get()?;
        let bytes = from.bytes()?;
        if is_there { crate::values::image_file(bytes).map(|file| Self(Some(file))) } else { Ok(Self(None)) }
    }
}

fn request(call: u8) -> Writer {
    let mut request = Writer::default();
    request.put(&call);
    request
}

/// A call about something with a name.
fn named(call: u8, name: &str) -> Writer {
    let mut request = request(call);
    request.put(&name.to_string());
    request
}

impl IsolatedDataset {
    pub(super) fn open(
        process: Process,
        format: String,
        path: &Path,
        options: &OpenOptions,
    ) -> DataResult<Self> {
        let settings: Vec<[String; 2]> =
            options.settings.iter().map(|(key, value)| [key.clone(), value.clone()]).collect();
        let mut open = request(calls::OPEN);
        open.put(&path.to_path_buf()).list(&settings);
        let opened = process.ask(&format!("opening {}", path.display()), &open)?;
        Ok(Self { process, format, opened, frames: Mutex::default(), imu: OnceLock::new() })
    }
}

impl Dataset for IsolatedDataset {
    fn name(&self) -> &str {
        &self.opened.name
    }

    fn format(&self) -> &str {
        &self.format
    }

    fn cameras(&self) -> Vec<String> {
        self.opened.cameras.clone()
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        self.process.ask(&format!("calibration of camera {camera}"), &named(calls::CAMERA, camera))
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        let mut known = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, frames)) = known.iter().find(|(name, _)| name == camera) {
            return Ok(Arc::clone(frames));
        }
        let found = self.process.ask(&format!("frames of camera {camera}"), &named(calls::FRAMES, camera));
        let frames: Arc<[Stamp]> = found.map(|Frames(frames)| frames)?.into();
        known.push((camera.to_string(), Arc::clone(&frames)));
        Ok(frames)
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        let mut request = named(calls::IMAGE, camera);
        request.put(&(index as u64));
        self.process.ask(&format!("image {index} of camera {camera}"), &request)
    }

    fn image_file(&self, camera: &str, index: usize) -> DataResult<Option<Vec<u8>>> {
        let mut request = named(calls::IMAGE_FILE, camera);
        request.put(&(index as u64));
        let what = format!("stored image {index} of camera {camera}");
        self.process.ask(&what, &request).map(|Stored(file)| file)
    }

    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera> {
        let mut request = named(calls::BODY_FROM_CAMERA, camera);
        request.put(&stamp);
        self.process.ask(&format!("body_from_camera of camera {camera} at {stamp} ns"), &request)
    }

    fn streams(&self) -> Vec<String> {
        self.opened.streams.clone()
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        self.process.ask(&format!("pose stream {stream}"), &named(calls::TRAJECTORY, stream))
    }

    fn is_relative(&self, stream: &str) -> bool {
        let mut each = self.opened.streams.iter().zip(&self.opened.relative);
        each.any(|(name, relative)| name == stream && *relative)
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        if let Some(samples) = self.imu.get() {
            return Ok(Arc::clone(samples));
        }
        let Samples(samples) = self.process.ask("inertial samples", &request(calls::IMU))?;
        Ok(Arc::clone(self.imu.get_or_init(|| samples.into())))
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        let mut request = request(calls::INERTIAL_STATE);
        request.put(&stamp);
        self.process.ask(&format!("inertial state at {stamp} ns"), &request)
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        let mut request = named(calls::DEPTH_IMAGE, camera);
        request.put(&(index as u64));
        self.process.ask(&format!("depth image {index} of camera {camera}"), &request)
    }

    fn has_depth(&self, camera: &str) -> bool {
        let mut each = self.opened.cameras.iter().zip(&self.opened.has_depth);
        each.any(|(name, has_depth)| name == camera && *has_depth)
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        self.process.ask("cloud", &request(calls::CLOUD))
    }

    fn floor(&self, keyframe: Stamp) -> DataResult<Floor> {
        let mut request = request(calls::FLOOR);
        request.put(&keyframe);
        self.process.ask(&format!("floor at {keyframe} ns"), &request)
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        let asked: DataResult<List<Suspicion>> = self.process.ask("suspicions", &request(calls::SUSPICIONS));
        // What a plugin fails to say must not be taken for all being well.
        asked.map_or_else(
            |error| vec![Suspicion::new("plugin-fault", self.format(), one_line(&error))],
            |List(found)| found,
        )
    }

    fn checks(&self) -> Vec<Finding> {
        let asked: DataResult<List<Finding>> = self.process.ask("checks", &request(calls::CHECKS));
        let failed = |error: DataError| {
            let says = format!("its own checks failed: {}", one_line(&error));
            vec![Finding::new("plugin-fault", self.format(), State::Look, says)]
        };
        asked.map_or_else(failed, |List(found)| found)
    }

    fn facts(&self) -> Vec<Fact> {
        let asked: DataResult<List<Fact>> = self.process.ask("facts", &request(calls::FACTS));
        asked.map_or_else(
            |error| {
                tracing::warn!("{error}");
                Vec::new()
            },
            |List(facts)| facts,
        )
    }
}
