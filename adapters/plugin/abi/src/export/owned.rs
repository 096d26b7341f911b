//! Memory that the host has until it releases it.
#![allow(unsafe_code)]

use std::any::Any;
use std::ffi::c_void;

use vice_core::dataset::Fact;
use vice_core::suspicion::Suspicion;

use super::guard;
use crate::contract::{self, Text};

type Owned = Box<dyn Any>;

/// Gives a value away; [`release`] frees it.
pub(super) fn give<T: 'static>(value: Box<T>) -> *mut c_void {
    let owned: Owned = value;
    Box::into_raw(Box::new(owned)).cast()
}

/// The `release` of the table.
///
/// # Safety
/// `owner` is null or comes from [`give`] and was not released before.
pub(super) unsafe extern "C" fn release(owner: *mut c_void) {
    if owner.is_null() {
        return;
    }
    // SAFETY: the caller's promise.
    let owned: Box<Owned> = unsafe { Box::from_raw(owner.cast()) };
    // What a destructor of an adapter's type panics with has nobody to tell it to.
    let _ = guard::caught(|| drop(owned));
}

/// Strings, and the texts that point at them.
pub(super) struct Texts {
    pub(super) texts: Vec<Text>,
    _strings: Vec<Vec<u8>>,
}

impl Texts {
    pub(super) fn new(strings: impl Iterator<Item = Vec<u8>>) -> Box<Self> {
        // The bytes keep their place in memory when the list of them grows or is moved.
        let strings: Vec<Vec<u8>> = strings.collect();
        Box::new(Self { texts: strings.iter().map(|s| Text::from_bytes(s)).collect(), _strings: strings })
    }
}

/// Facts, and those of the contract that point at them.
pub(super) struct Facts {
    pub(super) facts: Vec<contract::Fact>,
    _held: Vec<Fact>,
}

impl Facts {
    pub(super) fn new(held: Vec<Fact>) -> Box<Self> {
        let text = |s: &String| Text::from_bytes(s.as_bytes());
        let facts =
            held.iter().map(|f| contract::Fact { section: text(&f.section), text: text(&f.text) }).collect();
        Box::new(Self { facts, _held: held })
    }
}

/// Suspicions, and those of the contract that point at them.
pub(super) struct Suspicions {
    pub(super) suspicions: Vec<contract::Suspicion>,
    _held: Vec<Suspicion>,
}

impl Suspicions {
    pub(super) fn new(held: Vec<Suspicion>) -> Box<Self> {
        let text = |s: &String| Text::from_bytes(s.as_bytes());
        let suspicions = held
            .iter()
            .map(|s| contract::Suspicion {
                code: text(&s.code),
                about: text(&s.about),
                message: text(&s.message),
                evidence: text(&s.evidence),
                advice: text(&s.advice),
                count: s.count,
            })
            .collect();
        Box::new(Self { suspicions, _held: held })
    }
}
