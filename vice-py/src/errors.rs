//! What goes wrong, as exceptions of its kind.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use vice_run::core::error::{DataError, ErrorKind, Place, one_line};
use vice_run::error::RunError;
use vice_run::text::is_field;

/// The module of the exceptions.
const MODULE: &str = "vicepose._errors";

/// Why a call has no answer.
#[derive(Debug)]
pub(crate) enum Failure {
    /// What the libraries say.
    Run(RunError),
    /// What Python says: a signal, or an argument of another type.
    Python(PyErr),
    /// A defect.
    Panicked(String),
}

/// The answer of a call.
pub(crate) type Answer<T> = Result<T, Failure>;

/// An argument that makes no sense.
pub(crate) fn usage(field: &'static str, problem: impl Into<String>) -> Failure {
    Failure::Run(RunError::usage(field, problem))
}

/// Something that is asked for and is not there.
pub(crate) fn missing(problem: impl Into<String>) -> Failure {
    Failure::Run(RunError::missing(problem))
}

impl<E: Into<RunError>> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Run(error.into())
    }
}

/// An error of Python; `?` on the other kinds of errors goes through `From`.
pub(crate) trait OfPython<T> {
    fn python(self) -> Answer<T>;
}

impl<T, E: Into<PyErr>> OfPython<T> for Result<T, E> {
    fn python(self) -> Answer<T> {
        self.map_err(|e| Failure::Python(e.into()))
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Python(error) => error,
            Failure::Run(error) => Python::attach(|py| exception(py, &error)),
            Failure::Panicked(text) => Python::attach(|py| internal(py, &text)),
        }
    }
}

/// A defect of ours. The interpreter goes on: nothing is left half done that a caller could see.
fn internal(py: Python<'_>, text: &str) -> PyErr {
    let told = format!("this is a defect of VICE, please report it: {text}");
    raised(py, "InternalError", &told, &PyDict::new(py))
}

fn raised(py: Python<'_>, class: &str, text: &str, values: &Bound<'_, PyDict>) -> PyErr {
    let made = py
        .import(MODULE)
        .and_then(|module| module.getattr(class))
        .and_then(|class| class.call((text,), Some(values)));
    match made {
        Ok(value) => PyErr::from_value(value),
        Err(error) => error,
    }
}

const fn class(kind: ErrorKind) -> &'static str {
    match kind {
        ErrorKind::Missing => "MissingError",
        ErrorKind::Unsupported => "UnsupportedError",
        ErrorKind::Contradictory => "ContradictoryError",
        ErrorKind::Usage => "UsageError",
        _ => "CorruptError",
    }
}

fn exception(py: Python<'_>, error: &RunError) -> PyErr {
    let values = PyDict::new(py);
    let mut hint = error.hint();
    let mut of_python = None;
    let mut cause: Option<&(dyn std::error::Error + 'static)> = std::error::Error::source(error);
    let mut field = error.field();
    while let Some(inner) = cause {
        if let Some(data) = inner.downcast_ref::<DataError>() {
            hint = hint.or(data.hint_text());
            set_place(&values, data);
        }
        if let Some(run) = inner.downcast_ref::<RunError>() {
            (hint, field) = (hint.or(run.hint()), field.or(run.field()));
        }
        of_python = of_python.or(inner.downcast_ref::<PyErr>());
        cause = inner.source();
    }
    // Keys are ours and values plain, so that setting them cannot fail for a reason a user could act on.
    let _ = values.set_item("hint", hint.map(as_arguments));
    let _ = values.set_item("argument", field.map(|f| f.replace('-', "_")));
    let mut text = as_arguments(&one_line(error));
    if let Some(own) = error.field() {
        text = text.replacen(&format!("{own}: "), &format!("{}: ", own.replace('-', "_")), 1);
    }
    let raised = raised(py, class(error.kind()), &text, &values);
    if let Some(cause) = of_python {
        raised.set_cause(py, Some(cause.clone_ref(py)));
    }
    raised
}

/// The place nearest to the cause wins: causes come later.
fn set_place(values: &Bound<'_, PyDict>, data: &DataError) {
    if let Some(path) = data.path() {
        let _ = values.set_item("path", path.display().to_string());
    }
    match data.place() {
        Some(Place::Line(line)) => drop(values.set_item("line", line)),
        Some(Place::Byte(byte)) => drop(values.set_item("byte", byte)),
        _ => {}
    }
}

/// Names of fields in back quotes as arguments: `max-gap` as `max_gap`.
fn as_arguments(text: &str) -> String {
    let parts = text.split('`').enumerate();
    let parts = parts.map(|(place, part)| match place % 2 == 1 && is_field(part) {
        true => part.replace('-', "_"),
        false => part.to_string(),
    });
    parts.collect::<Vec<_>>().join("`")
}

/// What a format written in Python says is wrong, as an error of data: exceptions of this module keep their kind.
pub(crate) fn data_error(error: PyErr) -> DataError {
    Python::attach(|py| {
        let value = error.value(py);
        let name = value.get_type().qualname().map_or_else(|_| "error".to_string(), |n| n.to_string());
        let text = |attribute: &str| value.getattr(attribute).ok()?.extract::<Option<String>>().ok()?;
        let kind = match name.as_str() {
            "MissingError" | "FileNotFoundError" => ErrorKind::Missing,
            "UnsupportedError" | "NotImplementedError" => ErrorKind::Unsupported,
            "ContradictoryError" => ErrorKind::Contradictory,
            "UsageError" => ErrorKind::Usage,
            _ => ErrorKind::Corrupt,
        };
        let said = value.to_string();
        let ours = name.ends_with("Error") && value.hasattr("hint").unwrap_or(false);
        let said = if ours || said.is_empty() { said } else { format!("{name}: {said}") };
        let mut data = DataError::of_kind(kind, if said.is_empty() { name } else { said });
        if let Some(hint) = text("hint") {
            data = data.hint(hint);
        }
        if let (Some(path), true) = (text("path"), ours) {
            data = data.at(path);
        }
        data.because(error)
    })
}
