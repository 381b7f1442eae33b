//! Access to the pages: for browsers that know the token, and for requests from pages of
//! this address.

use std::{net::SocketAddr, sync::Arc, time::Duration};

use axum::{
    body::to_bytes,
    extract::{Request, State},
    http::{
        HeaderMap, HeaderName, HeaderValue, StatusCode,
        header::{
            CACHE_CONTROL, CONTENT_SECURITY_POLICY, COOKIE, HOST, ORIGIN, REFERRER_POLICY,
            SET_COOKIE, X_CONTENT_TYPE_OPTIONS,
        },
    },
    middleware::Next,
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use subtle::ConstantTimeEq as _;
use swarm_transport::{Token, listening::Peer};
use tokio::time::timeout;

use super::{
    assets,
    limits::{BODY_LEN_MAX, BODY_TIME},
    problem::{Body, Problem},
};

/// The purpose from which the cookie is derived.
const PURPOSE: &str = "swarmevo web session";
/// Delay after a wrong token, which prevents guessing.
const WRONG_TOKEN_PAUSE: Duration = Duration::from_millis(500);

/// Who may see the pages.
#[derive(Debug)]
pub struct Access {
    token: Option<Token>,
    /// The cookie of browsers that have shown the token. It does not reveal the token,
    /// and stays valid across restarts until the token changes.
    cookie: Option<String>,
    /// Browsers share cookies among all ports of a machine, so the name has the port.
    cookie_name: String,
    is_encrypted: bool,
    is_loopback: bool,
}

impl Access {
    pub fn new(token: Option<Token>, is_encrypted: bool, address: SocketAddr) -> Self {
        let cookie = token.as_ref().map(|token| token.derived(PURPOSE));
        let is_loopback = address.ip().to_canonical().is_loopback();
        let cookie_name = format!("swarm-session-{}", address.port());
        Self { token, cookie, cookie_name, is_encrypted, is_loopback }
    }

    /// Whether the browser of a request has shown the token, or none is needed.
    fn is_known(&self, headers: &HeaderMap) -> bool {
        let Some(expected) = &self.cookie else { return true };
        let cookies = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
        cookies.flat_map(|cookies| cookies.split(';')).any(|cookie| {
            let value = cookie
                .trim()
                .strip_prefix(&*self.cookie_name)
                .and_then(|rest| rest.strip_prefix('='));
            value.is_some_and(|value| value.as_bytes().ct_eq(expected.as_bytes()).into())
        })
    }

    /// If the pages are for this machine only: whether the address names this machine. A
    /// request under another site's name is an attack.
    fn is_ours(&self, host: &str) -> bool {
        let name = match host.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
            _ => host,
        };
        !self.is_loopback || ["localhost", "127.0.0.1", "[::1]"].contains(&name)
    }
}

/// Lets a request through, or answers it.
pub async fn check(
    State(access): State<Arc<Access>>,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let headers = request.headers();
    let text = |name| headers.get(name).and_then(|value: &HeaderValue| value.to_str().ok());
    let host = text(HOST).or_else(|| request.uri().host()).unwrap_or_default();
    if !access.is_ours(host) {
        let why = "this address serves localhost only; open it by that name";
        return Err(Problem::new(StatusCode::MISDIRECTED_REQUEST, why));
    }
    if !request.method().is_safe() && !is_same_origin(text(ORIGIN), host) {
        let why = "the request does not come from a page of this address";
        return Err(Problem::new(StatusCode::FORBIDDEN, why));
    }
    let path = request.uri().path();
    let is_public = path == "/login" || path.starts_with(assets::PREFIX);
    if !is_public && !access.is_known(headers) {
        if path.starts_with("/api/") {
            let why = "log in again: the token has changed";
            return Err(Problem::new(StatusCode::UNAUTHORIZED, why));
        }
        // The login page appears at the same address, which reloads after the login.
        return Ok(secured((StatusCode::UNAUTHORIZED, assets::login()).into_response()));
    }
    if !is_public && let Some(peer) = request.extensions().get::<Peer>() {
        peer.admitted().await;
    }
    let request = if request.method().is_safe() { request } else { whole(request).await? };
    Ok(secured(next.run(request).await))
}

/// A request with its whole body, which must be short and arrive in time.
async fn whole(request: Request) -> Result<Request, Problem> {
    let (head, body) = request.into_parts();
    let body = timeout(BODY_TIME, to_bytes(body, BODY_LEN_MAX)).await;
    let body = body.map_err(|_| {
        let why = "the request's body did not arrive in time";
        Problem::new(StatusCode::REQUEST_TIMEOUT, why)
    })?;
    let body = body.map_err(|_| {
        let why = format!("the request's body is longer than {BODY_LEN_MAX} bytes, or broke off");
        Problem::new(StatusCode::PAYLOAD_TOO_LARGE, why)
    })?;
    Ok(Request::from_parts(head, body.into()))
}

/// Browsers send the origin of requests that change something.
fn is_same_origin(origin: Option<&str>, host: &str) -> bool {
    let authority =
        origin.and_then(|origin| origin.split_once("://")).map(|(_, authority)| authority);
    authority == Some(host)
}

/// Tells browsers to load nothing from other servers, and not to embed the pages.
fn secured(mut response: Response) -> Response {
    let headers = response.headers_mut();
    let fixed = |text: &'static str| HeaderValue::from_static(text);
    headers.insert(CONTENT_SECURITY_POLICY, assets::policy().clone());
    headers.insert(X_CONTENT_TYPE_OPTIONS, fixed("nosniff"));
    headers.insert(REFERRER_POLICY, fixed("no-referrer"));
    headers.insert(HeaderName::from_static("cross-origin-opener-policy"), fixed("same-origin"));
    headers.entry(CACHE_CONTROL).or_insert(fixed("no-store"));
    response
}

/// The body of a login request.
#[derive(Deserialize)]
pub struct Login {
    token: String,
}

/// Answers the right token with a cookie.
pub async fn login(
    State(access): State<Arc<Access>>,
    Body(login): Body<Login>,
) -> Result<Response, Problem> {
    let is_right =
        access.token.as_ref().is_none_or(|token| token.matches(login.token.trim().as_bytes()));
    if !is_right {
        tokio::time::sleep(WRONG_TOKEN_PAUSE).await;
        let why = "this is not the client token of the coordinator";
        return Err(Problem::new(StatusCode::UNAUTHORIZED, why));
    }
    let secure = if access.is_encrypted { "; Secure" } else { "" };
    let cookie = access.cookie.as_deref().unwrap_or_default();
    let name = &access.cookie_name;
    let cookie = format!("{name}={cookie}; Path=/; HttpOnly; SameSite=Strict{secure}");
    Ok((StatusCode::NO_CONTENT, [(SET_COOKIE, cookie)]).into_response())
}
