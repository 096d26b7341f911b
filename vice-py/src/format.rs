//! Classes of Python as formats: found by looking, opened by path, and checked by the suite of `vice plugin check`.

use std::path::{Path, PathBuf};
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use vice_run::core::dataset::{Dataset, DatasetFactory, FormatInfo, OpenOptions, Probe, SettingInfo};
use vice_run::core::error::{DataError, DataResult, ErrorKind};
use vice_run::host::conformance::{Event, Subject, Thoroughness, Verdict, check};

use crate::errors::{Answer, Failure, OfPython, data_error, usage};
use crate::robot::Robot;
use crate::work::long;

/// A class whose objects are recordings.
pub(crate) struct PythonFormat {
    class: Py<PyAny>,
    info: FormatInfo,
    /// The one path that an object without files stands for.
    stands_for: Option<PathBuf>,
}

impl PythonFormat {
    /// # Errors
    /// A usage error if an attribute is of another type than it should be.
    pub(crate) fn new(class: &Bound<'_, PyAny>) -> Answer<Self> {
        let text = |attribute: &str, default: &str| -> Answer<String> {
            let value = class.getattr_opt(attribute).python()?;
            value.map_or_else(|| Ok(default.to_string()), |v| v.extract().python())
        };
        let name = class.getattr("__name__").and_then(|n| n.extract::<String>()).unwrap_or_default();
        let offers =
            class.getattr_opt("offers").python()?.map(|o| o.extract::<Vec<String>>()).transpose().python()?;
        let settings = class
            .getattr_opt("settings")
            .python()?
            .map(|s| s.extract::<std::collections::BTreeMap<String, String>>())
            .transpose()
            .python()?;
        let settings = settings
            .unwrap_or_default()
            .into_iter()
            .map(|(key, description)| SettingInfo { key, description });
        let info = FormatInfo {
            name: text("format_name", &name.to_ascii_lowercase())?,
            description: text("description", &format!("the Python class {name}"))?,
            version: text("version", "0")?,
            offers: offers.unwrap_or_default(),
            settings: settings.collect(),
        };
        Ok(Self { class: class.clone().unbind(), info, stands_for: None })
    }
}

impl DatasetFactory for PythonFormat {
    fn info(&self) -> FormatInfo {
        self.info.clone()
    }

    fn probe(&self, path: &Path) -> Probe {
        if let Some(own) = &self.stands_for {
            return if own == path { Probe::Yes } else { Probe::No };
        }
        Python::attach(|py| {
            // A class that cannot tell is not of the path; what it raises is its author's to see in the check.
            let Ok(answer) = self.class.bind(py).call_method1("probe", (path,)) else { return Probe::No };
            if let Ok(paths) = answer.extract::<Vec<PathBuf>>() {
                return if paths.is_empty() { Probe::No } else { Probe::Collection(paths) };
            }
            if answer.is_truthy().unwrap_or(false) { Probe::Yes } else { Probe::No }
        })
    }

    fn open(&self, path: &Path, options: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
        Python::attach(|py| {
            let class = self.class.bind(py);
            let object = match &self.stands_for {
                Some(own) if own == path => Ok(class.clone()),
                Some(_) => {
                    return Err(
                        DataError::of_kind(ErrorKind::Missing, "is not what the object stands for").at(path)
                    );
                }
                None => {
                    let settings = PyDict::new(py);
                    let set =
                        options.settings.iter().try_for_each(|(key, value)| settings.set_item(key, value));
                    set.and_then(|()| class.call((path,), Some(&settings)))
                }
            };
            let object = object.map_err(|e| data_error(e).at(path))?;
            let mut robot = Robot::new(&object).map_err(|f| data_error(f.into()).at(path))?;
            robot.is_of(&self.info.name);
            Ok(Box::new(robot) as Box<dyn Dataset>)
        })
    }
}

/// The formats that the module knows: registered ones and those of installed packages.
pub(crate) fn known() -> Vec<Box<dyn DatasetFactory>> {
    Python::attach(|py| {
        let found = py
            .import("vicepose._formats")
            .and_then(|module| module.call_method0("all_formats"))
            .and_then(|list| list.cast_into::<PyList>().map_err(Into::into));
        let found = match found {
            Ok(found) => found,
            Err(error) => {
                tracing::warn!("formats written in Python are left out: {error}");
                return Vec::new();
            }
        };
        let classes = found.iter().filter_map(|class| match PythonFormat::new(&class) {
            Ok(format) => Some(format),
            Err(failure) => {
                tracing::warn!("the format {class} is left out: {}", PyErr::from(failure));
                None
            }
        });
        classes.map(|format| Box::new(format) as Box<dyn DatasetFactory>).collect()
    })
}

/// Runs the conformance suite on a class with a data set of it, or on an object. Gives (verdict, text) of each finding.
#[pyfunction]
#[pyo3(signature = (robot, path, cycles, images, progress = None))]
pub(crate) fn check_format(
    py: Python<'_>,
    robot: &Bound<'_, PyAny>,
    path: Option<PathBuf>,
    cycles: u32,
    images: usize,
    progress: Option<Py<PyAny>>,
) -> Answer<Vec<(String, String)>> {
    let is_class = robot.is_instance_of::<pyo3::types::PyType>();
    let mut format = match is_class {
        true => PythonFormat::new(robot)?,
        false => {
            let mut format = PythonFormat::new(&robot.get_type())?;
            format.class = robot.clone().unbind();
            format
        }
    };
    let path = match (path, is_class) {
        (Some(path), true) => path,
        (None, false) => {
            // Something that is there, since formats are asked about paths.
            let own = std::env::current_dir()?;
            format.stands_for = Some(own.clone());
            own
        }
        (None, true) => {
            return Err(usage(
                "path",
                "name a data set of the format, or give an object in place of the class",
            ));
        }
        (Some(_), false) => {
            return Err(usage("path", "an object is open already: leave the path out, or give the class"));
        }
    };
    let thorough =
        Thoroughness { cycles, images, cycles_within: Duration::from_secs(20), ..Thoroughness::default() };
    long(py, progress.as_ref(), move |progress| {
        let options = OpenOptions::default();
        let subject = Subject { factory: &format, plugin: None, path: &path, options: &options };
        let mut found = Vec::new();
        let mut steps = 0;
        check(&subject, &thorough, &mut |event| match event {
            Event::Step(_) => {
                steps += 1;
                progress("checking", steps, steps + 1);
            }
            Event::Finding(verdict, text) => found.push((word(verdict).to_string(), text)),
        });
        Ok(found)
    })
}

const fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Good => "good",
        Verdict::Missing => "missing",
        Verdict::Suspicious => "suspicious",
        Verdict::Fault => "FAULT",
    }
}

/// A line for each format that is known, as `vice formats` tells them.
#[pyfunction]
#[pyo3(signature = (plugins = Vec::new(), allow_writable_plugin = false))]
pub(crate) fn formats(
    py: Python<'_>,
    plugins: Vec<PathBuf>,
    allow_writable_plugin: bool,
) -> Answer<Vec<Py<PyDict>>> {
    let spec = vice_run::request::PluginsSpec {
        files: plugins,
        allow_writable: allow_writable_plugin,
        isolate: None,
    };
    let formats = long(py, None, move |_| vice_run::formats::Formats::load(&spec))?;
    let of = |format: FormatInfo| -> PyResult<Py<PyDict>> {
        let values = PyDict::new(py);
        let plugin = formats.plugins.iter().find(|p| p.plugin.info().name == format.name);
        values.set_item("name", &format.name)?;
        values.set_item("version", &format.version)?;
        values.set_item("description", &format.description)?;
        values.set_item("offers", &format.offers)?;
        let settings = PyDict::new(py);
        for setting in &format.settings {
            settings.set_item(&setting.key, &setting.description)?;
        }
        values.set_item("settings", settings)?;
        values.set_item("plugin", plugin.map(|p| p.plugin.path().to_path_buf()))?;
        Ok(values.unbind())
    };
    formats.registry.formats().into_iter().map(|format| of(format).map_err(Failure::Python)).collect()
}
