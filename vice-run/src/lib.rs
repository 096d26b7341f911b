//! From a request to a result.
//!
//! A [`request::Request`] says as plain data what is asked: which recording, labels, pose streams, depth and protocol.
//! [`request::Request::open`] opens the recording with whatever format reads it, [`request::Request::evaluate`] runs the
//! method of [`vice_core`] on it and returns a [`result::ResultDocument`], and [`report`] shows that document as a table,
//! a page or a film. The program, the annotator, a batch and other languages come through here: none of them opens a
//! data set or loads an estimate by itself.
//!
//! ```no_run
//! use vice_run::request::Request;
//!
//! let request = Request::new("V1_01_easy", "floor.csv", ["imu-euler".to_string().into()]);
//! let document = vice_run::evaluate_request(&request, &vice_run::silent)?;
//! print!("{}", vice_run::report::table::render(&document));
//! # Ok::<(), vice_run::error::RunError>(())
//! ```
//!
//! Nothing here prints, and nothing knows a command line.
#![forbid(unsafe_code)]

mod assess;
pub mod auto_labels;
mod away;
pub mod batch;
pub mod bench;
pub mod beside;
pub mod check;
pub mod conversion;
pub mod demo;
pub mod depth_compare;
pub mod depth_images;
pub mod detecting;
pub mod diagnosis;
pub mod error;
mod evaluation;
pub mod film;
pub mod floor;
pub mod formats;
mod imu_start;
pub mod in_memory;
pub mod info;
pub mod info_document;
pub mod init;
pub mod label_compare;
pub mod label_noise;
pub mod open;
pub mod place;
pub mod plugin;
pub mod progress;
mod recorded;
pub mod report;
pub mod request;
pub mod require;
pub mod result;
pub mod rig;
pub mod scans;
pub mod scene;
pub mod sources;
pub mod streams;
pub mod text;
pub mod tracking_summary;
pub mod trajectory;

pub use evaluation::{Samples, evaluate_request};
pub use progress::{Progress, silent};

/// The method.
pub use vice_core as core;
/// Depth sources.
pub use vice_depth as depth;
/// Calibration targets.
pub use vice_detect as detect;
/// Files that formats share.
pub use vice_files as files;
/// Plugins as formats.
pub use vice_host as host;
/// A rendered flight with exact labels.
pub use vice_synthetic as synthetic;
/// The image tracker.
pub use vice_track as track;
/// Films.
pub use vice_video as video;
