//! The request that turns a connection into a WebSocket, and the response to it.

use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, Request, Response, header};
use tokio_tungstenite::tungstenite::handshake::server::create_response_with_body;

use super::refusal::{Refusal, RefusalKind};

/// The protocol that feeds speak.
const PROTOCOL: &str = "epirig";

/// Whether the request asks for a WebSocket.
pub(super) fn is_asked(headers: &HeaderMap) -> bool {
    words(headers, header::UPGRADE.as_str()).any(|word| word.eq_ignore_ascii_case("websocket"))
}

/// The response that agrees.
///
/// # Errors
/// [`Refusal`] if the request is not one of version 13, or does not offer our protocol.
pub(super) fn agree(headers: &HeaderMap) -> Result<Response<Body>, Refusal> {
    let wrong = |message: &str| Refusal::new(RefusalKind::Wrong, message);
    let mut request = Request::new(());
    request.headers_mut().clone_from(headers);
    let mut response = create_response_with_body(&request, Body::empty)
        .map_err(|_| wrong("this is no request for a WebSocket of version 13"))?;
    if !words(headers, header::SEC_WEBSOCKET_PROTOCOL.as_str()).any(|word| word == PROTOCOL) {
        return Err(wrong("feeds speak the protocol \"epirig\"; offer it in Sec-WebSocket-Protocol"));
    }
    response.headers_mut().insert(header::SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(PROTOCOL));
    Ok(response)
}

/// The words between the commas of all headers of this name.
pub(super) fn words<'a>(headers: &'a HeaderMap, name: &str) -> impl Iterator<Item = &'a str> {
    let texts = headers.get_all(name).into_iter().filter_map(|value| value.to_str().ok());
    texts.flat_map(|text| text.split(',')).map(str::trim)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(lines: &[(&'static str, &'static str)]) -> HeaderMap {
        let mut headers = HeaderMap::new();
        for (name, value) in lines {
            headers.append(*name, HeaderValue::from_static(value));
        }
        headers
    }

    /// That of RFC 6455, section 1.2, but for the protocol.
    const GOOD: [(&str, &str); 5] = [
        ("upgrade", "websocket"),
        ("connection", "keep-alive, Upgrade"),
        ("sec-websocket-key", "dGhlIHNhbXBsZSBub25jZQ=="),
        ("sec-websocket-protocol", "other, epirig"),
        ("sec-websocket-version", "13"),
    ];

    #[test]
    fn the_key_is_answered_as_in_the_standard() {
        let headers = request(&GOOD);
        assert!(is_asked(&headers));
        let response = agree(&headers).unwrap();
        assert_eq!(response.status(), 101);
        assert_eq!(response.headers()["sec-websocket-accept"], "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
        assert_eq!(response.headers()["sec-websocket-protocol"], "epirig");
    }

    #[test]
    fn what_is_missing_is_refused() {
        for missing in 1..GOOD.len() {
            let mut lines = GOOD.to_vec();
            lines.remove(missing);
            assert_eq!(agree(&request(&lines)).unwrap_err().kind, RefusalKind::Wrong, "{missing}");
        }
        let old: Vec<_> = GOOD.map(|(name, value)| (name, if value == "13" { "8" } else { value })).to_vec();
        assert!(agree(&request(&old)).is_err());
        assert!(!is_asked(&request(&GOOD[1..])));
    }
}
