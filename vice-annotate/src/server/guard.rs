//! Who may ask: the holder of the token, from a page of this very server.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{self, HeaderMap, HeaderValue};
use axum::http::{Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use subtle::ConstantTimeEq;
use vice_core::error::{DataError, DataResult};

use super::error::ApiError;

/// Only what comes from here may run, be shown or be asked; nothing may frame the page.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; \
    img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What a request must show.
#[derive(Debug)]
pub(super) struct Guard {
    pub(super) token: String,
    pub(super) address: SocketAddr,
}

/// 128 bits of the operating system's randomness, in hexadecimal.
pub(super) fn new_token() -> DataResult<String> {
    let mut bytes = [0_u8; 16];
    getrandom::fill(&mut bytes)
        .map_err(|e| DataError::new(format!("the system gives no random numbers: {e}")))?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

/// Refuses whom [`Guard`] does not know, and adds the headers that keep the page to itself.
pub(super) async fn check(State(guard): State<Arc<Guard>>, request: Request, next: Next) -> Response {
    let mut response = match guard.refusal(&request) {
        Some(error) => error.into_response(),
        None => next.run(request).await,
    };
    let headers = response.headers_mut();
    let fixed = [
        (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (header::HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        (header::HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    ];
    for (name, value) in fixed {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}

impl Guard {
    fn refusal(&self, request: &Request) -> Option<ApiError> {
        let headers = request.headers();
        let host = text(headers, &header::HOST).unwrap_or_default();
        if !self.is_own_host(host) {
            return Some(
                ApiError::new(StatusCode::MISDIRECTED_REQUEST, "this server does not go by that name")
                    .hint("use the address that vice annotate printed"),
            );
        }
        if !self.is_known(request) {
            return Some(
                ApiError::new(StatusCode::UNAUTHORIZED, "the address lacks the right token")
                    .hint("use the address that vice annotate printed when it was started last"),
            );
        }
        if matches!(*request.method(), Method::GET | Method::HEAD) {
            return None;
        }
        // A browser always says where a write comes from; other programs need not.
        let own =
            text(headers, &header::ORIGIN).is_none_or(|o| o.eq_ignore_ascii_case(&format!("http://{host}")));
        let site = headers.get("sec-fetch-site").map(HeaderValue::as_bytes);
        if !own
            || headers.get_all(header::ORIGIN).iter().count() > 1
            || !matches!(site, None | Some(b"same-origin"))
        {
            return Some(ApiError::new(
                StatusCode::FORBIDDEN,
                "only the annotator's own page may change labels",
            ));
        }
        let json = text(headers, &header::CONTENT_TYPE).is_some_and(|t| {
            t.split(';').next().is_some_and(|t| t.trim().eq_ignore_ascii_case("application/json"))
        });
        if !json && *request.method() != Method::DELETE {
            return Some(ApiError::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "send application/json"));
        }
        None
    }

    fn is_known(&self, request: &Request) -> bool {
        let bearer = text(request.headers(), &header::AUTHORIZATION).and_then(|t| t.strip_prefix("Bearer "));
        let mut query = request.uri().query().unwrap_or_default().split('&');
        let given = bearer.or_else(|| query.find_map(|pair| pair.strip_prefix("token=")));
        given.is_some_and(|given| given.as_bytes().ct_eq(self.token.as_bytes()).into())
    }

    /// A name that another site made point here (DNS rebinding) is not ours; addresses cannot be made to.
    fn is_own_host(&self, host: &str) -> bool {
        let Some((name, port)) = host.rsplit_once(':') else { return false };
        if port.parse() != Ok(self.address.port()) {
            return false;
        }
        let bound = self.address.ip();
        let anywhere = bound.is_unspecified();
        if name.eq_ignore_ascii_case("localhost") {
            return anywhere || bound.is_loopback();
        }
        let name = name.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(name);
        name.parse::<IpAddr>().is_ok_and(|ip| anywhere || ip == bound)
    }
}

fn text<'h>(headers: &'h HeaderMap, name: &header::HeaderName) -> Option<&'h str> {
    headers.get(name).map(|value| value.to_str().unwrap_or("?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_are_addresses_or_localhost() {
        let guard = |address: &str| Guard { token: "t".into(), address: address.parse().unwrap() };
        let here = guard("127.0.0.1:8000");
        assert!(here.is_own_host("127.0.0.1:8000") && here.is_own_host("LOCALHOST:8000"));
        for host in
            ["", "127.0.0.1", "127.0.0.1:8001", "evil.example:8000", "10.0.0.1:8000", "127.0.0.1.nip.io:8000"]
        {
            assert!(!here.is_own_host(host), "{host}");
        }
        assert!(guard("[::1]:8000").is_own_host("[::1]:8000"));
        let all = guard("0.0.0.0:8000");
        assert!(all.is_own_host("192.168.0.7:8000") && !all.is_own_host("evil.example:8000"));
        assert!(!guard("192.168.0.7:8000").is_own_host("localhost:8000"));
    }

    #[test]
    fn tokens_are_long_and_never_the_same() {
        let (a, b) = (new_token().unwrap(), new_token().unwrap());
        assert!(a.len() == 32 && a != b && a.bytes().all(|c| c.is_ascii_hexdigit()));
    }
}
