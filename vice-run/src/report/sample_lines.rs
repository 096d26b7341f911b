//! Scored samples as lines of JSON, written while they are scored: a long run has more of them than fit the memory.

use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;
use vice_core::camera::Pixel;
use vice_core::evaluate::SampleSink;
use vice_core::result::{PointName, Sample};

use vice_core::time::Stamp;
use vice_files::atomic::{self, Overwrite};

use crate::error::RunResult;

/// A line.
#[derive(Serialize)]
struct Line<'a> {
    stream: &'a str,
    depth: &'a str,
    point: &'a PointName,
    timestamp_ns: Stamp,
    label_px: Pixel,
    tracked_px: Pixel,
    error_px: f64,
}

/// Makes the file of what `evaluate` hands to its sink. If that fails there is no file.
///
/// # Errors
/// That of `evaluate`, or [`RunError`](crate::error::RunError) if the file cannot be written.
pub fn write<T>(path: &Path, evaluate: impl FnOnce(&mut SampleSink<'_>) -> RunResult<T>) -> RunResult<T> {
    atomic::write_and_return(path, Overwrite::Replace, |out| {
        evaluate(&mut |stream, depth, samples| {
            samples.iter().try_for_each(|sample| write_line(out, stream, depth, sample))
        })
    })
}

fn write_line(out: &mut dyn Write, stream: &str, depth: &str, sample: &Sample) -> io::Result<()> {
    let Sample { point, timestamp_ns, label_px, tracked_px, error_px } = sample;
    let line = Line {
        stream,
        depth,
        point,
        timestamp_ns: *timestamp_ns,
        label_px: *label_px,
        tracked_px: *tracked_px,
        error_px: *error_px,
    };
    serde_json::to_writer(&mut *out, &line)?;
    out.write_all(b"\n")
}
