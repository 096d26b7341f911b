//! Lines that a plugin has for the user.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use vice_abi::contract::{ABI_VERSION, Host, LOG_ERROR, LOG_INFO, LOG_WARN, Text};

/// Longest line that is shown, bytes.
const MAX_LINE: usize = 4096;

/// What the host gives to one library; it lives as long as the process, since the library does.
pub(crate) struct Context {
    path: PathBuf,
    loaded: AtomicBool,
    /// What it logged as an error while it was loaded.
    load_error: Mutex<Option<String>>,
    host: Host,
}

/// What was handed to libraries: kept where a search for lost memory finds it.
static KEPT: Mutex<Vec<&'static Context>> = Mutex::new(Vec::new());

// SAFETY: the pointer in `host` goes to this context itself, whose state is behind a lock.
unsafe impl Send for Context {}
// SAFETY: as above.
unsafe impl Sync for Context {}

impl Context {
    pub(crate) fn leaked(path: &Path) -> &'static Self {
        let context = Box::leak(Box::new(Self {
            path: path.to_path_buf(),
            loaded: AtomicBool::new(false),
            load_error: Mutex::new(None),
            host: Host {
                abi_version: ABI_VERSION,
                struct_size: size_of::<Host>() as u32,
                context: std::ptr::null_mut(),
                log: Some(log),
            },
        }));
        context.host.context = std::ptr::from_mut(context).cast();
        KEPT.lock().unwrap_or_else(PoisonError::into_inner).push(context);
        context
    }

    pub(crate) fn host(&'static self) -> *const Host {
        &raw const self.host
    }

    /// Ends the loading: from now on errors are shown. Gives the last one of before.
    pub(crate) fn loaded(&self) -> Option<String> {
        self.loaded.store(true, Ordering::Relaxed);
        self.load_error.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// # Safety
/// `context` is that of the host, `line` as [`Text::bytes`] wants it.
unsafe extern "C" fn log(context: *mut c_void, level: i32, line: Text) {
    // A subscriber may panic, as when standard error is gone; that must not unwind into the plugin.
    let _ = catch_unwind(|| {
        // SAFETY: the context that was handed out, never freed.
        let Some(context) = (unsafe { context.cast::<Context>().cast_const().as_ref() }) else { return };
        let line = Text { length: line.length.min(MAX_LINE), ..line };
        // SAFETY: the plugin's promise, shortened.
        let Some(bytes) = (unsafe { line.bytes() }) else { return };
        let text = String::from_utf8_lossy(bytes);
        let path = context.path.display();
        match level {
            LOG_ERROR if context.loaded.load(Ordering::Relaxed) => tracing::error!("{path}: {text}"),
            LOG_ERROR => {
                context.load_error.lock().unwrap_or_else(PoisonError::into_inner).replace(text.into_owned());
            }
            LOG_WARN => tracing::warn!("{text}"),
            LOG_INFO => tracing::info!("{text}"),
            _ => tracing::debug!("{path}: {text}"),
        }
    });
}
