//! Films.
#![forbid(unsafe_code)]

mod ffmpeg;
pub mod film;
mod mov;

pub use ffmpeg::Ffmpeg;
