//! What is wrong with a recording, before any label.
//!
//! Each file is one check: what it looks at, its thresholds, their source and its test. None of them reads a file; who has
//! the data hands it over. A check says a [`Finding`]: a [`State`], a sentence, the numbers and what mends it. A check that
//! cannot know says [`State::Unknown`] and why, never that all is well.

pub mod camera_difference;
pub mod cameras;
pub mod clock;
pub mod covariance;
pub mod coverage;
mod cures;
pub mod hand_eye;
pub mod inertial;
mod least;
pub mod lever;
pub mod loops;
pub mod motion;
pub mod moved;
pub mod optics;
pub mod path;
pub mod pictures;
pub mod stamps;
pub mod turning;

pub use crate::finding::{Finding, Number, State, short};

/// What a check is, for `vice check --list`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Check {
    /// Its name in findings, in kebab-case.
    pub name: &'static str,
    /// A heading.
    pub title: &'static str,
    /// What it looks at.
    pub looks_at: &'static str,
    /// When it says `look` and `wrong`.
    pub threshold: &'static str,
    /// Where the thresholds come from.
    pub source: &'static str,
}

/// All checks, in the order in which they are made.
pub const CHECKS: [Check; 16] = [
    stamps::CHECK,
    coverage::CHECK,
    clock::CHECK,
    motion::CHECK,
    inertial::CHECK,
    inertial::GRAVITY,
    lever::CHECK,
    loops::CHECK,
    covariance::CHECK,
    path::CHECK,
    optics::CHECK,
    hand_eye::CHECK,
    moved::CHECK,
    cameras::CHECK,
    pictures::CHECK,
    pictures::DEPTH,
];
