//! Who may ask: pages of other sites, which a browser lets open websockets to this machine, may not.

use std::net::{IpAddr, SocketAddr};

use axum::body::HttpBody;
use axum::extract::{Request, State};
use axum::http::header::{CONTENT_SECURITY_POLICY, HOST, ORIGIN, X_CONTENT_TYPE_OPTIONS};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

/// The page loads nothing from elsewhere and runs nothing that stands in its text.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; connect-src 'self'; \
                      img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Refuses requests of other sites and those that bring a body, and sets the headers that keep the page to itself.
pub(super) async fn check(State(address): State<SocketAddr>, request: Request, next: Next) -> Response {
    // Nothing is ever sent to the station: a body is refused before it is read.
    if !request.body().is_end_stream() {
        return (StatusCode::PAYLOAD_TOO_LARGE, "this station takes no body\n").into_response();
    }
    if !is_ours(request.headers(), address.ip()) {
        return (StatusCode::FORBIDDEN, "this station talks to its own page only\n").into_response();
    }
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    response
}

/// Whether a request comes from the station's own page, or from no page at all.
fn is_ours(headers: &HeaderMap, listening: IpAddr) -> bool {
    let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
    let host = text(HOST).unwrap_or_default();
    // A name that an attacker's server resolves to this machine would make its page one of ours.
    let name = host.rsplit_once(':').map_or(host, |(name, port)| {
        if port.bytes().all(|b| b.is_ascii_digit()) {
            name
        } else {
            host
        }
    });
    let is_local = ["localhost", "127.0.0.1", "[::1]"].contains(&name) || name == listening.to_string();
    if listening.is_loopback() && !is_local {
        return false;
    }
    match text(ORIGIN) {
        Some(origin) => origin.split_once("://").is_some_and(|(_, at)| at == host),
        None => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(host: &str, origin: Option<&str>, listening: &str) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(HOST, host.parse().expect("a host"));
        if let Some(origin) = origin {
            headers.insert(ORIGIN, origin.parse().expect("an origin"));
        }
        is_ours(&headers, listening.parse().expect("an address"))
    }

    #[test]
    fn other_sites_are_refused() {
        let here = "127.0.0.1";
        assert!(asked("127.0.0.1:8080", None, here));
        assert!(asked("localhost:8080", Some("http://localhost:8080"), here));
        assert!(asked("[::1]:8080", Some("http://[::1]:8080"), "::1"));
        assert!(!asked("127.0.0.1:8080", Some("http://evil.example"), here));
        assert!(!asked("127.0.0.1:8080", Some("http://127.0.0.1:9090"), here));
        assert!(!asked("127.0.0.1:8080", Some("null"), here));
        // DNS rebinding: a foreign name for this machine.
        assert!(!asked(
            "evil.example:8080",
            Some("http://evil.example:8080"),
            here
        ));
        // On all interfaces, the operator's own names are not known.
        assert!(asked(
            "station.lan:8080",
            Some("http://station.lan:8080"),
            "0.0.0.0"
        ));
        assert!(!asked("station.lan:8080", Some("http://evil.example"), "0.0.0.0"));
    }
}
