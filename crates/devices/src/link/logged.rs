//! A link that logs its bytes.

use std::time::Duration;

use tracing::{debug, trace};

use super::{Link, LinkError};

/// Any link, with `tracing` events for all bytes.
pub struct LoggedLink<L> {
    link: L,
}

impl<L: Link> LoggedLink<L> {
    /// Wraps a link that has just been opened.
    pub fn new(link: L) -> Self {
        debug!(port = link.name(), "line opened");
        Self { link }
    }
}

impl<L: Link> Link for LoggedLink<L> {
    fn name(&self) -> &str {
        self.link.name()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        let sent = self.link.send(bytes);
        trace!(port = self.link.name(), bytes = %bytes.escape_ascii(), ok = sent.is_ok(), "sent");
        sent
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> Result<usize, LinkError> {
        let received = self.link.receive(buffer, patience);
        if let Ok(count @ 1..) = received {
            trace!(port = self.link.name(), bytes = %buffer[..count].escape_ascii(), "received");
        }
        received
    }

    fn now(&self) -> Duration {
        self.link.now()
    }

    fn session(&self) -> u64 {
        self.link.session()
    }
}
