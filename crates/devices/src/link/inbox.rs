//! Bytes of a link, one at a time.

use std::collections::VecDeque;
use std::time::Duration;

use super::{Link, LinkError};

/// Received bytes that are not yet read.
#[derive(Debug, Clone, Default)]
pub struct Inbox {
    bytes: VecDeque<u8>,
}

/// A line on which nothing comes for this time holds no answers to a former process.
pub(crate) const QUIET: Duration = Duration::from_millis(30);

/// A device that never ceases is listened to for no longer.
pub(crate) const DRAIN_PATIENCE: Duration = Duration::from_secs(1);

impl Inbox {
    /// Discards what is on its way to the host, until the line is quiet.
    ///
    /// # Errors
    /// [`LinkError`] if the line is disconnected.
    pub fn drain(&mut self, link: &mut dyn Link) -> Result<(), LinkError> {
        self.bytes.clear();
        let until = link.now() + DRAIN_PATIENCE;
        while link.now() < until && link.receive(&mut [0; 64], QUIET)? > 0 {}
        Ok(())
    }

    /// The next byte, if one comes before `until` by the link's clock. A device that sends without pause does
    /// not extend the time.
    ///
    /// # Errors
    /// [`LinkError`] if the line is disconnected.
    pub fn next(&mut self, link: &mut dyn Link, until: Duration) -> Result<Option<u8>, LinkError> {
        loop {
            let patience = until.saturating_sub(link.now());
            if patience.is_zero() {
                return Ok(None);
            }
            if let Some(byte) = self.bytes.pop_front() {
                return Ok(Some(byte));
            }
            let mut buffer = [0; 64];
            let count = link.receive(&mut buffer, patience)?;
            self.bytes.extend(&buffer[..count]);
        }
    }
}
