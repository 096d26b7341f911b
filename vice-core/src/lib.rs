//! The method of VICE, the Visual Inertial Correlation Estimator.
//!
//! A flight comes in through a [`dataset::Dataset`]: stamps ([`time`]), poses ([`trajectory`], [`imu`]), frames and
//! calibration ([`camera`], [`frames`]). Reference key points of a [`label::LabelSet`] get a depth from a
//! [`depth::DepthSource`] at their key frame and are carried along by each pose stream.
#![forbid(unsafe_code)]

pub mod camera;
pub mod dataset;
pub mod depth;
pub mod error;
pub mod frames;
pub mod imu;
pub mod label;
pub mod registry;
pub mod time;
pub mod trajectory;
