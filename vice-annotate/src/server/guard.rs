//! Who may ask: a browser that was let in, from a page of this very server.
//!
//! An address lets one browser in, once: it is exchanged for a cookie that no script and no other site can use, and is
//! worth nothing from then on, in whatever history or list of processes it stands.

use std::net::{IpAddr, SocketAddr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

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

/// Invitations that are open at a time; the oldest goes.
const MAX_OPEN: usize = 16;

/// Where an address with a token leads.
pub(super) const ENTRANCE: &str = "/open";

/// What a request must show.
pub(super) struct Guard {
    /// Value of the cookie.
    session: String,
    /// Where the server listens.
    address: SocketAddr,
    /// Tokens of addresses that nobody has used yet, oldest first.
    open: Mutex<Vec<String>>,
    /// Who is told the address that was used.
    on_use: Mutex<Option<OnUse>>,
}

/// Who is told the address that was used.
type OnUse = Box<dyn Fn(&str) + Send>;

/// Marks a connection that has shown the cookie: it is not the one to go when there are too many.
#[derive(Clone, Debug, Default)]
pub(super) struct Known(Arc<AtomicBool>);

impl Known {
    pub(super) fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    pub(super) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Makes addresses that let a browser in.
#[derive(Clone)]
pub struct Invitations(Arc<Guard>);

impl Invitations {
    pub(super) fn new(guard: &Arc<Guard>) -> Self {
        Self(Arc::clone(guard))
    }

    /// A new address, which lets one browser in, once.
    ///
    /// # Errors
    /// [`DataError`] if the system gives no random numbers.
    pub fn url(&self) -> DataResult<String> {
        let token = random_hex()?;
        let url = self.0.url(&token);
        let mut open = lock(&self.0.open);
        if open.len() >= MAX_OPEN {
            open.remove(0);
        }
        open.push(token);
        Ok(url)
    }

    /// Has `told` called with each address when it has let somebody in.
    pub fn on_use(&self, told: impl Fn(&str) + Send + 'static) {
        *lock(&self.0.on_use) = Some(Box::new(told));
    }
}

/// 128 bits of the operating system's randomness, in hexadecimal.
fn random_hex() -> DataResult<String> {
    let mut bytes = [0_u8; 16];
    getrandom::fill(&mut bytes)
        .map_err(|e| DataError::new(format!("the system gives no random numbers: {e}")))?;
    Ok(vice_run::text::hex(&bytes))
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The page that a browser gets for its cookie: it goes on to the page itself, whose address holds no secret. A redirect
/// would not do: a browser that was sent here by another program's page would not show a strict cookie at once.
pub(super) async fn enter(State(guard): State<Arc<Guard>>, request: Request) -> Response {
    let token = request.uri().query().and_then(|q| q.split('&').find_map(|pair| pair.strip_prefix("token=")));
    if !token.is_some_and(|token| guard.use_up(token)) {
        return ApiError::new(
            StatusCode::UNAUTHORIZED,
            "this address was used already, or is not the right one",
        )
        .hint("each address opens the page once, in one browser: use the one that vice annotate printed last")
        .into_response();
    }
    let cookie = format!("{}={}; HttpOnly; SameSite=Strict; Path=/", guard.cookie_name(), guard.session);
    let page = "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"0;url=/\">\
                <title>VICE</title><p><a href=\"/\">On to the labels</a>";
    ([(header::SET_COOKIE, cookie), (header::CONTENT_TYPE, "text/html; charset=utf-8".to_string())], page)
        .into_response()
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
    pub(super) fn new(address: SocketAddr) -> DataResult<Self> {
        Ok(Self { session: random_hex()?, address, open: Mutex::default(), on_use: Mutex::default() })
    }

    fn refusal(&self, request: &Request) -> Option<ApiError> {
        let headers = request.headers();
        let host = text(headers, &header::HOST).unwrap_or_default();
        if !self.is_own_host(host) {
            return Some(
                ApiError::new(StatusCode::MISDIRECTED_REQUEST, "this server does not go by that name")
                    .hint("use the address that vice annotate printed"),
            );
        }
        if request.uri().path() == ENTRANCE {
            return None;
        }
        if !self.is_known(request) {
            return Some(
                ApiError::new(StatusCode::UNAUTHORIZED, "this browser was not let in")
                    .hint("use the address that vice annotate printed last; each opens the page once"),
            );
        }
        if let Some(known) = request.extensions().get::<Known>() {
            known.set();
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

    /// Whether the request shows the cookie.
    fn is_known(&self, request: &Request) -> bool {
        let name = self.cookie_name();
        let cookies = request.headers().get_all(header::COOKIE);
        let mut pairs = cookies.iter().filter_map(|v| v.to_str().ok()).flat_map(|v| v.split(';'));
        pairs.any(|pair| {
            pair.trim().split_once('=').is_some_and(|(n, value)| {
                n == name && bool::from(value.as_bytes().ct_eq(self.session.as_bytes()))
            })
        })
    }

    /// Cookies do not tell ports apart, and two annotators may run.
    fn cookie_name(&self) -> String {
        format!("vice_{}", self.address.port())
    }

    /// Whether a token is of an address that nobody has used; it is used now.
    fn use_up(&self, token: &str) -> bool {
        let used = {
            let mut open = lock(&self.open);
            let at = open.iter().position(|t| t.as_bytes().ct_eq(token.as_bytes()).into());
            at.map(|at| open.remove(at))
        };
        let Some(used) = used else { return false };
        if let Some(told) = &*lock(&self.on_use) {
            told(&self.url(&used));
        }
        true
    }

    fn url(&self, token: &str) -> String {
        let shown = match self.address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => {
                (std::net::Ipv4Addr::LOCALHOST, self.address.port()).into()
            }
            IpAddr::V6(ip) if ip.is_unspecified() => {
                (std::net::Ipv6Addr::LOCALHOST, self.address.port()).into()
            }
            _ => self.address,
        };
        format!("http://{shown}{ENTRANCE}?token={token}")
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

    fn guard(address: &str) -> Guard {
        Guard::new(address.parse().unwrap()).unwrap()
    }

    #[test]
    fn hosts_are_addresses_or_localhost() {
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
        assert!(all.url("t").starts_with("http://127.0.0.1:8000/"));
        assert!(!guard("192.168.0.7:8000").is_own_host("localhost:8000"));
    }

    #[test]
    fn an_address_lets_in_once_and_few_are_open() {
        let guard = Arc::new(guard("127.0.0.1:8000"));
        let invitations = Invitations::new(&guard);
        let used = Arc::new(Mutex::new(Vec::new()));
        let told = Arc::clone(&used);
        invitations.on_use(move |url| told.lock().unwrap().push(url.to_string()));
        let urls: Vec<String> = (0..=MAX_OPEN).map(|_| invitations.url().unwrap()).collect();
        let token = |url: &str| url.rsplit_once("token=").unwrap().1.to_string();
        assert!(!guard.use_up(&token(&urls[0])), "the oldest has gone");
        assert!(!guard.use_up("") && !guard.use_up(&"0".repeat(32)));
        assert!(guard.use_up(&token(&urls[1])) && !guard.use_up(&token(&urls[1])));
        assert_eq!(*used.lock().unwrap(), urls[1..2]);
    }

    #[test]
    fn only_the_cookie_of_this_server_is_known() {
        let guard = guard("127.0.0.1:8000");
        let asks = |cookie: &str| {
            guard.is_known(
                &Request::builder().header("Cookie", cookie).body(axum::body::Body::empty()).unwrap(),
            )
        };
        let session = &guard.session;
        assert!(session.len() == 32 && asks(&format!("a=b; vice_8000={session}")));
        for cookie in [format!("vice_8001={session}"), format!("vice_8000={session}0"), "vice_8000=".into()] {
            assert!(!asks(&cookie), "{cookie}");
        }
    }
}
