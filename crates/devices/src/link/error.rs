//! Errors of a line to a device.

use thiserror::Error;

/// Error of a line: it cannot be opened, or has failed. A text alone is the name of the port.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LinkError {
    /// There is no such port.
    #[error("there is no port {0}; check cable and power, and see `epirig devices`")]
    NoSuchPort(String),
    /// No port matches.
    #[error(
        "{wanted} is not connected (connected: {connected}); check cable and power, or name the port with --port"
    )]
    NoMatch {
        /// The name as given.
        wanted: String,
        /// The connected ports.
        connected: String,
    },
    /// Several ports match.
    #[error("{wanted} could be any of {candidates}; choose one with --port")]
    Ambiguous {
        /// The name as given.
        wanted: String,
        /// The matching ports.
        candidates: String,
    },
    /// Another process uses the port.
    #[error("{port} is in use by {holder}; end that program first")]
    Busy {
        /// The port.
        port: String,
        /// The process that uses it, as far as known.
        holder: String,
    },
    /// The user may not open the port.
    #[error(
        "no permission to open {0}; add yourself to its group (`sudo usermod -aG dialout $USER`, then log in \
         again) or install the project's udev rules"
    )]
    Permission(String),
    /// The port is disconnected.
    #[error(
        "{0} has gone: cable or power is off; connect it again and home the stage, because its position is uncertain"
    )]
    Lost(String),
    /// Another error of the operating system.
    #[error("{port}: cannot {action}: {detail}")]
    Io {
        /// The port or file.
        port: String,
        /// The operation.
        action: &'static str,
        /// The message of the system.
        detail: String,
    },
    /// The program does not know the serial ports of this system.
    #[error(
        "{0} cannot be opened: epirig opens serial ports on Linux and other Unix systems only; here it has the simulated stage (`--driver sim`)"
    )]
    NotOnThisSystem(String),
    /// The bytes sent differ from the recording.
    #[error("{port}: the bytes sent differ from the recording at {at_s:.3} s: {detail}")]
    Diverged {
        /// The recording.
        port: String,
        /// Time of the recording, in s.
        at_s: String,
        /// The bytes sent, and the bytes recorded.
        detail: String,
    },
}
