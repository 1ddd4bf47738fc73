//! The request that turns a connection into a WebSocket, and the response to it.

use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, Response, StatusCode, header};
use tokio_tungstenite::tungstenite::handshake::derive_accept_key;

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
    let mut connection = words(headers, header::CONNECTION.as_str());
    let version = words(headers, header::SEC_WEBSOCKET_VERSION.as_str()).next();
    let key = headers.get(header::SEC_WEBSOCKET_KEY);
    let (true, Some("13"), Some(key)) =
        (connection.any(|word| word.eq_ignore_ascii_case("upgrade")), version, key)
    else {
        return Err(wrong("this is no request for a WebSocket of version 13"));
    };
    if !words(headers, header::SEC_WEBSOCKET_PROTOCOL.as_str()).any(|word| word == PROTOCOL) {
        return Err(wrong("feeds speak the protocol \"epirig\"; offer it in Sec-WebSocket-Protocol"));
    }
    let accept = HeaderValue::from_str(&derive_accept_key(key.as_bytes()))
        .map_err(|_| wrong("the key of the request for a WebSocket cannot be used"))?;
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::SWITCHING_PROTOCOLS;
    let into = response.headers_mut();
    into.insert(header::CONNECTION, HeaderValue::from_static("upgrade"));
    into.insert(header::UPGRADE, HeaderValue::from_static("websocket"));
    into.insert(header::SEC_WEBSOCKET_ACCEPT, accept);
    into.insert(header::SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(PROTOCOL));
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
