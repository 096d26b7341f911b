//! Panics stop here: unwinding into another language is undefined.

use std::any::Any;
use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// Where this thread panicked last.
    static PLACE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Keeps the place of a panic for the message in place of printing it: the host prints one line.
///
/// The hook is this library's own, since each Rust library has its own standard library.
pub(super) fn install() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        std::panic::set_hook(Box::new(|info| {
            let place = info.location().map(ToString::to_string);
            // A thread on its way out may have no place left to keep it in.
            let _ = PLACE.try_with(|p| p.replace(place));
        }));
    });
}

/// Calls `f`; a panic becomes its text.
pub(super) fn caught<T>(f: impl FnOnce() -> T) -> Result<T, String> {
    // A data set that panicked half-way is as it is; its locks are poisoned and the next call says so.
    catch_unwind(AssertUnwindSafe(f)).map_err(|payload| {
        let text = text_of(payload.as_ref());
        let place = PLACE.try_with(RefCell::take).ok().flatten();
        // Dropping the payload could panic again.
        std::mem::forget(payload);
        match place {
            Some(place) => format!("the plugin panicked at {place}: {text}"),
            None => format!("the plugin panicked: {text}"),
        }
    })
}

fn text_of(payload: &(dyn Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_string())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "without a message".to_string())
}
