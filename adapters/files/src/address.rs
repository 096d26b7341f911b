//! Addresses: data that is named by a URL, and how it is shown without what is secret in it.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Schemes of data that lies elsewhere.
const SCHEMES: [&str; 4] = ["s3", "gs", "https", "http"];

/// Whether a path is an address, such as `s3://bucket/flight.mcap`, and no path of this machine.
pub fn is_address(path: impl AsRef<Path>) -> bool {
    path.as_ref().to_str().is_some_and(|text| split(text).is_some())
}

/// Scheme and rest of an address.
pub fn split(text: &str) -> Option<(&str, &str)> {
    let (scheme, rest) = text.split_once("://")?;
    SCHEMES.contains(&scheme).then_some((scheme, rest))
}

/// An address without user, password, query and fragment, which may hold secrets. A path is shown as it is.
pub fn shown(text: &str) -> Cow<'_, str> {
    let Some((scheme, rest)) = split(text) else { return Cow::Borrowed(text) };
    let open = rest.split(['?', '#']).next().unwrap_or_default();
    let (host, path) = open.split_once('/').map_or((open, None), |(host, path)| (host, Some(path)));
    let host = host.rsplit('@').next().unwrap_or_default();
    let plain = match path {
        Some(path) => format!("{scheme}://{host}/{path}"),
        None => format!("{scheme}://{host}"),
    };
    if plain == text { Cow::Borrowed(text) } else { Cow::Owned(plain) }
}

/// A path, or an address without its secrets.
pub fn shown_path(path: &Path) -> Cow<'_, Path> {
    match path.to_str().map(shown) {
        Some(Cow::Owned(text)) => Cow::Owned(PathBuf::from(text)),
        _ => Cow::Borrowed(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_told_from_paths() {
        for address in ["s3://b/k", "gs://b/k", "https://h/a.mcap", "http://127.0.0.1:9/a"] {
            assert!(is_address(address), "{address}");
        }
        for path in ["/data/a.mcap", "a.mcap", "c:\\a", "ftp://h/a", "s3:/b", "", "rel:s3://b/k"] {
            assert!(!is_address(path), "{path}");
        }
    }

    #[test]
    fn secrets_are_not_shown() {
        let signed = "https://user:pass@h:8/a/b.mcap?X-Amz-Signature=abc#part";
        assert_eq!(shown(signed), "https://h:8/a/b.mcap");
        assert_eq!(shown("https://user:p@ss@h"), "https://h");
        assert_eq!(shown("s3://bucket/a b.mcap"), "s3://bucket/a b.mcap");
        assert_eq!(shown("odd?name@there"), "odd?name@there");
        assert_eq!(shown_path(Path::new("http://u@h/x")), Path::new("http://h/x"));
    }
}
