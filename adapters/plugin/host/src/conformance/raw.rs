//! The calls of a plugin, made as no command of VICE makes them: wrong places, small buffers, answers held for long.
#![allow(unsafe_code)]

use std::ffi::c_void;

use vice_abi::contract::{self, Message, Text};

use super::{Check, Lists};
use crate::ask::kind;
use crate::handle::Handle;
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
        let mut message = message(&mut bytes[..ROOM]);
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
        } else if kind(code).is_some() && message.length == 0 {
            self.fault("it fails to open without a message: set `length` to that of the text");
        } else if message.hint_start.saturating_add(message.hint_length) > message.length {
            self.fault("the hint of its message lies outside the text: `hint_start` and `hint_length` are places in it");
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
        self.optional_places(library, handle, lists);
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

    /// The same of optional calls, which may also say that there is none.
    fn optional_places(&mut self, library: &Library, handle: &Handle, lists: &Lists) {
        let (calls, data) = (&library.calls.optional, handle.raw());
        let cameras = lists.cameras.len();
        // SAFETY of the calls: as above.
        for place in [cameras, usize::MAX] {
            if let Some(call) = calls.image_file {
                self.is_not_given(library, "image_file", place, |m| {
                    ask(|o| unsafe { call(data, place, 0, o, m) })
                });
            }
            if let Some(call) = calls.depth_image {
                self.is_not_given(library, "depth_image", place, |m| {
                    ask(|o| unsafe { call(data, place, 0, o, m) })
                });
            }
        }
        for place in [lists.streams.len(), usize::MAX] {
            if let Some(call) = calls.relative_motions {
                self.is_not_given(library, "relative_motions", place, |m| {
                    ask(|o| unsafe { call(data, place, o, m) })
                });
            }
        }
    }

    /// The code of a call for a place that is not there, and whether it left a message.
    fn outside(
        &mut self,
        library: &Library,
        call: &str,
        place: usize,
        make: impl FnOnce(*mut Message) -> i32,
    ) -> (i32, bool) {
        self.step(format!("`{call}` for place {place}, which is not there"));
        let mut bytes = [0; 512];
        let mut message = message(&mut bytes);
        let turn = library.turn();
        let code = make(&raw mut message);
        drop(turn);
        (code, message.length > 0)
    }

    fn is_not_given(
        &mut self,
        library: &Library,
        call: &str,
        place: usize,
        make: impl FnOnce(*mut Message) -> i32,
    ) {
        let (code, _) = self.outside(library, call, place, make);
        match code {
            contract::OK => self.fault(format!("`{call}` gives something for place {place}, which is not there")),
            contract::EXCEPTION => self.fault(format!(
                "`{call}` for place {place} ends in an exception or panic: check the place and return VICE_ERROR"
            )),
            _ => {}
        }
    }

    fn is_error(
        &mut self,
        library: &Library,
        call: &str,
        place: usize,
        make: impl FnOnce(*mut Message) -> i32,
    ) {
        let (code, says_why) = self.outside(library, call, place, make);
        match code {
            code if kind(code).is_some() && says_why => {}
            // Left to the stored file, which was asked for beyond the last frame already.
            contract::NONE if call == "image" && library.calls.optional.image_file.is_some() => {}
            code if kind(code).is_some() => self.fault(format!("`{call}` for place {place} fails without a message")),
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
            let mut message = message(&mut []);
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

/// Room for a message.
const fn message(bytes: &mut [u8]) -> Message {
    Message { data: bytes.as_mut_ptr(), capacity: bytes.len(), length: 0, hint_start: 0, hint_length: 0 }
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
