//! Cameras: calibration, frames, images, depth images.
#![allow(unsafe_code)]

use std::ffi::c_void;

use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;

use super::{Open, about};
use crate::contract::{self, Message};
use crate::export::{owned, values};

/// Bytes of a row, which the contract counts in 32 bits.
fn stride(width: u32, pixel_bytes: usize) -> DataResult<u32> {
    let row = u64::from(width) * pixel_bytes as u64;
    u32::try_from(row).map_err(|_| DataError::new("a row of the image is too long"))
}

pub(in crate::export) unsafe extern "C" fn camera(
    dataset: *mut c_void,
    index: usize,
    out: *mut contract::Camera,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| Ok(Some(values::camera(&open.dataset.camera(open.camera(index)?)?)));
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn frames(
    dataset: *mut c_void,
    index: usize,
    out: *mut contract::Stamps,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let frames = Box::new(values::stamps(&open.dataset.frames(open.camera(index)?)?));
        let (stamps_ns, count) = (frames.as_ptr(), frames.len());
        Ok(Some(contract::Stamps { stamps_ns, count, owner: owned::give(frames) }))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn image(
    dataset: *mut c_void,
    camera: usize,
    frame: usize,
    out: *mut contract::Image,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let image = open.dataset.image(open.camera(camera)?, frame)?;
        let (width_px, height_px, pixels) = (image.width(), image.height(), image.format());
        let row_stride_bytes = stride(width_px, pixels.bytes())?;
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
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn image_file(
    dataset: *mut c_void,
    camera: usize,
    frame: usize,
    out: *mut contract::ImageFile,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let Some(file) = open.dataset.image_file(open.camera(camera)?, frame)? else { return Ok(None) };
        let held = Box::new(file);
        let (data, data_bytes) = (held.as_ptr(), held.len());
        Ok(Some(contract::ImageFile { data, data_bytes, owner: owned::give(held) }))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn body_from_camera(
    dataset: *mut c_void,
    camera: usize,
    stamp_ns: i64,
    out: *mut contract::Rigid,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let pose = open.dataset.body_from_camera(open.camera(camera)?, Stamp::from_nanos(stamp_ns))?;
        Ok(Some(values::rigid(&pose)))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}

pub(in crate::export) unsafe extern "C" fn depth_image(
    dataset: *mut c_void,
    camera: usize,
    frame: usize,
    out: *mut contract::DepthImage,
    message: *mut Message,
) -> i32 {
    let call = |open: &Open| {
        let Some(depth) = open.dataset.depth_image(open.camera(camera)?, frame)? else { return Ok(None) };
        let held = Box::new(depth);
        Ok(Some(contract::DepthImage {
            stamp_ns: held.stamp.as_nanos(),
            width_px: held.width(),
            height_px: held.height(),
            z_m: held.z_m().as_ptr(),
            data_bytes: size_of_val(held.z_m()),
            row_stride_bytes: stride(held.width(), size_of::<f32>())?,
            reserved: 0,
            owner: owned::give(held),
        }))
    };
    // SAFETY: the host's promise.
    unsafe { about(dataset, out, message, call) }
}
