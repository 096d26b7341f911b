//! The program, and what it does without a recording.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Instant;

use pyo3::prelude::*;
use vice_cli::{Itself, commands, main_from};
use vice_run::synthetic::{Synthetic, SyntheticOptions, write_euroc};

use crate::camera::Camera;
use crate::errors::Answer;
use crate::work::long;

/// Runs the program `vice` with the arguments of a command line, its own name first. Gives the exit code.
#[pyfunction]
pub(crate) fn main(py: Python<'_>, args: Vec<OsString>, executable: OsString) -> u8 {
    // As a program it says of a defect what every program does.
    drop(std::panic::take_hook());
    let itself = Itself::through(executable, ["-m".into(), "vicepose".into()]);
    py.detach(|| main_from(args, itself))
}

/// Names of the program's commands.
#[pyfunction]
pub(crate) fn command_names() -> Vec<String> {
    commands()
}

/// What `vice demo` prints.
#[pyfunction]
#[pyo3(signature = (out = None, force = false, progress = None))]
pub(crate) fn demo(
    py: Python<'_>,
    out: Option<PathBuf>,
    force: bool,
    progress: Option<Py<PyAny>>,
) -> Answer<String> {
    long(py, progress.as_ref(), move |progress| vice_run::demo::run(out.as_deref(), force, progress))
}

/// Writes a rendered flight.
#[pyfunction]
#[pyo3(signature = (out, seed = 1, duration = 10.0, rate = 20.0, force = false, progress = None))]
pub(crate) fn synth(
    py: Python<'_>,
    out: PathBuf,
    seed: u64,
    duration: f64,
    rate: f64,
    force: bool,
    progress: Option<Py<PyAny>>,
) -> Answer<()> {
    let options =
        SyntheticOptions { seed, duration_s: duration, rate_hz: rate, ..SyntheticOptions::default() };
    long(py, progress.as_ref(), move |progress| {
        let flight = Synthetic::new(options)?;
        Ok(write_euroc(&flight, &out, force, &|done, total| progress("rendering", done, total))?)
    })
}

/// Median seconds that the Rust batch takes for points in structure-of-arrays form: what `Camera.project` is held against.
#[pyfunction]
pub(crate) fn time_of_batch(camera: &Camera, x: Vec<f64>, y: Vec<f64>, z: Vec<f64>, repeats: usize) -> f64 {
    let (mut u, mut v, mut valid) = (vec![0.0; x.len()], vec![0.0; x.len()], vec![false; x.len()]);
    let mut times: Vec<f64> = (0..repeats.max(1))
        .map(|_| {
            let begun = Instant::now();
            camera.core.project_batch([&x, &y, &z], [&mut u, &mut v], &mut valid);
            begun.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Panics, so that tests see what becomes of it.
#[pyfunction]
pub(crate) fn panic_for_tests(py: Python<'_>) -> Answer<()> {
    #[allow(clippy::panic, reason = "that is what it is for")]
    long(py, None, |_| panic!("on purpose"))
}

/// Works on for so many seconds, reporting progress or not, so that tests can stop it.
#[pyfunction]
#[pyo3(signature = (seconds, reports = true, progress = None))]
pub(crate) fn work_for_tests(
    py: Python<'_>,
    seconds: f64,
    reports: bool,
    progress: Option<Py<PyAny>>,
) -> Answer<()> {
    long(py, progress.as_ref(), move |progress| {
        let steps = (seconds * 100.0) as usize;
        for step in 0..steps {
            std::thread::sleep(std::time::Duration::from_millis(10));
            if reports {
                progress("waiting", step + 1, steps);
            }
        }
        Ok(())
    })
}
