//! A described folder behind the core's [`Dataset`].

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use vice_core::camera::Camera;
use vice_core::dataset::{CloudRef, Dataset, DepthImage, Fact, Floor, Image, depth_unit_doubt};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::frames::BodyFromCamera;
use vice_core::imu::ImuSample;
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;
use vice_files::once::cached;
use vice_files::{image_file, pairing};

use crate::NAME;
use crate::files::name;
use crate::parts::{CameraPart, DepthPart, Description, Frames, Intrinsics, Place, Poses, Samples};

/// Pictures that are looked for, at most, to see how large they are.
const MOST_LOOKED_AT: usize = 100;

/// An opened folder.
pub(crate) struct Folder {
    description: Description,
    cameras: Vec<Known>,
    streams: Vec<OnceLock<Poses>>,
    imu: OnceLock<Samples>,
    cloud: OnceLock<CloudRef>,
    /// What looked wrong while depth images were read.
    doubts: Mutex<Suspicions>,
}

/// What was read of a camera.
#[derive(Default)]
struct Known {
    frames: OnceLock<Frames>,
    intrinsics: OnceLock<Intrinsics>,
    camera: OnceLock<Camera>,
    place: OnceLock<BodyFromCamera>,
    depth: OnceLock<Frames>,
}

impl Folder {
    pub(crate) fn new(description: Description) -> Self {
        Self {
            cameras: description.cameras.iter().map(|_| Known::default()).collect(),
            streams: description.streams.iter().map(|_| OnceLock::new()).collect(),
            imu: OnceLock::new(),
            cloud: OnceLock::new(),
            doubts: Mutex::default(),
            description,
        }
    }

    fn find(&self, camera: &str) -> DataResult<(&CameraPart, &Known)> {
        let parts = self.description.cameras.iter().zip(&self.cameras);
        parts.into_iter().find(|(part, _)| part.name == camera).ok_or_else(|| {
            DataError::of_kind(ErrorKind::Missing, format!("there is no camera `{camera}`"))
                .at(&self.description.root)
                .hint(format!("known: {}", self.cameras().join(", ")))
        })
    }

    fn frames_of(&self, camera: &str) -> DataResult<&Frames> {
        let (part, known) = self.find(camera)?;
        cached(&known.frames, || (part.frames)())
    }

    /// Size of the first picture that is there, and its path.
    fn first_picture(&self, camera: &str) -> Option<(String, (u32, u32))> {
        let frames = self.frames_of(camera).ok()?;
        // One that is missing is mostly one of many: looking for it at all of them would be slow.
        let few = frames.files.iter().take(MOST_LOOKED_AT);
        let shown = |path: &std::path::Path| path.display().to_string();
        few.into_iter().find_map(|path| image_file::dimensions(path).ok().map(|size| (shown(path), size)))
    }

    fn intrinsics(&self, camera: &str) -> DataResult<Camera> {
        let (part, known) = self.find(camera)?;
        let intrinsics = cached(&known.intrinsics, || (part.intrinsics)())?;
        let picture = self.first_picture(camera);
        let size = match (intrinsics.size, &picture) {
            (Some(size), Some((path, (w, h)))) if size != [*w, *h] => {
                return Err(DataError::of_kind(
                    ErrorKind::Contradictory,
                    format!("the calibration of {camera} is of {}x{} images, but {path} has {w}x{h} pixels", size[0], size[1]),
                )
                .at(&intrinsics.from)
                .hint("were the images made smaller? Then size and intrinsics are smaller too: there, or in a --calibration"));
            }
            (Some(size), _) => size,
            (None, Some((_, (w, h)))) => [*w, *h],
            (None, None) => {
                // Why there is no picture is what has to be known.
                let frames = self.frames_of(camera)?;
                let first = frames.file(0)?;
                return Err(DataError::of_kind(
                    ErrorKind::Missing,
                    "the size of the images is not known: no picture is there",
                )
                .at(first));
            }
        };
        let camera = Camera::new(size[0], size[1], intrinsics.fx_fy_cx_cy, intrinsics.model);
        camera.map_err(|e| DataError::of(e).at(&intrinsics.from))
    }

    fn depth_of(
        &self,
        part: &DepthPart,
        known: &Known,
        camera: &str,
        index: usize,
    ) -> DataResult<Option<DepthImage>> {
        let frames = self.frames_of(camera)?;
        frames.file(index)?;
        let depth = cached(&known.depth, || (part.frames)())?;
        let Some(nearest) = pairing::belonging(&frames.stamps, index, &depth.stamps) else { return Ok(None) };
        let path = depth.file(nearest)?;
        let bytes = image_file::read_bytes(path)?;
        let image = image_file::decode_depth_png(&bytes, depth.stamps[nearest], part.metres_per_count);
        let image = without(image.map_err(|e| e.at(path))?, part);
        let (width, height) = (image.width(), image.height());
        // A folder whose calibration stands outside of it has pictures all the same.
        let known = self.camera(camera).ok().map(|c| (c.width(), c.height()));
        let size = known.or_else(|| self.first_picture(camera).map(|(_, size)| size));
        if let Some((w, h)) = size.filter(|size| *size != (width, height)) {
            return Err(DataError::of_kind(
                ErrorKind::Contradictory,
                format!("the depth image has {width}x{height} pixels, the images of {camera} {w}x{h}"),
            )
            .at(path)
            .hint("depth images have to be registered to the camera, pixel by pixel"));
        }
        self.doubt(part, name(path.parent().unwrap_or(path)), &image);
        Ok(Some(image))
    }

    fn doubt(&self, part: &DepthPart, about: String, image: &DepthImage) {
        let Some(mut doubt) = depth_unit_doubt(image) else { return };
        doubt.about = about;
        let counts = 1.0 / part.metres_per_count;
        doubt.advice = format!(
            "{counts} counts a metre are read ({}): `depth_scale` in vice.toml says another number",
            part.from
        );
        self.doubts.lock().unwrap_or_else(PoisonError::into_inner).extend([doubt]);
    }
}

/// The image without the depths of a count that is none.
fn without(image: DepthImage, part: &DepthPart) -> DepthImage {
    let Some(count) = part.invalid else { return image };
    let invalid = (f64::from(count) * part.metres_per_count) as f32;
    let (stamp, width, height) = (image.stamp, image.width(), image.height());
    let z_m = image.z_m().iter().map(|z| if *z == invalid { f32::NAN } else { *z }).collect();
    DepthImage::new(stamp, width, height, z_m).unwrap_or(image)
}

impl Dataset for Folder {
    fn name(&self) -> &str {
        &self.description.name
    }

    fn format(&self) -> &str {
        NAME
    }

    fn cameras(&self) -> Vec<String> {
        self.description.cameras.iter().map(|c| c.name.clone()).collect()
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        let (_, known) = self.find(camera)?;
        cached(&known.camera, || self.intrinsics(camera)).copied()
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        Ok(Arc::clone(&self.frames_of(camera)?.stamps))
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        image_file::read(self.frames_of(camera)?.file(index)?)
    }

    fn image_file(&self, camera: &str, index: usize) -> DataResult<Option<Vec<u8>>> {
        image_file::read_bytes(self.frames_of(camera)?.file(index)?).map(Some)
    }

    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera> {
        let (part, known) = self.find(camera)?;
        match &part.place {
            Place::Fixed(read) => cached(&known.place, read).copied(),
            Place::At(at) => at(stamp),
        }
    }

    fn streams(&self) -> Vec<String> {
        self.description.streams.iter().map(|s| s.name.clone()).collect()
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        let mut parts = self.description.streams.iter().zip(&self.streams);
        let (part, known) = parts.find(|(part, _)| part.name == stream).ok_or_else(|| {
            let known = match self.streams() {
                names if names.is_empty() => "none".to_string(),
                names => names.join(", "),
            };
            DataError::of_kind(ErrorKind::Missing, format!("there is no pose stream `{stream}`"))
                .at(&self.description.root)
                .hint(format!("known: {known}"))
        })?;
        Ok(cached(known, || (part.read)())?.trajectory.clone())
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        match &self.description.imu {
            Some(read) => Ok(Arc::clone(&cached(&self.imu, read)?.samples)),
            None => Ok(Arc::new([])),
        }
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        let (part, known) = self.find(camera)?;
        match &part.depth {
            Some(depth) => self.depth_of(depth, known, camera, index),
            None => Ok(None),
        }
    }

    fn has_depth(&self, camera: &str) -> bool {
        self.find(camera).is_ok_and(|(part, _)| part.depth.is_some())
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        self.description.cloud.as_ref().map(|read| cached(&self.cloud, read).cloned()).transpose()
    }

    fn floor(&self, _keyframe: Stamp) -> DataResult<Floor> {
        Ok(self.description.floor)
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        let mut list: Suspicions = self.description.suspicions.iter().cloned().collect();
        for known in &self.cameras {
            let frames = [&known.frames, &known.depth].into_iter().filter_map(OnceLock::get);
            list.extend(frames.flat_map(|f| f.suspicions.iter().cloned()));
            list.extend(known.intrinsics.get().into_iter().flat_map(|i| i.suspicions.iter().cloned()));
        }
        list.extend(self.streams.iter().filter_map(OnceLock::get).flat_map(|p| p.suspicions.iter().cloned()));
        list.extend(self.imu.get().into_iter().flat_map(|s| s.suspicions.iter().cloned()));
        list.extend(self.doubts.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned());
        list.into_iter().collect()
    }

    fn facts(&self) -> Vec<Fact> {
        let about = |text: String| Fact { section: "layout".into(), text };
        let layout = about(self.description.layout.to_string());
        std::iter::once(layout).chain(self.description.facts.iter().cloned().map(about)).collect()
    }
}
