//! Lines to and from GRBL.

use std::time::Duration;

use super::Response;
use super::protocol::NAME;
use crate::link::{DRAIN_PATIENCE, Inbox, Link, LinkError, QUIET};
use crate::stage::StageError;

/// Longest line: GRBL's own lines are shorter; more without an end is noise.
const LONGEST: usize = 256;

/// A link used line by line.
pub(super) struct Lines {
    link: Box<dyn Link>,
    inbox: Inbox,
    line: Vec<u8>,
    /// The last line that could not be parsed.
    unknown: Option<String>,
    /// The version in the last banner.
    version: Option<String>,
}

/// Whether bytes hold what only GRBL says.
pub(in crate::stage) fn is_of_grbl(heard: &[u8]) -> bool {
    let text = String::from_utf8_lossy(heard);
    ["Grbl", "error:", "ALARM:", "MPos:", "ok\r"].iter().any(|word| text.contains(word))
}

impl Lines {
    pub(super) fn new(link: Box<dyn Link>) -> Self {
        Self { link, inbox: Inbox::default(), line: Vec::new(), unknown: None, version: None }
    }

    pub(super) fn into_link(self) -> Box<dyn Link> {
        self.link
    }

    /// Discards what a former process has asked for, as far as it comes at once.
    pub(super) fn drain(&mut self) -> Result<(), LinkError> {
        let until = self.now() + DRAIN_PATIENCE;
        while self.now() < until && self.next(self.now() + QUIET)?.is_some() {}
        self.line.clear();
        Ok(())
    }

    /// The version of the controller, if it has told it.
    pub(super) fn version(&self) -> Option<&str> {
        self.version.as_deref()
    }

    pub(super) fn port(&self) -> &str {
        self.link.name()
    }

    pub(super) fn now(&self) -> Duration {
        self.link.now()
    }

    pub(super) fn send_line(&mut self, line: &str) -> Result<(), LinkError> {
        self.link.send(format!("{line}\n").as_bytes())
    }

    pub(super) fn send_byte(&mut self, byte: u8) -> Result<(), LinkError> {
        self.link.send(&[byte])
    }

    /// The next non-empty line, if one comes before `until`.
    pub(super) fn next(&mut self, until: Duration) -> Result<Option<Response>, LinkError> {
        while let Some(byte) = self.inbox.next(&mut *self.link, until)? {
            match byte {
                b'\r' | b'\n' if self.line.is_empty() => {}
                b'\r' | b'\n' => return Ok(Some(self.take_line())),
                other if self.line.len() < LONGEST => self.line.push(other),
                _ => return Ok(Some(self.take_line())),
            }
        }
        Ok(None)
    }

    fn take_line(&mut self) -> Response {
        let line = String::from_utf8_lossy(&std::mem::take(&mut self.line)).into_owned();
        let response = Response::parse(&line);
        match &response {
            Response::Unknown(line) => self.unknown = Some(line.chars().take(60).collect()),
            Response::Banner { version } => self.version = Some(version.clone()),
            _ => {}
        }
        response
    }

    /// The next line that answers a command, or ends all answers.
    pub(super) fn answer(&mut self, patience: Duration) -> Result<Option<Response>, LinkError> {
        let until = self.now() + patience;
        loop {
            match self.next(until)? {
                Some(
                    Response::Status(_)
                    | Response::Feedback { .. }
                    | Response::Setting { .. }
                    | Response::Unknown(_),
                ) => {}
                other => return Ok(other),
            }
        }
    }

    /// The error for what is heard from another device.
    pub(super) fn foreign_for(&self, heard: impl Into<String>, hint: &str) -> StageError {
        StageError::foreign(self.port(), NAME, heard, hint)
    }

    /// The error for a device that sends only unknown lines.
    pub(super) fn foreign(&self) -> Option<StageError> {
        let partly = String::from_utf8_lossy(&self.line).into_owned();
        let heard = self.unknown.clone().or_else(|| (!partly.is_empty()).then_some(partly))?;
        let says = format!("it says \"{}\"", heard.escape_default());
        Some(self.foreign_for(says, "check its firmware, or choose another --driver"))
    }
}
