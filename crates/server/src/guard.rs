//! Who may ask: checks of Host, Origin and token, before anything is answered.

use std::net::{IpAddr, SocketAddr};

use axum::http::{HeaderMap, header};

use super::handshake;
use super::refusal::{Refusal, RefusalKind};
use super::token::{Token, Tokens};

/// Name of the header that holds the token.
pub(super) const TOKEN_HEADER: &str = "x-epirig-token";

/// What the token begins with as a protocol of a WebSocket: a page cannot give such a request other headers.
const TOKEN_PROTOCOL: &str = "token.";

/// What somebody must be allowed for a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Access {
    /// To look.
    Look,
    /// To change things.
    Change,
}

/// What the checks need to know.
pub(super) struct Guard {
    /// The address that the server listens on.
    address: SocketAddr,
    /// The name of this machine, if the system tells it.
    machine: Option<String>,
    tokens: Tokens,
}

impl Guard {
    pub(super) fn new(address: SocketAddr, tokens: Tokens) -> Self {
        Self { address, machine: machine_name(), tokens }
    }

    /// Refuses a request for another host than this one. A page of another site, whose name leads here by a
    /// trick of its name server (DNS rebinding), sends its own name.
    pub(super) fn check_host(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let host = text(headers, header::HOST.as_str()).unwrap_or_default();
        if self.is_own(host) {
            return Ok(());
        }
        let message = format!("this server does not answer for the host \"{host}\"; use the printed link");
        Err(Refusal::new(RefusalKind::Forbidden, message))
    }

    /// Refuses requests that a page of another site makes its visitor's browser send.
    pub(super) fn check_origin(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let (host, origin) = (text(headers, header::HOST.as_str()), text(headers, header::ORIGIN.as_str()));
        match (headers.contains_key(header::ORIGIN), origin.and_then(|origin| origin.strip_prefix("http://")))
        {
            (false, _) => Ok(()),
            (true, own) if own.is_some() && own == host => Ok(()),
            (true, _) => {
                let message = "a page of another site must not ask here; open the printed link".to_owned();
                Err(Refusal::new(RefusalKind::Forbidden, message))
            }
        }
    }

    /// Refuses what needs a token and does not have it: all that is for those alone who have control, and from
    /// other machines everything.
    pub(super) fn check_token(&self, access: Access, headers: &HeaderMap) -> Result<(), Refusal> {
        let Tokens { control, watch } = &self.tokens;
        let may_look = || self.address.ip().is_loopback() || gives(headers, watch);
        if gives(headers, control) || (access == Access::Look && may_look()) {
            return Ok(());
        }
        let message = match gives(headers, watch) {
            true => "this page was opened with the link for watching; orders need the other link of epirig",
            false => "the token is missing or wrong; open the link that epirig printed when it started",
        };
        Err(Refusal::new(RefusalKind::NoToken, message.to_owned()))
    }

    /// Whether a Host header names this server.
    fn is_own(&self, host: &str) -> bool {
        let port = format!(":{}", self.address.port());
        let Some(name) = host.strip_suffix(&port) else { return false };
        let name = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        let everywhere = self.address.ip().is_unspecified();
        if let Ok(ip) = name.parse::<IpAddr>() {
            // No name server stands behind a number.
            return ip == self.address.ip()
                || (ip.is_loopback() && self.address.ip().is_loopback())
                || everywhere;
        }
        let own = |machine: &String| name == *machine || name.strip_suffix(".local") == Some(machine);
        name == "localhost" || (!self.address.ip().is_loopback() && self.machine.as_ref().is_some_and(own))
    }
}

/// Whether a request has the token.
fn gives(headers: &HeaderMap, token: &Token) -> bool {
    let mut protocols = handshake::words(headers, header::SEC_WEBSOCKET_PROTOCOL.as_str());
    text(headers, TOKEN_HEADER).is_some_and(|given| token.is(given))
        || protocols.any(|word| word.strip_prefix(TOKEN_PROTOCOL).is_some_and(|given| token.is(given)))
}

/// The text of a header. One that comes twice has none: others on the way may have read the other one.
fn text<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    let only = values.next().filter(|_| values.next().is_none())?;
    only.to_str().ok()
}

#[cfg(unix)]
fn machine_name() -> Option<String> {
    rustix::system::uname().nodename().to_str().ok().map(str::to_lowercase).filter(|name| !name.is_empty())
}

#[cfg(not(unix))]
fn machine_name() -> Option<String> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(address: &str) -> Guard {
        let tokens = Tokens::new().unwrap();
        Guard { address: address.parse().unwrap(), machine: Some("bench".to_owned()), tokens }
    }

    #[test]
    fn only_own_names_are_hosts() {
        let loopback = guard("127.0.0.1:7400");
        for host in ["127.0.0.1:7400", "localhost:7400", "[::1]:7400"] {
            assert!(loopback.is_own(host), "{host}");
        }
        for host in [
            "",
            "localhost",
            "localhost:80",
            "evil.example:7400",
            "192.168.0.9:7400",
            "bench:7400",
            "localhost.evil:7400",
        ] {
            assert!(!loopback.is_own(host), "{host}");
        }
        let everywhere = guard("0.0.0.0:7400");
        for host in ["192.168.0.9:7400", "bench:7400", "bench.local:7400", "localhost:7400"] {
            assert!(everywhere.is_own(host), "{host}");
        }
        assert!(!everywhere.is_own("evil.example:7400"));
    }

    #[test]
    fn foreign_origins_are_refused_and_own_ones_are_not() {
        let guard = guard("127.0.0.1:7400");
        let headers = |origin: Option<&'static str>| {
            let mut headers = HeaderMap::new();
            headers.insert("host", "127.0.0.1:7400".parse().unwrap());
            origin.map(|origin| headers.insert("origin", origin.parse().unwrap()));
            headers
        };
        assert!(guard.check_origin(&headers(None)).is_ok());
        assert!(guard.check_origin(&headers(Some("http://127.0.0.1:7400"))).is_ok());
        for foreign in ["null", "http://evil.example", "http://127.0.0.1:7401", "https://127.0.0.1:7400"] {
            assert!(guard.check_origin(&headers(Some(foreign))).is_err(), "{foreign}");
        }
    }

    #[test]
    fn reading_needs_a_token_from_elsewhere_and_changing_always() {
        for (address, reads_freely) in [("127.0.0.1:7400", true), ("0.0.0.0:7400", false)] {
            let guard = guard(address);
            let with = |token: &Token| {
                let mut headers = HeaderMap::new();
                headers.insert(TOKEN_HEADER, token.digits().parse().unwrap());
                headers
            };
            let may = |access: Access, headers: &HeaderMap| guard.check_token(access, headers).is_ok();
            let none = HeaderMap::new();
            assert_eq!((may(Access::Look, &none), may(Access::Change, &none)), (reads_freely, false));
            let mut control = with(&guard.tokens.control);
            assert!(may(Access::Look, &control) && may(Access::Change, &control));
            let watch = with(&guard.tokens.watch);
            assert!(may(Access::Look, &watch) && !may(Access::Change, &watch));
            control.append(TOKEN_HEADER, guard.tokens.watch.digits().parse().unwrap());
            assert!(!may(Access::Change, &control), "two tokens are none");
        }
    }
}
