//! What goes wrong with a request, in words that give away no secrets.

use object_store::Error;
use vice_core::error::{DataError, ErrorKind};

/// Why a request failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Failure {
    Missing,
    Denied,
    /// The object is not what it was.
    Changed(String),
    /// The server gives no parts of files.
    NoRanges,
    /// Something that may go better the next time.
    Passing(String),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        match &error {
            Error::NotFound { .. } => Self::Missing,
            Error::PermissionDenied { .. } | Error::Unauthenticated { .. } => Self::Denied,
            Error::Precondition { .. } => Self::Changed("the server has another version of it".to_string()),
            Error::NotSupported { .. } => Self::NoRanges,
            _ => Self::Passing(words(&error)),
        }
    }
}

/// What the innermost cause says: the outer ones repeat the address with all that is in it.
fn words(error: &Error) -> String {
    let mut cause: &dyn std::error::Error = error;
    while let Some(inner) = cause.source() {
        cause = inner;
    }
    let text = cause.to_string();
    let text = text.split_whitespace().map(without_secrets).collect::<Vec<_>>().join(" ");
    let short = text.char_indices().nth(200).map_or(text.len(), |(at, _)| at);
    text[..short].trim_end_matches([':', ' ']).to_string()
}

/// A word of a message, without query and user where it has an address in it.
fn without_secrets(word: &str) -> String {
    match word.find("://") {
        Some(at) => {
            let start = word[..at].rfind(|c: char| !c.is_alphanumeric()).map_or(0, |i| i + 1);
            let rest = word[at + 3..].split(['?', '#']).next().unwrap_or_default();
            let (host, path) = rest.split_once('/').unwrap_or((rest, ""));
            let host = host.rsplit('@').next().unwrap_or_default();
            format!("{}{}/{path}", &word[..start], &word[start..at + 3])
                .replace(":///", &format!("://{host}/"))
        }
        None => word.to_string(),
    }
}

impl Failure {
    /// Whether the same request may succeed later.
    pub(crate) const fn may_pass(&self) -> bool {
        matches!(self, Self::Passing(_))
    }

    /// The error of an object, whose address is shown as `shown`.
    pub(crate) fn error(self, shown: &str, tries: u32) -> DataError {
        match self {
            Self::Missing => DataError::of_kind(ErrorKind::Missing, "no such object"),
            Self::Denied => DataError::of_kind(ErrorKind::Missing, "may not be read")
                .hint("credentials are taken from the environment; docs/remote.md says which"),
            Self::Changed(how) => {
                DataError::of_kind(ErrorKind::Corrupt, format!("has changed while it was read: {how}"))
                    .hint("run it again once nobody writes to it")
            }
            Self::NoRanges => {
                DataError::of_kind(ErrorKind::Unsupported, "the server gives no parts of files")
            }
            Self::Passing(words) => {
                let times = if tries == 1 { "once".to_string() } else { format!("{tries} times") };
                DataError::of_kind(ErrorKind::Missing, format!("cannot be fetched, tried {times}: {words}"))
            }
        }
        .at(shown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_others_lose_what_is_secret() {
        let word = "(https://me:word@host:8/a/b?X-Amz-Signature=abc)";
        assert_eq!(without_secrets(word), "(https://host:8/a/b");
        assert_eq!(without_secrets("plain"), "plain");
        let inner = std::io::Error::other("GET https://u:p@h/k?sig=1: connection reset");
        let error = Error::Generic { store: "HTTP", source: Box::new(inner) };
        assert_eq!(words(&error), "GET https://h/k connection reset");
    }

    #[test]
    fn kinds_follow_from_what_is_wrong() {
        let kind = |f: Failure| f.error("s3://b/k", 1).kind();
        assert_eq!(kind(Failure::Changed(String::new())), ErrorKind::Corrupt);
        assert_eq!(kind(Failure::Missing), ErrorKind::Missing);
        let line = Failure::Passing("503".to_string()).error("s3://b/k", 6).to_string();
        assert_eq!(line, "s3://b/k: cannot be fetched, tried 6 times: 503");
    }
}
