//! Why there is no line to a device.

use thiserror::Error;

/// Why a line could not be had, or is no more.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LinkError {
    /// There is no such port.
    #[error("there is no port {port}; check cable and power, and see `epirig devices`")]
    NoSuchPort {
        /// As it was asked for.
        port: String,
    },
    /// No port is what was asked for.
    #[error(
        "{wanted} is not connected (there is: {connected}); check cable and power, or name the port with --port"
    )]
    NoMatch {
        /// As it was asked for.
        wanted: String,
        /// The ports there are.
        connected: String,
    },
    /// More than one port is what was asked for.
    #[error("{wanted} could be any of {candidates}; choose one with --port")]
    Ambiguous {
        /// As it was asked for.
        wanted: String,
        /// The ports that would do.
        candidates: String,
    },
    /// Another process uses the port.
    #[error("{port} is in use by {holder}; end that first")]
    Busy {
        /// The port.
        port: String,
        /// Who has it, as far as is known.
        holder: String,
    },
    /// The user may not open the port.
    #[error(
        "no permission to open {port}; add yourself to its group (`sudo usermod -aG dialout $USER`, then log in \
         again) or install the project's udev rules"
    )]
    Permission {
        /// The port.
        port: String,
    },
    /// The port has hung up.
    #[error(
        "{port} has gone: cable pulled or power lost; connect it again and home the stage, its position is no longer sure"
    )]
    Lost {
        /// The port.
        port: String,
    },
    /// The system refused something else.
    #[error("{port}: cannot {action}: {detail}")]
    Io {
        /// The port or file.
        port: String,
        /// What was being done.
        action: &'static str,
        /// What the system said.
        detail: String,
    },
    /// The program was built without serial ports.
    #[error(
        "{port} cannot be opened: this epirig was built without serial ports; build it with `--features serial`"
    )]
    NotBuilt {
        /// The port.
        port: String,
    },
    /// A recording was asked for something that it does not hold.
    #[error("{port}: the recording goes on differently at {at_s:.3} s: {detail}")]
    Diverged {
        /// The recording.
        port: String,
        /// Time of the recording, in s.
        at_s: String,
        /// What was sent, and what was recorded.
        detail: String,
    },
}
