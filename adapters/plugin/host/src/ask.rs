//! One call to a plugin: its turn, its code, its answer and what is released after it.
#![allow(unsafe_code)]

use std::ffi::c_void;

use vice_abi::contract::{self, Message};
use vice_core::error::{DataError, DataResult, ErrorKind};

use crate::border::{Fault, MessageBuffer};
use crate::library::Library;

/// What stands with an error that breaks the contract, in place of a cause in the data.
pub(crate) const MISTAKE: &str = "a mistake of the plugin";

/// A structure that a call fills: valid when it is all zero.
pub(crate) trait Answer {
    /// What is to be released once the answer was read; null where there is nothing.
    fn owner(&self) -> *mut c_void;
}

macro_rules! answers {
    ($($name:ident),*) => {$(
        impl Answer for contract::$name {
            fn owner(&self) -> *mut c_void {
                self.owner
            }
        }
    )*};
}
answers!(
    Probe,
    DatasetInfo,
    Stamps,
    Image,
    ImageFile,
    DepthImage,
    Poses,
    Motions,
    ImuSamples,
    Cloud,
    Facts,
    Suspicions,
    Findings
);

macro_rules! plain_answers {
    ($($name:ty),*) => {$(
        impl Answer for $name {
            fn owner(&self) -> *mut c_void {
                std::ptr::null_mut()
            }
        }
    )*};
}
plain_answers!(contract::Camera, contract::Rigid, contract::InertialState, contract::Floor, *mut c_void);

/// Makes one call: waits for its turn, calls, takes what is wanted out of the answer, and has the rest released.
///
/// `None` where the plugin says that there is none. `what` is what was asked for, in words.
pub(crate) fn ask<T: Answer, R>(
    library: &Library,
    what: &dyn Fn() -> String,
    call: impl FnOnce(*mut T, *mut Message) -> i32,
    take: impl FnOnce(&T) -> Result<R, Fault>,
) -> DataResult<Option<R>> {
    let bug = |text: String| DataError::new(format!("{}: {text}", what())).at(&library.path).hint(MISTAKE);
    let mut buffer = MessageBuffer::new();
    let mut message = buffer.message();
    // SAFETY: each answer is a structure of numbers and pointers, or a pointer.
    let mut answer: T = unsafe { std::mem::zeroed() };
    let turn = library.turn();
    let code = call(&raw mut answer, &raw mut message);
    match code {
        contract::OK => {
            let taken = take(&answer);
            library.release(answer.owner());
            drop(turn);
            taken.map(Some).map_err(bug)
        }
        contract::NONE => Ok(None),
        contract::EXCEPTION => Err(bug(buffer.text(&message).unwrap_or_else(|| "an exception".to_string()))),
        code => Err(match kind(code) {
            // In the plugin's own words, as a built-in format would say it.
            Some(kind) => buffer
                .error(&message, kind)
                .unwrap_or_else(|| bug("it failed and does not say why".to_string())),
            None => bug(format!("the call returned {code}, which is none of the contract's codes")),
        }),
    }
}

/// The kind of an error by its code; `None` for a code that is none of an error.
pub(crate) const fn kind(code: i32) -> Option<ErrorKind> {
    Some(match code {
        contract::ERROR => ErrorKind::Corrupt,
        contract::ERROR_MISSING => ErrorKind::Missing,
        contract::ERROR_UNSUPPORTED => ErrorKind::Unsupported,
        contract::ERROR_CONTRADICTORY => ErrorKind::Contradictory,
        contract::ERROR_USAGE => ErrorKind::Usage,
        _ => return None,
    })
}

/// As [`ask`], where there must be an answer.
pub(crate) fn must<T: Answer, R>(
    library: &Library,
    what: &dyn Fn() -> String,
    call: impl FnOnce(*mut T, *mut Message) -> i32,
    take: impl FnOnce(&T) -> Result<R, Fault>,
) -> DataResult<R> {
    ask(library, what, call, take)?.ok_or_else(|| {
        DataError::new(format!("{}: the call returned VICE_NONE, which it must not", what()))
            .at(&library.path)
            .hint(MISTAKE)
    })
}
