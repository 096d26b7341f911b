//! The calls of the table, each a method of the core's traits behind [`guard::caught`].
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::path::PathBuf;

use vice_core::dataset::{CloudSource, Dataset, OpenOptions, Probe};
use vice_core::error::{DataError, DataResult, one_line};
use vice_core::time::Stamp;

use super::owned::{self, Facts, Texts};
use super::{factory, guard, values};
use crate::contract::{self, Message, Text};
use crate::path_from_bytes;

/// An open data set, and the lists that [`describe`] points at.
struct Open {
    dataset: Box<dyn Dataset>,
    name: String,
    cameras: Vec<String>,
    streams: Vec<String>,
    camera_entries: Vec<contract::CameraEntry>,
    stream_entries: Vec<contract::StreamEntry>,
}

impl Open {
    fn new(dataset: Box<dyn Dataset>) -> Self {
        let (name, cameras, streams) = (dataset.name().to_string(), dataset.cameras(), dataset.streams());
        let camera_entries = cameras
            .iter()
            .map(|camera| contract::CameraEntry {
                name: Text::from_bytes(camera.as_bytes()),
                flags: if dataset.has_depth(camera) { contract::CAMERA_HAS_DEPTH } else { 0 },
            })
            .collect();
        let stream_entries = streams
            .iter()
            .map(|stream| contract::StreamEntry {
                name: Text::from_bytes(stream.as_bytes()),
                kind: contract::STREAM_POSES,
                reserved: 0,
            })
            .collect();
        Self { dataset, name, cameras, streams, camera_entries, stream_entries }
    }

    fn camera(&self, index: usize) -> DataResult<&str> {
        let unknown = || DataError::new(format!("there is no camera {index}, only {}", self.cameras.len()));
        self.cameras.get(index).map(String::as_str).ok_or_else(unknown)
    }

    fn stream(&self, index: usize) -> DataResult<&str> {
        let unknown =
            || DataError::new(format!("there is no pose stream {index}, only {}", self.streams.len()));
        self.streams.get(index).map(String::as_str).ok_or_else(unknown)
    }
}

/// Runs a call: `Ok(Some)` is written, `Ok(None)` is [`contract::NONE`], an error or a panic goes to the message.
///
/// # Safety
/// `out` is null or writable; `message` is null or as [`Message::write`] wants it.
unsafe fn answer<T>(out: *mut T, message: *mut Message, call: impl FnOnce() -> DataResult<Option<T>>) -> i32 {
    let (code, text) = match guard::caught(call) {
        Ok(Ok(Some(_))) if out.is_null() => (contract::ERROR, "no place for the answer".to_string()),
        Ok(Ok(Some(value))) => {
            // SAFETY: not null, and writable by the caller's promise.
            unsafe { out.write(value) };
            return contract::OK;
        }
        Ok(Ok(None)) => return contract::NONE,
        Ok(Err(error)) => (contract::ERROR, one_line(&error)),
        Err(panic) => (contract::EXCEPTION, panic),
    };
    if !message.is_null() {
        // SAFETY: not null, and as the caller promises.
        unsafe { (*message).write(&text) };
    }
    code
}

/// # Safety
/// `dataset` is null or an open data set of [`open`].
unsafe fn opened<'a>(dataset: *mut c_void) -> DataResult<&'a Open> {
    // SAFETY: the caller's promise.
    unsafe { dataset.cast::<Open>().as_ref() }.ok_or_else(|| DataError::new("the data set is null"))
}

/// # Safety
/// As [`Text::bytes`].
unsafe fn path(text: Text) -> DataResult<PathBuf> {
    // SAFETY: the caller's promise.
    let bytes = unsafe { text.bytes() }.ok_or_else(|| DataError::new("the path is null"))?;
    path_from_bytes(bytes).ok_or_else(|| DataError::new("the path is not UTF-8"))
}

/// # Safety
/// As [`Text::bytes`].
unsafe fn string(text: Text) -> DataResult<String> {
    // SAFETY: the caller's promise.
    let bytes = unsafe { text.bytes() }.ok_or_else(|| DataError::new("a text is null"))?;
    String::from_utf8(bytes.to_vec()).map_err(|_| DataError::new("a text is not UTF-8"))
}

fn made() -> DataResult<&'static dyn vice_core::dataset::DatasetFactory> {
    factory().ok_or_else(|| DataError::new("the plugin was not asked for its table"))
}

// The safety of all calls below is what `vice_plugin.h` asks of the host: data sets are open ones of this library, texts and
// lists are readable, what is written to is writable.

pub(super) unsafe extern "C" fn probe(text: Text, out: *mut contract::Probe, message: *mut Message) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let path = unsafe { path(text) }?;
        let mut probe = contract::Probe {
            answer: contract::PROBE_NO,
            reserved: 0,
            paths: std::ptr::null(),
            count: 0,
            owner: std::ptr::null_mut(),
        };
        match made()?.probe(&path) {
            Probe::Yes => probe.answer = contract::PROBE_YES,
            Probe::Collection(paths) => {
                let texts = Texts::new(paths.into_iter().map(|p| p.into_os_string().into_encoded_bytes()));
                probe.answer = contract::PROBE_COLLECTION;
                (probe.paths, probe.count) = (texts.texts.as_ptr(), texts.texts.len());
                probe.owner = owned::give(texts);
            }
            _ => {}
        }
        Ok(Some(probe))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn open(
    text: Text,
    settings: *const contract::Setting,
    setting_count: usize,
    dataset: *mut *mut c_void,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let path = unsafe { path(text) }?;
        let mut options = OpenOptions::default();
        for place in 0..if settings.is_null() { 0 } else { setting_count } {
            // SAFETY: the host promises that many settings, and each text.
            let (key, value) = unsafe {
                let setting = *settings.add(place);
                (string(setting.key)?, string(setting.value)?)
            };
            options.settings.insert(key, value);
        }
        let open = Open::new(made()?.open(&path, &options)?);
        Ok(Some(Box::into_raw(Box::new(open)).cast::<c_void>()))
    };
    // SAFETY: the host's promise.
    unsafe { answer(dataset, message, call) }
}

pub(super) unsafe extern "C" fn close(dataset: *mut c_void) {
    if !dataset.is_null() {
        // SAFETY: made by `open`, and closed once by the host's promise.
        let open = unsafe { Box::from_raw(dataset.cast::<Open>()) };
        if let Err(panic) = guard::caught(|| drop(open)) {
            super::log::line(contract::LOG_ERROR, &panic);
        }
    }
}

pub(super) unsafe extern "C" fn describe(
    dataset: *mut c_void,
    out: *mut contract::DatasetInfo,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let open = unsafe { opened(dataset) }?;
        Ok(Some(contract::DatasetInfo {
            name: Text::from_bytes(open.name.as_bytes()),
            cameras: open.camera_entries.as_ptr(),
            camera_count: open.camera_entries.len(),
            streams: open.stream_entries.as_ptr(),
            stream_count: open.stream_entries.len(),
            owner: std::ptr::null_mut(),
        }))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn camera(
    dataset: *mut c_void,
    index: usize,
    out: *mut contract::Camera,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let open = unsafe { opened(dataset) }?;
        Ok(Some(values::camera(&open.dataset.camera(open.camera(index)?)?)))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn frames(
    dataset: *mut c_void,
    index: usize,
    out: *mut contract::Stamps,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let open = unsafe { opened(dataset) }?;
        let frames = Box::new(values::stamps(&open.dataset.frames(open.camera(index)?)?));
        let (stamps_ns, count) = (frames.as_ptr(), frames.len());
        Ok(Some(contract::Stamps { stamps_ns, count, owner: owned::give(frames) }))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn image(
    dataset: *mut c_void,
    camera: usize,
    frame: usize,
    out: *mut contract::Image,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let open = unsafe { opened(dataset) }?;
        let image = open.dataset.image(open.camera(camera)?, frame)?;
        let (width_px, height_px, pixels) = (image.width(), image.height(), image.format());
        let row = u64::from(width_px) * pixels.bytes() as u64;
        let row_stride_bytes =
            u32::try_from(row).map_err(|_| DataError::new("a row of the image is too long"))?;
        let format = values::pixel_format(pixels)?;
        let data = Box::new(image.into_data());
        Ok(Some(contract::Image {
            width_px,
            height_px,
            format,
            row_stride_bytes,
            data: data.as_ptr(),
            data_bytes: data.len(),
            owner: owned::give(data),
        }))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn body_from_camera(
    dataset: *mut c_void,
    camera: usize,
    stamp_ns: i64,
    out: *mut contract::Rigid,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let open = unsafe { opened(dataset) }?;
        let pose = open.dataset.body_from_camera(open.camera(camera)?, Stamp::from_nanos(stamp_ns))?;
        Ok(Some(values::rigid(&pose)))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn trajectory(
    dataset: *mut c_void,
    index: usize,
    out: *mut contract::Poses,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let open = unsafe { opened(dataset) }?;
        let held = Box::new(values::poses(&open.dataset.trajectory(open.stream(index)?)?));
        let (poses, count) = (held.as_ptr(), held.len());
        Ok(Some(contract::Poses { poses, count, owner: owned::give(held) }))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn imu(
    dataset: *mut c_void,
    out: *mut contract::ImuSamples,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let held = Box::new(values::imu(&unsafe { opened(dataset) }?.dataset.imu()?));
        let (samples, count) = (held.as_ptr(), held.len());
        Ok(Some(contract::ImuSamples { samples, count, owner: owned::give(held) }))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn inertial_state(
    dataset: *mut c_void,
    stamp_ns: i64,
    out: *mut contract::InertialState,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let state = unsafe { opened(dataset) }?.dataset.inertial_state(Stamp::from_nanos(stamp_ns))?;
        Ok(state.as_ref().map(values::inertial_state))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn depth_image(
    dataset: *mut c_void,
    camera: usize,
    frame: usize,
    out: *mut contract::DepthImage,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let open = unsafe { opened(dataset) }?;
        let Some(depth) = open.dataset.depth_image(open.camera(camera)?, frame)? else { return Ok(None) };
        let held = Box::new(depth);
        let row = u64::from(held.width()) * size_of::<f32>() as u64;
        Ok(Some(contract::DepthImage {
            stamp_ns: held.stamp.as_nanos(),
            width_px: held.width(),
            height_px: held.height(),
            z_m: held.z_m().as_ptr(),
            data_bytes: size_of_val(held.z_m()),
            row_stride_bytes: u32::try_from(row)
                .map_err(|_| DataError::new("a row of the depth image is too long"))?,
            reserved: 0,
            owner: owned::give(held),
        }))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn cloud(
    dataset: *mut c_void,
    out: *mut contract::Cloud,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let Some(found) = unsafe { opened(dataset) }?.dataset.cloud()? else { return Ok(None) };
        let mut cloud = contract::Cloud {
            kind: contract::CLOUD_PLY,
            reserved: 0,
            ply_path: Text::EMPTY,
            points: std::ptr::null(),
            count: 0,
            world_from_cloud: values::rigid(&found.world_from_cloud),
            owner: std::ptr::null_mut(),
        };
        match found.source {
            CloudSource::Ply(path) => {
                let held = Texts::new([path.into_os_string().into_encoded_bytes()].into_iter());
                cloud.ply_path = held.texts[0];
                cloud.owner = owned::give(held);
            }
            CloudSource::Points(points) => {
                let point = |p: &nalgebra::Point3<f32>| contract::Point { x_m: p.x, y_m: p.y, z_m: p.z };
                let held: Box<Vec<contract::Point>> = Box::new(points.iter().map(point).collect());
                cloud.kind = contract::CLOUD_POINTS;
                (cloud.points, cloud.count) = (held.as_ptr(), held.len());
                cloud.owner = owned::give(held);
            }
            other => {
                return Err(DataError::new(format!(
                    "the cloud {other:?} is unknown to the contract of plugins"
                )));
            }
        }
        Ok(Some(cloud))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn floor(
    dataset: *mut c_void,
    keyframe_ns: i64,
    out: *mut contract::Floor,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let floor = unsafe { opened(dataset) }?.dataset.floor(Stamp::from_nanos(keyframe_ns))?;
        values::floor(&floor).map(Some)
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}

pub(super) unsafe extern "C" fn facts(
    dataset: *mut c_void,
    out: *mut contract::Facts,
    message: *mut Message,
) -> i32 {
    let call = || {
        // SAFETY: the host's promise.
        let facts = unsafe { opened(dataset) }?.dataset.facts();
        let held = Facts::new(facts);
        let (facts, count) = (held.facts.as_ptr(), held.facts.len());
        Ok(Some(contract::Facts { facts, count, owner: owned::give(held) }))
    };
    // SAFETY: the host's promise.
    unsafe { answer(out, message, call) }
}
