//! Bytes to and from a device: serial ports, their simulated counterparts, recordings.
//!
//! A [`Link`] carries bytes and has a clock; it does not interpret the bytes. Drivers wait by its clock, so
//! that with a simulated link an hour of waiting takes no time.

mod choice;
mod error;
mod inbox;
#[cfg(unix)]
mod lock;
#[cfg(any(test, not(unix)))]
#[cfg_attr(unix, allow(unreachable_pub, dead_code, reason = "only its messages are tested here"))]
mod no_serial;
mod replay;
#[cfg(unix)]
mod serial;
mod simulated;
mod transcript;

use std::time::Duration;

pub use choice::{PortChoice, PortFacts, UsbFacts, choose};
pub use error::LinkError;
pub use inbox::Inbox;
pub(crate) use inbox::{DRAIN_PATIENCE, QUIET};
#[cfg(unix)]
pub use lock::{PortLock, holder};
#[cfg(not(unix))]
pub use no_serial::{PtyServer, ask_holder_to_stop, holder, open, ports, serve};
pub use replay::Replay;
#[cfg(unix)]
pub use serial::{PtyServer, SerialLink, ask_holder_to_stop, open, ports, serve};
pub use simulated::{LineNoise, SimulatedDevice, SimulatedLink};
pub use transcript::{Entry, Heading, Recorder, Side, Transcript, TranscriptError};

/// A line to a device.
pub trait Link: Send {
    /// Its name in messages: the path of a port.
    fn name(&self) -> &str;

    /// Sends all bytes.
    ///
    /// # Errors
    /// [`LinkError`] if the line is disconnected or does not accept them.
    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError>;

    /// Waits for bytes, for at most `patience`, and returns their number; 0 after a time-out.
    ///
    /// # Errors
    /// [`LinkError`] if the line is disconnected.
    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> Result<usize, LinkError>;

    /// Time since the link was opened. Simulated links have simulated time.
    fn now(&self) -> Duration;

    /// A number that differs from one opening of a line to the next. Drivers begin to count their messages
    /// from it, so that answers to a former process are not taken for their own. A recording has the number
    /// of the recorded session.
    fn session(&self) -> u64 {
        0
    }
}
