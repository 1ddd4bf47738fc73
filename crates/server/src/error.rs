//! Why there is no server.

use std::io;
use std::net::SocketAddr;

use thiserror::Error;

/// Errors of the server as a whole; a request that fails gets a [`Refusal`](super::Refusal).
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServerError {
    /// The address cannot be used.
    #[error(
        "cannot listen on {address}: {source}; is another program using it? choose another with --listen"
    )]
    Listen {
        /// The address.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// The system gives no random numbers for the token.
    #[error("the system gives no random numbers for the token: {0}")]
    NoToken(String),
    /// The system gives no threads or timers.
    #[error("the web server cannot be started: {0}")]
    Runtime(#[source] io::Error),
}
