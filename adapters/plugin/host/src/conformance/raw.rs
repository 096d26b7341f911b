//! The calls of a plugin, made as no command of VICE makes them: wrong places, small buffers, answers held for long.
#![allow(unsafe_code)]

use std::ffi::c_void;

use vice_abi::contract::{self, Message, Text};

use super::{Check, Lists};
use crate::dataset::Handle;
use crate::library::{Library, Plugin};

/// What stands after a message buffer and must stay.
const CANARY: u8 = 0xa5;

impl Check<'_> {
    pub(super) fn raw_calls(&mut self, plugin: &Plugin, lists: &Lists) {
        let library = plugin.library();
        self.step("an error with little room for its message");
        self.small_message(library);
        self.step("opening it for direct calls");
        let Ok(handle) = Handle::open(library, &self.path, self.subject.options) else {
            self.fault("it opened before, but not again");
            return;
        };
        self.places(library, &handle, lists);
        self.answers_held(library, &handle, lists);
    }

    /// A message that does not fit must be cut, not written beyond its buffer.
    fn small_message(&mut self, library: &Library) {
        const ROOM: usize = 8;
        let mut bytes = [CANARY; 256];
        let mut message = Message { data: bytes.as_mut_ptr(), capacity: ROOM, length: 0 };
        let mut dataset: *mut c_void = std::ptr::null_mut();
        let turn = library.turn();
        // SAFETY: a path that lives during the call, and a buffer larger than it is said to be.
        let code = unsafe {
            let path = Text::from_bytes(b"/no/such/folder/of/any/data/set");
            (library.calls.open)(path, std::ptr::null(), 0, &raw mut dataset, &raw mut message)
        };
        if code == contract::OK && !dataset.is_null() {
            // SAFETY: opened just now.
            unsafe { (library.calls.close)(dataset) };
        }
        drop(turn);
        if bytes[ROOM..].iter().any(|b| *b != CANARY) {
            self.fault("it writes beyond the `capacity` of the message: memory of VICE is overwritten");
        } else if code == contract::ERROR && message.length == 0 {
            self.fault("it fails to open without a message: set `length` to that of the text");
        } else {
            self.good("an error message is cut where there is little room");
        }
    }

    /// Cameras, streams and frames that are not there.
    fn places(&mut self, library: &Library, handle: &Handle, lists: &Lists) {
        let before = self.faults;
        let (cameras, streams) = (lists.cameras.len(), lists.streams.len());
        let (calls, data) = (&library.calls, handle.raw());
        // SAFETY of the calls: an open data set, and answers and messages that are there.
        for place in [cameras, usize::MAX] {
            self.is_error(library, "camera", place, |m| {
                ask(|o| unsafe { (calls.camera)(data, place, o, m) })
            });
            self.is_error(library, "frames", place, |m| {
                ask(|o| unsafe { (calls.frames)(data, place, o, m) })
            });
            self.is_error(library, "image", place, |m| {
                ask(|o| unsafe { (calls.image)(data, place, 0, o, m) })
            });
            self.is_error(library, "body_from_camera", place, |m| {
                ask(|o| unsafe { (calls.body_from_camera)(data, place, 0, o, m) })
            });
        }
        for place in [streams, usize::MAX] {
            self.is_error(library, "trajectory", place, |m| {
                ask(|o| unsafe { (calls.trajectory)(data, place, o, m) })
            });
        }
        for (index, camera) in lists.cameras.iter().enumerate() {
            for place in [camera.frames.len(), usize::MAX] {
                self.is_error(library, "image", place, |m| {
                    ask(|o| unsafe { (calls.image)(data, index, place, o, m) })
                });
            }
        }
        if self.faults == before {
            self.good("cameras, streams and frames that are not there are errors");
        }
    }

    fn is_error(
        &mut self,
        library: &Library,
        call: &str,
        place: usize,
        make: impl FnOnce(*mut Message) -> i32,
    ) {
        self.step(format!("`{call}` for place {place}, which is not there"));
        let mut bytes = [0; 512];
        let mut message = Message { data: bytes.as_mut_ptr(), capacity: bytes.len(), length: 0 };
        let turn = library.turn();
        let code = make(&raw mut message);
        drop(turn);
        match code {
            contract::ERROR if message.length > 0 => {}
            contract::ERROR => self.fault(format!("`{call}` for place {place} fails without a message")),
            contract::EXCEPTION => self.fault(format!(
                "`{call}` for place {place} ends in an exception or panic: check the place and return VICE_ERROR"
            )),
            code => self.fault(format!(
                "`{call}` for place {place}, which is not there, returned {code} in place of VICE_ERROR"
            )),
        }
    }

    /// What a call hands over stays as it is until it is released, whatever is called meanwhile.
    fn answers_held(&mut self, library: &Library, handle: &Handle, lists: &Lists) {
        self.step("holding two answers and releasing the later one first");
        let Some(index) = lists.cameras.iter().position(|c| !c.frames.is_empty()) else { return };
        let stamps = || {
            let mut out = Stamps::default();
            let mut message = Message { data: std::ptr::null_mut(), capacity: 0, length: 0 };
            // SAFETY: an open data set, a message of no room.
            let code =
                unsafe { (library.calls.frames)(handle.raw(), index, &raw mut out.0, &raw mut message) };
            (code == contract::OK).then_some(out.0)
        };
        let turn = library.turn();
        let (first, second) = (stamps(), stamps());
        let same = match (&first, &second) {
            // SAFETY: handed over and not yet released.
            (Some(a), Some(b)) => unsafe {
                let read = |s: &contract::Stamps| {
                    crate::border::list(s.stamps_ns, s.count, "stamps").map(<[i64]>::to_vec)
                };
                let was = read(a);
                library.release(b.owner);
                let is = read(a);
                library.release(a.owner);
                was.is_ok() && was == is
            },
            (only, other) => {
                only.iter().chain(other).for_each(|s| library.release(s.owner));
                false
            }
        };
        drop(turn);
        match same {
            true => self.good("answers stay as they are until they are released"),
            false => self.fault("an answer changes before it is released, or is not given twice"),
        }
    }
}

/// No stamps.
struct Stamps(contract::Stamps);

impl Default for Stamps {
    fn default() -> Self {
        Self(contract::Stamps { stamps_ns: std::ptr::null(), count: 0, owner: std::ptr::null_mut() })
    }
}

/// Makes a call that must not succeed; what it hands over all the same is lost.
fn ask<T>(call: impl FnOnce(*mut T) -> i32) -> i32 {
    let mut out = std::mem::MaybeUninit::<T>::zeroed();
    call(out.as_mut_ptr())
}
