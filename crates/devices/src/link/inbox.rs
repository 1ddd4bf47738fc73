//! Bytes of a link, one at a time.

use std::collections::VecDeque;
use std::time::Duration;

use super::{Link, LinkError};

/// Bytes that came together and have not been looked at yet.
#[derive(Debug, Clone, Default)]
pub struct Inbox {
    bytes: VecDeque<u8>,
}

impl Inbox {
    /// The next byte, if there is one before `until` by the link's clock. A device that never stops talking gets no more time.
    ///
    /// # Errors
    /// [`LinkError`] if the line has gone.
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
