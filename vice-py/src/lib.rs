//! The shared library of the Python module `vicepose`: VICE on arrays, over `vice-run`, and the program `vice`.
//!
//! What is thin stands in Python (`python/vicepose`): arguments, plots, data frames, Rerun, Ray. Here is what needs the
//! libraries: each function turns arguments into a [`vice_run::request::Request`] and shows what it finds.

mod arrays;
mod asking;
mod camera;
mod document;
mod errors;
mod fleet;
mod format;
mod labels;
mod metrics;
mod poses;
mod program;
mod recording;
mod result;
mod robot;
mod table;
mod warnings;
mod work;

use pyo3::prelude::*;

/// What `vicepose` is made of.
#[pymodule]
mod _vicepose {
    use super::{Bound, PyModule, PyModuleMethods, PyResult};

    #[pymodule_export]
    use super::asking::{diagnose, evaluate, evaluate_request, sensitivity};
    #[pymodule_export]
    use super::camera::Camera;
    #[pymodule_export]
    use super::document::Document;
    #[pymodule_export]
    use super::fleet::{Batch, FleetTable, batch, collect, plan, scan, table};
    #[pymodule_export]
    use super::format::{check_format, formats};
    #[pymodule_export]
    use super::labels::Labels;
    #[pymodule_export]
    use super::metrics::{ape, compare_trajectories, rpe};
    #[pymodule_export]
    use super::poses::Trajectory;
    #[pymodule_export]
    use super::program::{command_names, demo, main, panic_for_tests, synth, time_of_batch, work_for_tests};
    #[pymodule_export]
    use super::recording::{Recording, open_object, open_path};
    #[pymodule_export]
    use super::result::{Outcome, compare};
    #[pymodule_export]
    use super::table::Table;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::work::keep_panics();
        // Said before only where the module is loaded into a second interpreter, which has the same formats.
        let _ = vice_run::formats::of_host(super::format::known);
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
