//! The scene, and what there is to say of the data set: scan, floor, facts, suspicions, findings.
#![allow(unsafe_code)]

use std::ffi::c_void;

use vice_core::dataset::CloudSource;
use vice_core::error::DataError;
use vice_core::time::Stamp;

use super::{Open, about};
use crate::contract::{self, Message, Text};
use crate::export::owned::{self, Facts, Findings, Suspicions, Texts};
use crate::export::values;

pub(in crate::export) unsafe extern "C" fn cloud(
    dataset: *mut c_void,
    out: *mut contract::Cloud,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let Some(found) = open.dataset.cloud()? else { return Ok(None) };
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
            CloudSource::File(path) => {
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
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn floor(
    dataset: *mut c_void,
    keyframe_ns: i64,
    out: *mut contract::Floor,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| values::floor(&open.dataset.floor(Stamp::from_nanos(keyframe_ns))?).map(Some);
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn facts(
    dataset: *mut c_void,
    out: *mut contract::Facts,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let held = Facts::new(open.dataset.facts());
        let (facts, count) = (held.facts.as_ptr(), held.facts.len());
        Ok(Some(contract::Facts { facts, count, owner: owned::give(held) }))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn checks(
    dataset: *mut c_void,
    out: *mut contract::Findings,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let held = Findings::new(open.dataset.checks());
        let (findings, count) = (held.findings.as_ptr(), held.findings.len());
        Ok(Some(contract::Findings { findings, count, owner: owned::give(held) }))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn suspicions(
    dataset: *mut c_void,
    out: *mut contract::Suspicions,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let held = Suspicions::new(open.dataset.suspicions());
        let (suspicions, count) = (held.suspicions.as_ptr(), held.suspicions.len());
        Ok(Some(contract::Suspicions { suspicions, count, owner: owned::give(held) }))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}
