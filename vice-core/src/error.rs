//! The error of everything that reads data: what is wrong, where, and what to do about it.

use std::fmt;
use std::path::{Path, PathBuf};

/// A place inside a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// A line, counted from 1.
    Line(u64),
    /// A byte offset, counted from 0.
    Byte(u64),
}

/// What kind of thing is wrong, for callers that act on it: exit codes and exceptions follow from it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A file, stream, camera or topic that is asked for is not there.
    Missing,
    /// Bytes or numbers that cannot be what they should be.
    #[default]
    Corrupt,
    /// Well-formed data that VICE does not read.
    Unsupported,
    /// Two statements of the data, or of the data and the request, that exclude each other.
    Contradictory,
    /// A request that makes no sense, whatever the data.
    Usage,
}

/// Data that cannot be used. Shown as one line: `path:line: problem (hint)`, then its cause.
///
/// ```
/// use vice_core::error::{DataError, ErrorKind};
///
/// let error = DataError::of_kind(ErrorKind::Corrupt, "the stamp is no number")
///     .at("poses.txt")
///     .line(7)
///     .hint("seconds, such as 1403715273.26");
/// assert_eq!(error.to_string(), "poses.txt:7: the stamp is no number (seconds, such as 1403715273.26)");
/// ```
#[derive(Debug)]
pub struct DataError {
    kind: ErrorKind,
    path: Option<PathBuf>,
    place: Option<Place>,
    problem: String,
    hint: Option<String>,
    source: Option<Box<dyn std::error::Error + Send + Sync>>,
}

/// The result of reading data.
pub type DataResult<T> = Result<T, DataError>;

impl DataError {
    /// An error that says what is wrong, in words a user understands.
    pub fn new(problem: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::default(),
            path: None,
            place: None,
            problem: problem.into(),
            hint: None,
            source: None,
        }
    }

    /// An error of a kind; [`DataError::new`] is [`ErrorKind::Corrupt`].
    pub fn of_kind(kind: ErrorKind, problem: impl Into<String>) -> Self {
        Self { kind, ..Self::new(problem) }
    }

    /// What another error says, which stays its cause: a place or a hint can be added to it.
    pub fn of(source: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self::new(source.to_string()).because(source)
    }

    /// What kind of thing is wrong.
    pub const fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Adds the file or folder, unless one nearer to the cause is there already.
    #[must_use]
    pub fn at(mut self, path: impl AsRef<Path>) -> Self {
        self.path.get_or_insert_with(|| path.as_ref().to_path_buf());
        self
    }

    /// Adds the line, counted from 1.
    #[must_use]
    pub fn line(mut self, line: u64) -> Self {
        self.place.get_or_insert(Place::Line(line));
        self
    }

    /// Adds the byte offset, counted from 0.
    #[must_use]
    pub fn byte(mut self, byte: u64) -> Self {
        self.place.get_or_insert(Place::Byte(byte));
        self
    }

    /// Adds what the user can do.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Adds the cause.
    #[must_use]
    pub fn because(mut self, source: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        self.source = Some(source.into());
        self
    }

    /// Names another place wherever it names `from` or what lies below it: what is read may be a copy of what was asked for.
    #[must_use]
    pub fn renamed(mut self, from: &Path, to: &str) -> Self {
        let told = |text: &str| text.replace(&*from.to_string_lossy(), to);
        self.path = self.path.map(|path| PathBuf::from(told(&path.to_string_lossy())));
        self.problem = told(&self.problem);
        self.hint = self.hint.as_deref().map(told);
        self.source = self.source.map(|source| match source.downcast::<Self>() {
            Ok(inner) => Box::new(inner.renamed(from, to)) as Box<dyn std::error::Error + Send + Sync>,
            Err(other) => other,
        });
        self
    }

    /// What is wrong, without place and hint.
    pub fn problem(&self) -> &str {
        &self.problem
    }

    /// What the user can do, where something is known; names of a request's fields stand in back quotes.
    pub fn hint_text(&self) -> Option<&str> {
        self.hint.as_deref()
    }

    /// The file or folder, where known.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// The place in the file, where known.
    pub const fn place(&self) -> Option<Place> {
        self.place
    }
}

impl fmt::Display for DataError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(path) = &self.path {
            write!(f, "{}", path.display())?;
            match self.place {
                Some(Place::Line(line)) => write!(f, ":{line}: ")?,
                Some(Place::Byte(byte)) => write!(f, ": byte {byte}: ")?,
                None => write!(f, ": ")?,
            }
        } else if let Some(place) = self.place {
            match place {
                Place::Line(line) => write!(f, "line {line}: ")?,
                Place::Byte(byte) => write!(f, "byte {byte}: ")?,
            }
        }
        write!(f, "{}", self.problem)?;
        if let Some(hint) = &self.hint {
            write!(f, " ({hint})")?;
        }
        Ok(())
    }
}

impl std::error::Error for DataError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.source.as_deref().map(|s| s as &(dyn std::error::Error + 'static))
    }
}

/// An error and its causes on one line, each said once.
pub fn one_line(error: &dyn std::error::Error) -> String {
    let mut line = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let text = error.to_string();
        // Wrappers repeat what they wrap, with a place before or a hint behind it.
        if !line.contains(&text) {
            line.push_str(": ");
            line.push_str(&text);
        }
        cause = error.source();
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causes_stand_on_the_same_line_and_each_once() {
        let inner = DataError::new("disk on fire");
        let error = DataError::new("cannot be read").at("a.bag").because(inner);
        assert_eq!(one_line(&error), "a.bag: cannot be read: disk on fire");
        let twice = DataError::new("cannot be read: disk on fire").because(DataError::new("disk on fire"));
        assert_eq!(one_line(&twice), "cannot be read: disk on fire");
        let wrapped = DataError::of(std::io::Error::other("disk on fire")).at("a.bag").hint("call for help");
        assert_eq!(one_line(&wrapped), "a.bag: disk on fire (call for help)");
        assert!(std::error::Error::source(&wrapped).is_some_and(|s| s.is::<std::io::Error>()));
    }

    #[test]
    fn a_copy_is_told_by_what_it_is_a_copy_of() {
        let inner = DataError::new("cut off").at("/cache/1/b/x.csv").line(3);
        let error = DataError::new("beside /cache/1/b").at("/cache/1/b/y").because(inner);
        let told = one_line(&error.renamed(Path::new("/cache/1/b"), "s3://b"));
        assert_eq!(told, "s3://b/y: beside s3://b: s3://b/x.csv:3: cut off");
    }

    #[test]
    fn the_place_nearest_to_the_cause_wins() {
        let error =
            DataError::new("x is NaN").at("poses.csv").line(7).at("folder").line(9).hint("remove the row");
        assert_eq!(error.to_string(), "poses.csv:7: x is NaN (remove the row)");
        assert_eq!(DataError::new("cut off").at("a.bag").byte(12).to_string(), "a.bag: byte 12: cut off");
        assert_eq!(DataError::new("cut off").line(3).to_string(), "line 3: cut off");
    }
}
