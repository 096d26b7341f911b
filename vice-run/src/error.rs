//! What can go wrong between a request and a result.

use std::fmt;

use vice_core::diagnose::DiagnoseError;
use vice_core::error::{DataError, ErrorKind};
use vice_core::evaluate::EvaluateError;

/// A cause of any type.
type Source = Box<dyn std::error::Error + Send + Sync>;

/// Why a request has no result.
///
/// It names no option of a command line: [`RunError::field`] is the field of the request that is wrong, and names of
/// fields stand in back quotes in [`RunError::hint`]. Who asked says them as it was asked.
#[derive(Debug)]
pub struct RunError {
    kind: ErrorKind,
    field: Option<&'static str>,
    problem: String,
    hint: Option<String>,
    source: Option<Source>,
}

/// The result of a request.
pub type RunResult<T> = Result<T, RunError>;

impl RunError {
    /// An error of a kind.
    pub fn new(kind: ErrorKind, problem: impl Into<String>) -> Self {
        Self { kind, field: None, problem: problem.into(), hint: None, source: None }
    }

    /// A field of the request that makes no sense, or not with this data. Fields are named as in the request, with
    /// dashes in place of underlines: `time-offset`.
    pub fn usage(field: &'static str, problem: impl Into<String>) -> Self {
        Self { field: Some(field), ..Self::new(ErrorKind::Usage, problem) }
    }

    /// Something that is asked for and is not there.
    pub fn missing(problem: impl Into<String>) -> Self {
        Self::new(ErrorKind::Missing, problem)
    }

    /// Adds the field of the request that it is about.
    #[must_use]
    pub const fn of(mut self, field: &'static str) -> Self {
        self.field = Some(field);
        self
    }

    /// Adds what can be done; fields of the request in back quotes.
    #[must_use]
    pub fn advise(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Adds the cause.
    #[must_use]
    pub fn because(mut self, source: impl Into<Source>) -> Self {
        self.source = Some(source.into());
        self
    }

    /// What kind of thing is wrong.
    pub const fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The field of the request that is wrong, where it is one.
    pub const fn field(&self) -> Option<&'static str> {
        self.field
    }

    /// What is wrong, without field and hint.
    pub fn problem(&self) -> &str {
        &self.problem
    }

    /// What can be done, with fields of the request in back quotes.
    pub fn hint(&self) -> Option<&str> {
        self.hint.as_deref()
    }
}

impl fmt::Display for RunError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(field) = self.field {
            write!(f, "{field}: ")?;
        }
        match &self.source {
            Some(source) if self.problem.is_empty() => write!(f, "{source}")?,
            _ => write!(f, "{}", self.problem)?,
        }
        match &self.hint {
            Some(hint) => write!(f, " ({hint})"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for RunError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.source.as_deref().map(|s| s as &(dyn std::error::Error + 'static))
    }
}

/// The error itself is the whole message: it stays the cause, so that its own type can be asked for.
fn wrapped(kind: ErrorKind, error: impl std::error::Error + Send + Sync + 'static) -> RunError {
    RunError { source: Some(Box::new(error)), ..RunError::new(kind, String::new()) }
}

impl From<DataError> for RunError {
    fn from(error: DataError) -> Self {
        wrapped(error.kind(), error)
    }
}

impl From<EvaluateError> for RunError {
    fn from(error: EvaluateError) -> Self {
        let kind = match &error {
            EvaluateError::Data(inner) => inner.kind(),
            EvaluateError::EmptyWindow
            | EvaluateError::NoManualKeyframe
            | EvaluateError::NoCertainKeyframe
            | EvaluateError::SubsetTooLarge { .. } => ErrorKind::Usage,
            EvaluateError::NoFrames | EvaluateError::NoLabels | EvaluateError::NoStream => ErrorKind::Missing,
            _ => ErrorKind::Contradictory,
        };
        let hint = match &error {
            EvaluateError::EmptyWindow => Some("see `start` and `duration`"),
            EvaluateError::NoManualKeyframe | EvaluateError::NoCertainKeyframe => Some("see `observations`"),
            _ => None,
        };
        match hint {
            Some(hint) => RunError::new(kind, error.to_string()).advise(hint),
            None => wrapped(kind, error),
        }
    }
}

impl From<DiagnoseError> for RunError {
    fn from(error: DiagnoseError) -> Self {
        match error {
            DiagnoseError::Evaluate(inner) => inner.into(),
            error => wrapped(ErrorKind::Contradictory, error),
        }
    }
}

impl From<std::io::Error> for RunError {
    fn from(error: std::io::Error) -> Self {
        let kind = match error.kind() {
            std::io::ErrorKind::NotFound => ErrorKind::Missing,
            _ => ErrorKind::Corrupt,
        };
        wrapped(kind, error)
    }
}

/// What cannot happen with the values at hand, and yet is not worth a panic: an encoder that fails.
macro_rules! from_encoders {
    ($($error:ty),+) => {
        $(impl From<$error> for RunError {
            fn from(error: $error) -> Self {
                wrapped(ErrorKind::Corrupt, error)
            }
        })+
    };
}

from_encoders!(
    csv::Error,
    serde_json::Error,
    fmt::Error,
    std::string::FromUtf8Error,
    zip::result::ZipError,
    vice_core::camera::CameraError,
    vice_core::time::TimeError
);

/// A mistake of a kind, with words of one's own before it.
pub(crate) trait Context<T> {
    /// Adds what was being done. The kind stays.
    fn context(self, what: impl FnOnce() -> String) -> RunResult<T>;
}

impl<T, E: Into<RunError>> Context<T> for Result<T, E> {
    fn context(self, what: impl FnOnce() -> String) -> RunResult<T> {
        self.map_err(|error| {
            let inner: RunError = error.into();
            RunError { source: Some(Box::new(inner)), ..RunError::new(ErrorKind::default(), what()) }
                .kind_of_cause()
        })
    }
}

impl RunError {
    /// The kind of the nearest cause that has one.
    fn kind_of_cause(mut self) -> Self {
        if let Some(inner) = self.source.as_deref().and_then(|s| s.downcast_ref::<Self>()) {
            self.kind = inner.kind;
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::error::one_line;

    #[test]
    fn a_cause_keeps_its_kind_and_is_said_once() {
        let missing = DataError::of_kind(ErrorKind::Missing, "no such file").at("a.txt");
        let error = Err::<(), _>(missing).context(|| "cannot start".to_string()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Missing);
        assert_eq!(one_line(&error), "cannot start: a.txt: no such file");
        let bare: RunError = DataError::new("broken").at("b.txt").line(3).into();
        assert_eq!(one_line(&bare), "b.txt:3: broken");
    }

    #[test]
    fn a_wrong_field_is_named_with_what_to_do() {
        let error = RunError::usage("anchor", "there is no reference").advise("give `reference`");
        assert_eq!(error.to_string(), "anchor: there is no reference (give `reference`)");
        let empty: RunError = EvaluateError::EmptyWindow.into();
        assert_eq!((empty.kind(), empty.hint()), (ErrorKind::Usage, Some("see `start` and `duration`")));
    }
}
