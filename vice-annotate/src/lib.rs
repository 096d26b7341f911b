//! Labels in minutes: a point is placed once, the image tracker carries it through the flight, and a person corrects
//! what it doubts.
#![forbid(unsafe_code)]

pub mod suggest;
pub mod tracker;
