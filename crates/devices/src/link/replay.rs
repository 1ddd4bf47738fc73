//! A recording that acts as a line.

use std::collections::VecDeque;
use std::time::Duration;

use super::{Entry, Link, LinkError, Side, Transcript};

/// Answers as the recorded device, if the host sends the recorded bytes. Its clock is that of the recording.
#[derive(Debug)]
pub struct Replay {
    name: String,
    session: u64,
    entries: VecDeque<Entry>,
    /// Bytes that the device sent before the next bytes of the host.
    unread: VecDeque<Entry>,
    now: Duration,
}

impl Replay {
    /// A line that replays `transcript`.
    pub fn new(transcript: Transcript) -> Self {
        let name = format!("recording of {}", transcript.heading.port);
        let session = transcript.heading.session;
        Self {
            name,
            session,
            entries: transcript.entries.into(),
            unread: VecDeque::new(),
            now: Duration::ZERO,
        }
    }

    fn next_from_device(&mut self) -> Option<Entry> {
        self.unread.pop_front().or_else(|| self.entries.pop_front_if(|entry| entry.side == Side::Device))
    }
}

impl Link for Replay {
    fn name(&self) -> &str {
        &self.name
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        while let Some(entry) = self.entries.pop_front_if(|entry| entry.side == Side::Device) {
            self.unread.push_back(entry);
        }
        let recorded = self.entries.pop_front();
        if recorded.as_ref().is_some_and(|entry| entry.bytes == bytes) {
            self.now = self.now.max(recorded.map_or(self.now, |entry| entry.time));
            return Ok(());
        }
        let recorded = recorded.map_or("ends".to_owned(), |entry| format!("has {:02x?}", entry.bytes));
        Err(LinkError::Diverged {
            port: self.name.clone(),
            at_s: format!("{:.3}", self.now.as_secs_f64()),
            detail: format!("it {recorded} where {bytes:02x?} is sent"),
        })
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> Result<usize, LinkError> {
        let until = self.now + patience;
        let Some(mut entry) = self.next_from_device() else {
            self.now = until;
            return Ok(0);
        };
        if entry.time > until {
            self.unread.push_front(entry);
            self.now = until;
            return Ok(0);
        }
        self.now = self.now.max(entry.time);
        let count = entry.bytes.len().min(buffer.len());
        buffer[..count].copy_from_slice(&entry.bytes[..count]);
        if count < entry.bytes.len() {
            entry.bytes.drain(..count);
            self.unread.push_front(entry);
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.now
    }

    fn session(&self) -> u64 {
        self.session
    }
}
