//! Clients for the stores that addresses name; credentials come from the environment.

use std::sync::Arc;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use object_store::aws::AmazonS3Builder;
use object_store::gcp::GoogleCloudStorageBuilder;
use object_store::http::HttpBuilder;
use object_store::path::Path;
use object_store::{ClientOptions, HeaderMap, HeaderValue, ObjectStore, RetryConfig};
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_files::address;

use crate::limits::Limits;

/// A store, and the place in it that an address names.
#[derive(Clone)]
pub(crate) struct Client {
    pub(crate) store: Arc<dyn ObjectStore>,
    pub(crate) path: Path,
    /// Whether the store lists its objects.
    pub(crate) lists: bool,
    pub(crate) limits: Limits,
    /// The address without secrets.
    pub(crate) shown: String,
}

impl Client {
    /// The client for an address.
    ///
    /// # Errors
    /// [`DataError`] if the address is none, or the environment does not make a client for it.
    pub(crate) fn new(text: &str) -> DataResult<Self> {
        let shown = address::shown(text).into_owned();
        Self::made(text, &shown).map_err(|e| e.at(&shown))
    }

    fn made(text: &str, shown: &str) -> DataResult<Self> {
        let limits = Limits::read()?;
        let wrong = |what: &str| DataError::of_kind(ErrorKind::Usage, what.to_string());
        let (scheme, rest) = address::split(text).ok_or_else(|| wrong("is no address"))?;
        let (host, key) = rest.split_once('/').unwrap_or((rest, ""));
        if host.is_empty() {
            return Err(wrong("names no bucket or host"));
        }
        // Repeated and bounded in one place, for all stores alike.
        let retry = RetryConfig { max_retries: 0, ..RetryConfig::default() };
        let options = ClientOptions::new()
            .with_timeout(limits.timeout)
            .with_connect_timeout(limits.timeout)
            .with_allow_http(scheme == "http");
        // What the library says names the whole address, and may name keys.
        let failed = |_| {
            DataError::of_kind(ErrorKind::Usage, "the environment does not say how to reach it")
                .hint("docs/remote.md says which variables are read")
        };
        let in_bucket =
            |key: &str| Path::parse(key.trim_end_matches('/')).map_err(|_| wrong("is no key of an object"));
        let (store, path): (Arc<dyn ObjectStore>, Path) = match scheme {
            "s3" => {
                // Read from the environment itself, so that a server on this machine can be named there.
                let plain = std::env::var("AWS_ALLOW_HTTP").is_ok_and(|v| v == "true" || v == "1");
                let made = AmazonS3Builder::from_env()
                    .with_client_options(options.with_allow_http(plain))
                    .with_retry(retry)
                    .with_bucket_name(host);
                (Arc::new(made.build().map_err(failed)?), in_bucket(key)?)
            }
            "gs" => {
                let made = GoogleCloudStorageBuilder::from_env()
                    .with_client_options(options)
                    .with_retry(retry)
                    .with_bucket_name(host);
                (Arc::new(made.build().map_err(failed)?), in_bucket(key)?)
            }
            _ => {
                let (user, plain) = without_user(scheme, rest);
                let options = match user {
                    Some(user) => options.with_default_headers(
                        basic(&user).ok_or_else(|| wrong("has a user that cannot be sent"))?,
                    ),
                    None => options,
                };
                let made = HttpBuilder::new().with_url(plain).with_client_options(options).with_retry(retry);
                (Arc::new(made.build().map_err(failed)?), Path::default())
            }
        };
        let lists = matches!(scheme, "s3" | "gs");
        Ok(Self { store, path, lists, limits, shown: shown.to_string() })
    }
}

/// User and password of an address, and the address without them and without a fragment.
fn without_user(scheme: &str, rest: &str) -> (Option<String>, String) {
    let rest = rest.split('#').next().unwrap_or_default();
    let end = rest.find(['/', '?']).unwrap_or(rest.len());
    let (host, path) = rest.split_at(end);
    match host.rsplit_once('@') {
        Some((user, host)) => (Some(user.to_string()), format!("{scheme}://{host}{path}")),
        None => (None, format!("{scheme}://{rest}")),
    }
}

fn basic(user: &str) -> Option<HeaderMap> {
    let mut value =
        HeaderValue::from_str(&format!("Basic {}", BASE64_STANDARD.encode(decoded(user)))).ok()?;
    value.set_sensitive(true);
    let mut headers = HeaderMap::new();
    headers.insert("authorization", value);
    Some(headers)
}

/// Bytes that stand as `%40` in an address.
fn decoded(text: &str) -> Vec<u8> {
    let bytes = text.as_bytes();
    let (mut out, mut at) = (Vec::new(), 0);
    while at < bytes.len() {
        let hex = text.get(at + 1..at + 3).and_then(|hex| u8::from_str_radix(hex, 16).ok());
        match hex.filter(|_| bytes[at] == b'%') {
            Some(byte) => {
                out.push(byte);
                at += 3;
            }
            None => {
                out.push(bytes[at]);
                at += 1;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_is_taken_out_of_an_address() {
        let (user, plain) = without_user("https", "me:p%40ss@host:8/a?b=c@d#e");
        assert_eq!(user.as_deref(), Some("me:p%40ss"));
        assert_eq!(plain, "https://host:8/a?b=c@d");
        assert_eq!(decoded("me:p%40ss%"), b"me:p@ss%");
        assert_eq!(without_user("http", "h/a@b"), (None, "http://h/a@b".to_string()));
    }
}
