//! Documents: what a command would print, and what it would write.

use std::collections::BTreeMap;
use std::path::PathBuf;

use pyo3::prelude::*;
use vice_run::files::atomic::{self, Overwrite};

use crate::errors::{Answer, OfPython, missing, usage};

/// What a function found. ``print`` shows what the program prints, ``document()`` is all of it as a dictionary, and what
/// is written has the program's bytes.
#[pyclass(frozen, module = "vicepose")]
pub(crate) struct Document {
    json: String,
    text: String,
    /// Other forms, by the ending of a file's name; why there is none, where something speaks against it.
    forms: BTreeMap<&'static str, Result<Vec<u8>, String>>,
    suspicions: Vec<String>,
}

impl Document {
    pub(crate) fn new(json: String, text: String) -> Self {
        Self { json, text, forms: BTreeMap::new(), suspicions: Vec::new() }
    }

    pub(crate) fn with(mut self, ending: &'static str, bytes: Vec<u8>) -> Self {
        self.forms.insert(ending, Ok(bytes));
        self
    }

    pub(crate) fn with_or_why(mut self, ending: &'static str, form: Result<Vec<u8>, String>) -> Self {
        self.forms.insert(ending, form);
        self
    }

    pub(crate) fn suspecting(mut self, lines: Vec<String>) -> Self {
        self.suspicions = lines;
        self
    }

    fn form(&self, ending: &str) -> Answer<&[u8]> {
        match self.forms.get(ending) {
            Some(Ok(bytes)) => Ok(bytes),
            Some(Err(why)) => Err(crate::errors::Failure::Run(vice_run::error::RunError::new(
                vice_run::core::error::ErrorKind::Contradictory,
                why,
            ))),
            None => {
                let known: Vec<&str> = self.forms.keys().copied().collect();
                Err(usage(
                    "path",
                    format!("there is no form `{ending}` of it; there are json, {}", known.join(", ")),
                ))
            }
        }
    }
}

/// Writes beside and renames.
pub(crate) fn write(path: &std::path::Path, bytes: &[u8]) -> Answer<()> {
    Ok(atomic::write(path, Overwrite::Replace, |out| out.write_all(bytes))?)
}

/// Text of JSON as what Python makes of it.
pub(crate) fn loads<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (json,))
}

#[pymethods]
impl Document {
    /// Schema of the document, such as ``vice.diagnosis/1``.
    #[getter]
    fn schema(&self, py: Python<'_>) -> PyResult<String> {
        loads(py, &self.json)?.get_item("schema")?.extract()
    }

    /// What looked wrong in the data, a line each.
    #[getter]
    fn suspicions(&self) -> Vec<String> {
        self.suspicions.clone()
    }

    /// All of it as a dictionary.
    fn document<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        loads(py, &self.json)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        loads(py, &self.json)?.get_item(key)
    }

    /// Writes the document of the program's ``--json``, the same bytes; without a path it is returned.
    #[pyo3(signature = (path = None))]
    fn to_json(&self, path: Option<PathBuf>) -> Answer<Option<String>> {
        match path {
            None => Ok(Some(self.json.clone())),
            Some(path) => write(&path, self.json.as_bytes()).map(|()| None),
        }
    }

    /// Writes the form that the ending of the name asks for: ``csv``, ``tex``, ``svg``, ``zip`` (for evo_res), ``toml``
    /// (the corrected calibration of a diagnosis), whichever there is.
    fn save(&self, path: PathBuf) -> Answer<()> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_string();
        match ending.as_str() {
            "json" => write(&path, self.json.as_bytes()),
            _ => write(&path, self.form(&ending)?),
        }
    }

    /// A form as text: ``csv``, ``tex``, ``svg``, ``toml``.
    fn text(&self, form: &str) -> Answer<String> {
        String::from_utf8(self.form(form)?.to_vec())
            .map_err(|_| missing(format!("the form {form} is no text: save it")))
    }

    fn __str__(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> &str {
        self.text.trim_end()
    }

    fn _repr_html_(&self, py: Python<'_>) -> Answer<String> {
        let escaped =
            py.import("html").and_then(|h| h.call_method1("escape", (&self.text,))?.extract::<String>());
        Ok(format!("<pre>{}</pre>", escaped.python()?))
    }
}
