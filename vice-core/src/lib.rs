//! The method of VICE, the Visual Inertial Correlation Estimator.
//!
//! A flight comes in through a [`dataset::Dataset`]: stamps ([`time`]), poses ([`trajectory`], [`imu`]), frames and
//! calibration ([`camera`], [`frames`]). Reference key points of a [`label::LabelSet`] get a depth from a
//! [`depth::DepthSource`] at their key frame, are carried along by each pose stream ([`track`], the paper's equation 1)
//! and compared in pixels with their labels ([`metrics`]). [`mod@evaluate`] is the list of these stages, and a
//! [`result::Evaluated`] is what leaves; [`mod@diagnose`] names the flaw behind the pixels. Formats are found by name or by looking in a [`registry::Registry`].
//!
//! The core reads no files and decodes nothing: adapters do. Who has arrays needs no data set: an
//! [`Evaluation`](evaluate::Evaluation) is built from a camera, stamps, labels, poses and a depth source, as
//! `examples/rmse_2d.rs` shows from first to last.
//!
//! The features `rayon` (several threads, the same results) and `serde` (results can be written and read; [`mod@diagnose`]
//! needs it) are on by default. nalgebra, whose types stand in many signatures, is re-exported.
#![forbid(unsafe_code)]

pub use nalgebra;

pub mod budget;
pub mod camera;
pub mod check;
pub mod conventions;
pub mod dataset;
pub mod depth;
pub mod depth_doubt;
#[cfg(feature = "serde")]
pub mod diagnose;
pub mod error;
pub mod evaluate;
pub mod finding;
pub mod fleet;
pub mod frames;
pub mod imu;
pub mod instructions;
pub mod label;
pub mod lanes;
pub mod metrics;
pub mod paired;
mod parallel;
pub mod random;
pub mod registry;
pub mod result;
pub mod skip;
pub mod statistics;
pub mod suspicion;
pub mod time;
pub mod time_unit;
pub mod track;
pub mod trajectory;
pub mod triangulate;
