//! A data set of a plugin behind the core's trait.
#![allow(unsafe_code)]

use std::path::Path;
use std::sync::{Arc, OnceLock};

use vice_abi::contract;
use vice_core::camera::Camera;
use vice_core::dataset::{
    CloudRef, CloudSource, Dataset, DepthImage, Fact, Floor, Image, OpenOptions, Plane,
};
use vice_core::error::{DataError, DataResult, one_line};
use vice_core::finding::{Finding, State};
use vice_core::frames::BodyFromCamera;
use vice_core::imu::{ImuSample, InertialState};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;
use vice_files::image_file;

use crate::ask::{MISTAKE, ask, must};
use crate::border;
use crate::description::{CameraEntry, Description, StreamEntry, StreamKind, describe};
use crate::handle::Handle;
use crate::library::Library;
use crate::values;

/// An open data set of a plugin, closed when it is dropped.
pub(crate) struct PluginDataset {
    library: Arc<Library>,
    handle: Handle,
    name: String,
    cameras: Vec<CameraEntry>,
    streams: Vec<StreamEntry>,
    imu: OnceLock<Arc<[ImuSample]>>,
}

impl PluginDataset {
    pub(crate) fn open(library: &Arc<Library>, path: &Path, options: &OpenOptions) -> DataResult<Self> {
        let handle = Handle::open(library, path, options)?;
        let Description { name, cameras, streams } = describe(&handle)?;
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
        let what = || format!("image {index} of camera {camera}");
        let image = ask(
            &self.library,
            &what,
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
        )?;
        if let Some(image) = image {
            return Ok(image);
        }
        match self.image_file(camera, index)? {
            Some(file) => image_file::decode(&file)
                .map_err(|e| DataError::of_kind(e.kind(), format!("{}: {}", what(), one_line(&e)))),
            None => Err(DataError::new(format!(
                "{}: the call returned VICE_NONE, which it must not where there is no `image_file`",
                what()
            ))
            .at(&self.library.path)
            .hint(MISTAKE)),
        }
    }

    fn image_file(&self, camera: &str, index: usize) -> DataResult<Option<Vec<u8>>> {
        let (place, _) = self.find_camera(camera)?;
        let Some(call) = self.library.calls.optional.image_file else { return Ok(None) };
        ask(
            &self.library,
            &|| format!("stored image {index} of camera {camera}"),
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), place, index, out, message) },
            |file: &contract::ImageFile| {
                // SAFETY: the plugin's promise.
                values::image_file(unsafe { border::list(file.data, file.data_bytes, "bytes of the file") }?)
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
        if entry.kind != StreamKind::Motions {
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
        self.streams.iter().any(|s| s.name == stream && s.kind != StreamKind::Poses)
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
                        CloudSource::File(unsafe { border::path(cloud.ply_path, "the path") }?)
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

    fn suspicions(&self) -> Vec<Suspicion> {
        let Some(call) = self.library.calls.optional.suspicions else { return Vec::new() };
        let suspicions = ask(
            &self.library,
            &|| "suspicions".to_string(),
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), out, message) },
            |list: &contract::Suspicions| {
                // SAFETY: the plugin's promise.
                let list = unsafe { border::list(list.suspicions, list.count, "suspicions") }?;
                // SAFETY: the plugin's promise.
                list.iter().map(|s| unsafe { values::suspicion(s) }).collect()
            },
        );
        // What a plugin fails to say must not be taken for all being well.
        suspicions.map_or_else(
            |error| vec![Suspicion::new("plugin-fault", self.format(), one_line(&error))],
            Option::unwrap_or_default,
        )
    }

    fn checks(&self) -> Vec<Finding> {
        let Some(call) = self.library.calls.optional.checks else { return Vec::new() };
        let findings = ask(
            &self.library,
            &|| "checks".to_string(),
            // SAFETY: an open data set.
            |out, message| unsafe { call(self.handle.raw(), out, message) },
            |list: &contract::Findings| {
                // SAFETY: the plugin's promise.
                let list = unsafe { border::list(list.findings, list.count, "findings") }?;
                // SAFETY: the plugin's promise.
                list.iter().map(|f| unsafe { values::finding(f) }).collect()
            },
        );
        findings.map_or_else(
            |error| {
                let says = format!("its own checks failed: {}", one_line(&error));
                vec![Finding::new("plugin-fault", self.format(), State::Look, says)]
            },
            Option::unwrap_or_default,
        )
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
