//! Labels in minutes: a point is placed once, the image tracker ([`vice_track`]) carries it through the flight, and a person corrects
//! what it doubts.
//!
//! | module | what |
//! | --- | --- |
//! | [`store`] | the labels while they are edited: journal, undo, the file |
//! | [`notes`] | what is said of lanes that no label says |
//! | [`jobs`] | tracking in the background |
//! | [`estimates`] | what pose streams and depth add |
//! | [`exchange`] | labels from and for other tools |
//! | [`review`] | a second person looks again, blind |
//! | [`server`] | all of this for a page in the browser |
#![forbid(unsafe_code)]

pub mod desk;
pub mod estimates;
pub mod exchange;
pub mod jobs;
pub mod notes;
pub mod review;
mod scene;
pub mod server;
pub mod store;
