//! A data set of a plugin behind the core's trait.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use vice_abi::contract::{self, Text};
use vice_core::camera::Camera;
use vice_core::dataset::{
    CloudRef, CloudSource, Dataset, DepthImage, Fact, Floor, Image, OpenOptions, Plane, Probe,
};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::BodyFromCamera;
use vice_core::imu::{ImuSample, InertialState};
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;

use crate::ask::{MISTAKE, ask, must};
use crate::border::{self, Fault};
use crate::library::Library;
use crate::values;

/// Asks a plugin about a path.
pub(crate) fn probe(library: &Library, path: &Path) -> DataResult<Probe> {
    must(
        library,
        &|| "probe".to_string(),
        // SAFETY: the path lives during the call, the rest is as the contract says.
        |out, message| unsafe { (library.calls.probe)(Text::from_path(path), out, message) },
        |probe: &contract::Probe| match probe.answer {
            contract::PROBE_NO => Ok(Probe::No),
            contract::PROBE_YES => Ok(Probe::Yes),
            contract::PROBE_COLLECTION => {
                // SAFETY: the plugin's promise.
                let paths = unsafe { border::list(probe.paths, probe.count, "paths") }?;
                if paths.is_empty() {
                    return Err("a collection of no data sets".to_string());
                }
                // SAFETY: the plugin's promise.
                let path = |p: &Text| unsafe { border::path(*p, "a path of the collection") };
                Ok(Probe::Collection(paths.iter().map(path).collect::<Result<_, _>>()?))
            }
            other => Err(format!("the answer {other} is none of the contract's")),
        },
    )
}

/// An open data set of a plugin, closed when it is dropped.
pub(crate) struct PluginDataset {
    library: Arc<Library>,
    handle: Handle,
    name: String,
    cameras: Vec<CameraEntry>,
    streams: Vec<StreamEntry>,
    imu: OnceLock<Arc<[ImuSample]>>,
}

struct CameraEntry {
    name: String,
    has_depth: bool,
    frames: OnceLock<Arc<[Stamp]>>,
}

struct StreamEntry {
    name: String,
    relative: bool,
}

/// What the plugin calls a data set.
pub(crate) struct Handle {
    library: Arc<Library>,
    dataset: *mut c_void,
}

// SAFETY: the contract lets calls on a data set come from any thread, and they overlap only where the plugin allows it.
unsafe impl Send for Handle {}
// SAFETY: as above.
unsafe impl Sync for Handle {}

impl Drop for Handle {
    fn drop(&mut self) {
        let _turn = self.library.turn();
        // SAFETY: open, and closed once; nobody else has it any more.
        unsafe { (self.library.calls.close)(self.dataset) };
    }
}

impl Handle {
    pub(crate) fn open(library: &Arc<Library>, path: &Path, options: &OpenOptions) -> DataResult<Self> {
        let settings: Vec<contract::Setting> = options
            .settings
            .iter()
            .map(|(key, value)| contract::Setting {
                key: Text::from_bytes(key.as_bytes()),
                value: Text::from_bytes(value.as_bytes()),
            })
            .collect();
        must(
            library,
            &|| format!("opening {}", path.display()),
            // SAFETY: path and settings live during the call, the rest is as the contract says.
            |out, message| unsafe {
                let path = Text::from_path(path);
                (library.calls.open)(path, settings.as_ptr(), settings.len(), out, message)
            },
            |dataset: &*mut c_void| match dataset.is_null() {
                true => Err("the data set is null".to_string()),
                false => Ok(Self { library: Arc::clone(library), dataset: *dataset }),
            },
        )
    }

    pub(crate) const fn raw(&self) -> *mut c_void {
        self.dataset
    }
}

impl PluginDataset {
    pub(crate) fn open(library: &Arc<Library>, path: &Path, options: &OpenOptions) -> DataResult<Self> {
        let handle = Handle::open(library, path, options)?;
        let (name, cameras, streams) = must(
            library,
            &|| "describe".to_string(),
            // SAFETY: an open data set.
            |out, message| unsafe { (library.calls.describe)(handle.raw(), out, message) },
            |info: &contract::DatasetInfo| {
                // SAFETY: the plugin's promise.
                let name = unsafe { border::name(info.name, "the data set's name") }?;
                // SAFETY: the plugin's promise.
                let cameras = unsafe { border::list(info.cameras, info.camera_count, "cameras") }?;
                // SAFETY: the plugin's promise.
                let streams = unsafe { border::list(info.streams, info.stream_count, "streams") }?;
                let cameras = cameras.iter().map(camera_entry).collect::<Result<Vec<_>, _>>()?;
                let streams = streams.iter().map(stream_entry).collect::<Result<Vec<_>, _>>()?;
                unique(cameras.iter().map(|c| c.name.as_str()), "cameras")?;
                unique(streams.iter().map(|s| s.name.as_str()), "pose streams")?;
                Ok((name, cameras, streams))
            },
        )?;
        Ok(Self { library: Arc::clone(library), handle, name, cameras, streams, imu: OnceLock::new() })
    }

    fn find_camera(&self, camera: &str) -> DataResult<(usize, &CameraEntry)> {
        self.cameras.iter().enumerate().find(|(_, c)| c.name == camera).ok_or_else(|| {
            DataError::new(format!("there is no camera `{camera}`"))
                .hint(format!("known: {}", self.cameras().join(", ")))
        })
    }

    fn frames_of(&self, index: usize, entry: &CameraEntry) -> DataResult<Arc<[Stamp]>> {
        let stamps = must(
            &self.library,
            &|| format!("frames of camera {}", entry.name),
            // SAFETY: an open data set.
            |out, message| unsafe { (self.library.calls.frames)(self.handle.raw(), index, out, message) },
            // SAFETY: the plugin's promise.
            |s: &contract::Stamps| values::frames(unsafe { border::list(s.stamps_ns, s.count, "stamps") }?),
        )?;
        Ok(stamps.into())
    }
}

fn camera_entry(entry: &contract::CameraEntry) -> Result<CameraEntry, Fault> {
    // SAFETY: the plugin's promise.
    let name = unsafe { border::name(entry.name, "the name of a camera") }?;
    Ok(CameraEntry {
        name,
        has_depth: entry.flags & contract::CAMERA_HAS_DEPTH != 0,
        frames: OnceLock::new(),
    })
}

fn stream_entry(entry: &contract::StreamEntry) -> Result<StreamEntry, Fault> {
    // SAFETY: the plugin's promise.
    let name = unsafe { border::name(entry.name, "the name of a pose stream") }?;
    match entry.kind {
        contract::STREAM_POSES => Ok(StreamEntry { name, relative: false }),
        contract::STREAM_RELATIVE => Ok(StreamEntry { name, relative: true }),
        other => Err(format!("kind {other} of the pose stream {name} is none of the contract's")),
    }
}

fn unique<'a>(names: impl Iterator<Item = &'a str>, what: &str) -> Result<(), Fault> {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    match names.windows(2).find(|w| w[0] == w[1]) {
        Some(twice) => Err(format!("two {what} have the name `{}`", twice[0])),
        None => Ok(()),
    }
}

impl Dataset for PluginDataset {
    fn name(&self) -> &str {
        &self.name
    }

    fn format(&self) -> &str {
        &self.library.info.name
    }

    fn cameras(&self) -> Vec<String> {
        self.cameras.iter().map(|c| c.name.clone()).collect()
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        let (index, _) = self.find_camera(camera)?;
        must(
            &self.library,
            &|| format!("calibration of camera {camera}"),
            // SAFETY: an open data set.
            |out, message| unsafe { (self.library.calls.camera)(self.handle.raw(), index, out, message) },
            values::camera,
        )
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        let (index, entry) = self.find_camera(camera)?;
        if let Some(frames) = entry.frames.get() {
            return Ok(Arc::clone(frames));
        }
        let frames = self.frames_of(index, entry)?;
        Ok(Arc::clone(entry.frames.get_or_init(|| frames)))
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        let (place, _) = self.find_camera(camera)?;
        must(
            &self.library,
            &|| format!("image {index} of camera {camera}"),
            // SAFETY: an open data set.
            |out, message| unsafe {
                (self.library.calls.image)(self.handle.raw(), place, index, out, message)
            },
            |image: &contract::Image| {
                let format = values::pixel_format(image.format)?;
                let size = (image.width_px, image.height_px);
                let rows = values::Rows::new(size, format.bytes(), image.row_stride_bytes, image.data_bytes)?;
                // SAFETY: the plugin's promise.
                let data = unsafe { border::list(image.data, image.data_bytes, "bytes of the image") }?;
                values::image(&rows, format, data)
            },
        )
    }

    fn body_from_camera(&self, camera: &str, stamp: Stamp) -> DataResult<BodyFromCamera> {
        let (index, _) = self.find_camera(camera)?;
        must(
            &self.library,
            &|| format!("body_from_camera of camera {camera} at {stamp} ns"),
            // SAFETY: an open data set.
            |out, message| unsafe {
                let call = self.library.calls.body_from_camera;
                call(self.handle.raw(), index, stamp.as_nanos(), out, message)
            },
            values::rigid,
        )
    }

    fn streams(&self) -> Vec<String> {
        self.streams.iter().map(|s| s.name.clone()).collect()
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        let found = self.streams.iter().enumerate().find(|(_, s)| s.name == stream);
        let (index, entry) = found.ok_or_else(|| {
            let known = self.streams();
            let known = if known.is_empty() { "none".to_string() } else { known.join(", ") };
            DataError::new(format!("there is no pose stream `{stream}`")).hint(format!("known: {known}"))
        })?;
        let what = || format!("pose stream {stream}");
        if !entry.relative {
            return must(
                &self.library,
                &what,
                // SAFETY: an open data set.
                |out, message| unsafe {
                    (self.library.calls.trajectory)(self.handle.raw(), index, out, message)
                },
                // SAFETY: the plugin's promise.
                |p: &contract::Poses| values::trajectory(unsafe { border::list(p.poses, p.count, "poses") }?),
            );
        }
        let Some(call) = self.library.calls.optional.relative_motions else {
            return Err(DataError::new(format!("{}: the call `relative_motions` is null", what()))
                .at(&self.library.path)
                .hint(MISTAKE));
        };
        must(
            &self.library,
            &what,
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), index, out, message) },
            // SAFETY: the plugin's promise.
            |m: &contract::Motions| values::chained(unsafe { border::list(m.motions, m.count, "motions") }?),
        )
    }

    fn is_relative(&self, stream: &str) -> bool {
        self.streams.iter().any(|s| s.name == stream && s.relative)
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        if let Some(samples) = self.imu.get() {
            return Ok(Arc::clone(samples));
        }
        let Some(call) = self.library.calls.optional.imu else { return Ok(Arc::new([])) };
        let samples = ask(
            &self.library,
            &|| "inertial samples".to_string(),
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), out, message) },
            // SAFETY: the plugin's promise.
            |s: &contract::ImuSamples| values::imu(unsafe { border::list(s.samples, s.count, "samples") }?),
        )?;
        let samples: Arc<[ImuSample]> = samples.unwrap_or_default().into();
        Ok(Arc::clone(self.imu.get_or_init(|| samples)))
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        let Some(call) = self.library.calls.optional.inertial_state else { return Ok(None) };
        ask(
            &self.library,
            &|| format!("inertial state at {stamp} ns"),
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), stamp.as_nanos(), out, message) },
            values::inertial_state,
        )
    }

    fn depth_image(&self, camera: &str, index: usize) -> DataResult<Option<DepthImage>> {
        let (place, _) = self.find_camera(camera)?;
        let Some(call) = self.library.calls.optional.depth_image else { return Ok(None) };
        ask(
            &self.library,
            &|| format!("depth image {index} of camera {camera}"),
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), place, index, out, message) },
            |depth: &contract::DepthImage| {
                let size = (depth.width_px, depth.height_px);
                if !depth.row_stride_bytes.is_multiple_of(4) {
                    return Err(format!("the stride {} is no multiple of 4", depth.row_stride_bytes));
                }
                let rows = values::Rows::new(size, 4, depth.row_stride_bytes, depth.data_bytes)?;
                // SAFETY: the plugin's promise.
                let z_m = unsafe { border::list(depth.z_m, depth.data_bytes / 4, "depth values") }?;
                values::depth(depth.stamp_ns, &rows, z_m)
            },
        )
    }

    fn has_depth(&self, camera: &str) -> bool {
        self.library.calls.optional.depth_image.is_some()
            && self.cameras.iter().any(|c| c.name == camera && c.has_depth)
    }

    fn cloud(&self) -> DataResult<Option<CloudRef>> {
        let Some(call) = self.library.calls.optional.cloud else { return Ok(None) };
        ask(
            &self.library,
            &|| "cloud".to_string(),
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), out, message) },
            |cloud: &contract::Cloud| {
                let source = match cloud.kind {
                    // SAFETY: the plugin's promise.
                    contract::CLOUD_PLY => {
                        CloudSource::Ply(unsafe { border::path(cloud.ply_path, "the path") }?)
                    }
                    contract::CLOUD_POINTS => {
                        // SAFETY: the plugin's promise.
                        let points = unsafe { border::list(cloud.points, cloud.count, "points") }?;
                        CloudSource::Points(values::points(points).into())
                    }
                    other => return Err(format!("kind {other} is none of the contract's")),
                };
                Ok(CloudRef { source, world_from_cloud: values::rigid(&cloud.world_from_cloud)? })
            },
        )
    }

    fn floor(&self, keyframe: Stamp) -> DataResult<Floor> {
        let flat = Floor::World(Plane::z_zero());
        let Some(call) = self.library.calls.optional.floor else { return Ok(flat) };
        let floor = ask(
            &self.library,
            &|| format!("floor at {keyframe} ns"),
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), keyframe.as_nanos(), out, message) },
            values::floor,
        )?;
        Ok(floor.unwrap_or(flat))
    }

    fn facts(&self) -> Vec<Fact> {
        let Some(call) = self.library.calls.optional.facts else { return Vec::new() };
        let facts = ask(
            &self.library,
            &|| "facts".to_string(),
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), out, message) },
            |facts: &contract::Facts| {
                // SAFETY: the plugin's promise.
                let facts = unsafe { border::list(facts.facts, facts.count, "facts") }?;
                facts
                    .iter()
                    // SAFETY: the plugin's promise.
                    .map(|f| unsafe {
                        Ok(Fact {
                            section: border::text(f.section, "the heading of a fact")?,
                            text: border::text(f.text, "the text of a fact")?,
                        })
                    })
                    .collect()
            },
        );
        match facts {
            Ok(facts) => facts.unwrap_or_default(),
            Err(error) => {
                tracing::warn!("{error}");
                Vec::new()
            }
        }
    }
}
