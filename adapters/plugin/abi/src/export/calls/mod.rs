//! The calls of the table, each a method of the core's traits behind [`guard::caught`]: finding, opening, describing here,
//! what an open data set holds in the modules.
#![allow(unsafe_code)]

pub(super) mod cameras;
pub(super) mod motion;
pub(super) mod scene;

use std::ffi::c_void;
use std::path::PathBuf;

use vice_core::dataset::{Dataset, DatasetFactory, OpenOptions, Probe};
use vice_core::error::{DataError, DataResult};

use super::owned::{self, Texts};
use super::{factory, failure, guard};
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
                kind: if dataset.is_relative(stream) {
                    contract::STREAM_CHAINED
                } else {
                    contract::STREAM_POSES
                },
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
    let failed = match guard::caught(call) {
        Ok(Ok(Some(_))) if out.is_null() => failure::Failure::of(&DataError::new("no place for the answer")),
        Ok(Ok(Some(value))) => {
            // SAFETY: not null, and writable by the caller's promise.
            unsafe { out.write(value) };
            return contract::OK;
        }
        Ok(Ok(None)) => return contract::NONE,
        Ok(Err(error)) => failure::Failure::of(&error),
        Err(panic) => failure::Failure::panic(panic),
    };
    // SAFETY: the caller's promise.
    unsafe { failed.write(message) }
}

/// As [`answer`], about an open data set.
///
/// # Safety
/// As [`answer`], and `dataset` is null or an open data set of [`open`].
unsafe fn about<T>(
    dataset: *mut c_void,
    out: *mut T,
    message: *mut Message,
    call: impl FnOnce(&Open) -> DataResult<Option<T>>,
) -> i32 {
    let call = || {
        // SAFETY: the caller's promise.
        let open = unsafe { dataset.cast::<Open>().as_ref() };
        call(open.ok_or_else(|| DataError::new("the data set is null"))?)
    };
    // SAFETY: the caller's promise.
    unsafe { answer(out, message, call) }
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

fn made() -> DataResult<&'static dyn DatasetFactory> {
    factory().ok_or_else(|| DataError::new("the plugin was not asked for its table"))
}

// The safety of all calls, here and in the modules, is what `vice_plugin.h` asks of the host: data sets are open ones of this library, texts and
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
    let call = |open: &Open| {
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
    unsafe { about(dataset, out, message, call) }
}
