//! Memory that the host has until it releases it.
#![allow(unsafe_code)]

use std::any::Any;
use std::ffi::c_void;

use vice_core::dataset::Fact;
use vice_core::finding::{Finding, State};
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

/// Findings, and those of the contract that point at them.
pub(super) struct Findings {
    pub(super) findings: Vec<contract::Finding>,
    _numbers: Vec<Vec<contract::Number>>,
    _held: Vec<Finding>,
}

impl Findings {
    pub(super) fn new(held: Vec<Finding>) -> Box<Self> {
        let text = |s: &String| Text::from_bytes(s.as_bytes());
        let numbers: Vec<Vec<contract::Number>> = held
            .iter()
            .map(|f| {
                let of = |n: &vice_core::finding::Number| contract::Number {
                    name: text(&n.name),
                    value: n.value,
                    unit: text(&n.unit),
                };
                f.numbers.iter().map(of).collect()
            })
            .collect();
        let findings = held
            .iter()
            .zip(&numbers)
            .map(|(f, numbers)| contract::Finding {
                check: text(&f.check),
                about: text(&f.about),
                says: text(&f.says),
                mend: text(&f.mend),
                numbers: numbers.as_ptr(),
                number_count: numbers.len(),
                state: match f.state {
                    State::Unknown => contract::STATE_UNKNOWN,
                    State::Ok => contract::STATE_OK,
                    State::Look => contract::STATE_LOOK,
                    State::Wrong => contract::STATE_WRONG,
                },
                reserved: 0,
            })
            .collect();
        Box::new(Self { findings, _numbers: numbers, _held: held })
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
