//! What an open data set of a plugin says that it has: its name, cameras and pose streams.
#![allow(unsafe_code)]

use std::sync::{Arc, OnceLock};

use vice_abi::contract;
use vice_core::error::DataResult;
use vice_core::time::Stamp;

use crate::ask::must;
use crate::border::{self, Fault};
use crate::handle::Handle;

/// What a data set has.
pub(crate) struct Description {
    pub(crate) name: String,
    pub(crate) cameras: Vec<CameraEntry>,
    pub(crate) streams: Vec<StreamEntry>,
}

pub(crate) struct CameraEntry {
    pub(crate) name: String,
    pub(crate) has_depth: bool,
    pub(crate) frames: OnceLock<Arc<[Stamp]>>,
}

pub(crate) struct StreamEntry {
    pub(crate) name: String,
    pub(crate) kind: StreamKind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum StreamKind {
    Poses,
    /// Motions, which are chained here.
    Motions,
    /// Poses that the plugin chained.
    Chained,
}

/// Asks an open data set what it has.
pub(crate) fn describe(handle: &Handle) -> DataResult<Description> {
    must(
        handle.library(),
        &|| "describe".to_string(),
        // SAFETY: an open data set.
        |out, message| unsafe { (handle.library().calls.describe)(handle.raw(), out, message) },
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
            Ok(Description { name, cameras, streams })
        },
    )
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
    let kind = match entry.kind {
        contract::STREAM_POSES => StreamKind::Poses,
        contract::STREAM_RELATIVE => StreamKind::Motions,
        contract::STREAM_CHAINED => StreamKind::Chained,
        other => return Err(format!("kind {other} of the pose stream {name} is none of the contract's")),
    };
    Ok(StreamEntry { name, kind })
}

fn unique<'a>(names: impl Iterator<Item = &'a str>, what: &str) -> Result<(), Fault> {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    match names.windows(2).find(|w| w[0] == w[1]) {
        Some(twice) => Err(format!("two {what} have the name `{}`", twice[0])),
        None => Ok(()),
    }
}
