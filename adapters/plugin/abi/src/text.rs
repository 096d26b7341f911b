//! Text across the border.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::contract::{Message, Text};

impl Text {
    /// No text.
    pub const EMPTY: Self = Self { data: std::ptr::null(), length: 0 };

    /// Text that must outlive its use on the other side.
    pub const fn from_bytes(bytes: &[u8]) -> Self {
        Self { data: bytes.as_ptr(), length: bytes.len() }
    }

    /// The same of a path: the operating system's bytes.
    pub fn from_path(path: &Path) -> Self {
        Self::from_bytes(path.as_os_str().as_encoded_bytes())
    }

    /// The bytes; `None` for null with a length, or a length that no memory has.
    ///
    /// # Safety
    /// Where `data` is not null it points at `length` readable bytes that nobody changes for as long as `'a`.
    #[allow(unsafe_code)]
    pub unsafe fn bytes<'a>(self) -> Option<&'a [u8]> {
        if self.length == 0 {
            return Some(&[]);
        }
        if self.data.is_null() || isize::try_from(self.length).is_err() {
            return None;
        }
        // SAFETY: not null and of a possible length; the rest is the caller's promise.
        Some(unsafe { std::slice::from_raw_parts(self.data, self.length) })
    }
}

/// A path from its bytes; `None` where the operating system's paths are UTF-8 and these are not.
pub fn path_from_bytes(bytes: &[u8]) -> Option<PathBuf> {
    #[cfg(unix)]
    let path = Some(std::os::unix::ffi::OsStrExt::from_bytes(bytes)).map(|p: &OsStr| PathBuf::from(p));
    #[cfg(not(unix))]
    let path = std::str::from_utf8(bytes).ok().map(|p| PathBuf::from(OsStr::new(p)));
    path
}

impl Message {
    /// Writes a text, cut at a character where it does not fit.
    ///
    /// # Safety
    /// Where `data` is not null it points at `capacity` writable bytes.
    #[allow(unsafe_code)]
    pub unsafe fn write(&mut self, text: &str) {
        self.length = text.len();
        if self.data.is_null() {
            return;
        }
        let fits = (0..=text.len().min(self.capacity)).rev().find(|n| text.is_char_boundary(*n)).unwrap_or(0);
        // SAFETY: `fits` is at most the capacity and the text's length, and the two do not overlap.
        unsafe { std::ptr::copy_nonoverlapping(text.as_ptr(), self.data, fits) };
        // The bytes between the cut and the capacity are not of the text.
        for place in fits..self.capacity.min(self.length) {
            // SAFETY: within the capacity.
            unsafe { self.data.add(place).write(b' ') };
        }
    }
}
