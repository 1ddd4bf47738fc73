//! Transcripts: the traffic of a line in a readable file.
//!
//! ```text
//! # epirig transcript 1
//! # dialect native
//! # port /dev/ttyACM0
//! # session 1841
//! 0.000123 > 00 04 00 00 01 01 03 00
//! 0.006310 < 00 02 80 0a 01 01 fa 01 80 88 de be 01 01 03 e8 78 00
//! ```
//!
//! Seconds since the line was opened; `>` to the device, `<` from it; bytes in hexadecimal.

use std::fmt::Write as _;
use std::io::Write;
use std::time::Duration;

use thiserror::Error;

use super::{Link, LinkError};

const FIRST_LINE: &str = "# epirig transcript 1";

/// A file is not a transcript.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum TranscriptError {
    /// The first line is wrong.
    #[error("not a transcript: its first line is not \"{FIRST_LINE}\"")]
    NotATranscript,
    /// A line is invalid.
    #[error(
        "line {line} of the transcript is not \"SECONDS > HEX ..\", \"SECONDS < HEX ..\" or \"# session NUMBER\""
    )]
    BadLine {
        /// Number of the line, from 1.
        line: usize,
    },
}

epirig_core::choices! {
    /// The sender of bytes.
    pub enum Side {
        /// This program, or another host.
        Host = "host",
        /// The device.
        Device = "device",
    }
}

/// Bytes that were sent together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Time since the line was opened.
    pub time: Duration,
    /// The sender.
    pub side: Side,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// The heading of a transcript.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Heading {
    /// Name of the dialect.
    pub dialect: String,
    /// Name of the port.
    pub port: String,
    /// The number of the session ([`Link::session`]).
    pub session: u64,
}

/// A recording of a line.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Transcript {
    /// Dialect and port.
    pub heading: Heading,
    /// The traffic in order of time.
    pub entries: Vec<Entry>,
}

impl Transcript {
    /// Parses a transcript.
    ///
    /// # Errors
    /// [`TranscriptError`] if the text is not a transcript.
    pub fn parse(text: &str) -> Result<Self, TranscriptError> {
        let mut transcript = Self::default();
        let mut lines = text.lines().enumerate();
        if lines.next().map(|(_, line)| line.trim_end()) != Some(FIRST_LINE) {
            return Err(TranscriptError::NotATranscript);
        }
        for (index, line) in lines {
            if let Some(comment) = line.strip_prefix('#') {
                match comment.trim().split_once(' ') {
                    Some(("dialect", dialect)) => transcript.heading.dialect = dialect.to_owned(),
                    Some(("port", port)) => transcript.heading.port = port.to_owned(),
                    Some(("session", number)) => {
                        let bad = TranscriptError::BadLine { line: index + 1 };
                        transcript.heading.session = number.parse().map_err(|_| bad)?;
                    }
                    _ => {}
                }
            } else if !line.trim().is_empty() {
                let entry = parse_entry(line).ok_or(TranscriptError::BadLine { line: index + 1 })?;
                transcript.entries.push(entry);
            }
        }
        Ok(transcript)
    }
}

fn parse_entry(line: &str) -> Option<Entry> {
    let mut words = line.split_whitespace();
    let time = Duration::try_from_secs_f64(words.next()?.parse().ok()?).ok()?;
    let side = match words.next()? {
        ">" => Side::Host,
        "<" => Side::Device,
        _ => return None,
    };
    let byte = |word: &str| (word.len() == 2).then(|| u8::from_str_radix(word, 16).ok()).flatten();
    Some(Entry { time, side, bytes: words.map(byte).collect::<Option<_>>()? })
}

/// A link that records the traffic of another one.
pub struct Recorder<W> {
    link: Box<dyn Link>,
    to: W,
}

impl<W: Write + Send> Recorder<W> {
    /// Records `link` to `to`.
    ///
    /// # Errors
    /// [`LinkError::Io`] if the heading cannot be written.
    pub fn new(link: Box<dyn Link>, to: W, dialect: &str) -> Result<Self, LinkError> {
        let mut recorder = Self { link, to };
        let heading = format!(
            "{FIRST_LINE}\n# dialect {dialect}\n# port {}\n# session {}\n",
            recorder.link.name(),
            recorder.link.session()
        );
        recorder.write(&heading)?;
        Ok(recorder)
    }

    fn write(&mut self, text: &str) -> Result<(), LinkError> {
        let written = self.to.write_all(text.as_bytes()).and_then(|()| self.to.flush());
        written.map_err(|error| LinkError::Io {
            port: self.link.name().to_owned(),
            action: "write its transcript",
            detail: error.to_string(),
        })
    }

    fn record(&mut self, side: char, bytes: &[u8]) -> Result<(), LinkError> {
        let mut line = format!("{:.6} {side}", self.link.now().as_secs_f64());
        for byte in bytes {
            let _ = write!(line, " {byte:02x}");
        }
        line.push('\n');
        self.write(&line)
    }
}

impl<W: Write + Send> Link for Recorder<W> {
    fn name(&self) -> &str {
        self.link.name()
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        // Bytes are sent first and recorded later, so that a full disk does not delay a stop.
        self.link.send(bytes)?;
        self.record('>', bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> Result<usize, LinkError> {
        let count = self.link.receive(buffer, patience)?;
        if count > 0 {
            self.record('<', &buffer[..count])?;
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.link.now()
    }

    fn session(&self) -> u64 {
        self.link.session()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_read_is_named() {
        assert_eq!(Transcript::parse("hello"), Err(TranscriptError::NotATranscript));
        for bad in ["0.1 > 1", "0.1 ? 01", "x > 01", "-1 > 01", "0.1 > 0g", "nan > 01", "1e300 > 01"] {
            let text = format!("{FIRST_LINE}\n# port a\n{bad}\n");
            assert_eq!(Transcript::parse(&text), Err(TranscriptError::BadLine { line: 3 }), "{bad}");
        }
    }
}
