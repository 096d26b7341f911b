//! How the body moves: pose streams and inertial samples.
//!
//! There is no `relative_motions` here: a stream that is relative comes out of the core's trait chained, and says so.
#![allow(unsafe_code)]

use std::ffi::c_void;

use vice_core::time::Stamp;

use super::{Open, about};
use crate::contract::{self, Message};
use crate::export::{owned, values};

pub(in crate::export) unsafe extern "C" fn trajectory(
    dataset: *mut c_void,
    index: usize,
    out: *mut contract::Poses,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let held = Box::new(values::poses(&open.dataset.trajectory(open.stream(index)?)?));
        let (poses, count) = (held.as_ptr(), held.len());
        Ok(Some(contract::Poses { poses, count, owner: owned::give(held) }))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn imu(
    dataset: *mut c_void,
    out: *mut contract::ImuSamples,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let held = Box::new(values::imu(&open.dataset.imu()?));
        let (samples, count) = (held.as_ptr(), held.len());
        Ok(Some(contract::ImuSamples { samples, count, owner: owned::give(held) }))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn inertial_state(
    dataset: *mut c_void,
    stamp_ns: i64,
    out: *mut contract::InertialState,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let state = open.dataset.inertial_state(Stamp::from_nanos(stamp_ns))?;
        Ok(state.as_ref().map(values::inertial_state))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}
