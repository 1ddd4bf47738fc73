//! `epirig decode`.

use std::io::Read;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::choice::choice;
use super::rig::driver;
use super::{CliError, Talk};
use epirig_data::storage::{ReadError, read_named};
use epirig_devices::link::{Entry, Side, Transcript, TranscriptError};
use epirig_devices::stage::Driver;

/// Print the traffic of a stage's line as text
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  epirig stage move 12.5 --transcript move.txt
  epirig decode move.txt
  epirig decode --dialect native --side device capture.bin     bytes that another program recorded
  epirig decode --dialect grbl -                               from stdin

A transcript holds its dialect and both sides. For plain bytes give the dialect, and the side if the
host sent them.")]
pub(super) struct Decode {
    /// A transcript, or a file of plain bytes; - for stdin
    file: PathBuf,
    /// The dialect of plain bytes
    #[arg(long, value_parser = driver(|driver| driver.has_line()))]
    dialect: Option<Driver>,
    /// The sender of plain bytes
    #[arg(long, value_parser = choice::<Side>(), default_value_t = Side::Device)]
    side: Side,
}

#[derive(Serialize)]
struct Line {
    time_s: f64,
    from_host: bool,
    text: String,
}

impl Decode {
    pub(super) fn run(self, talk: &Talk) -> Result<(), CliError> {
        let bytes = read(&self.file)?;
        let plain = |bytes: Vec<u8>| vec![Entry { time: std::time::Duration::ZERO, side: self.side, bytes }];
        let parsed = std::str::from_utf8(&bytes)
            .map_err(|_| TranscriptError::NotATranscript)
            .and_then(Transcript::parse);
        let (recorded, entries) = match parsed {
            Ok(transcript) => (Driver::named(&transcript.heading.dialect), transcript.entries),
            Err(TranscriptError::NotATranscript) => (None, plain(bytes)),
            Err(error) => return Err(CliError::data(format!("{}: {error}", self.file.display()))),
        };
        if let Some((_, recorded)) = self.dialect.zip(recorded).filter(|(said, recorded)| said != recorded) {
            return Err(CliError::usage(format!(
                "{} is a transcript of the dialect {}; leave --dialect out",
                self.file.display(),
                recorded.name()
            )));
        }
        let dialect = self.dialect.or(recorded).ok_or_else(|| {
            CliError::usage(format!(
                "{} is not a transcript of epirig; describe the bytes with --dialect and --side",
                self.file.display()
            ))
        })?;
        let decoder = dialect.decoder();
        let mut decoder = decoder.ok_or_else(|| CliError::usage(format!("{dialect} has no serial line")))?;
        let mut lines = Vec::new();
        let end_s = entries.last().map_or(0.0, |entry| entry.time.as_secs_f64());
        for entry in entries {
            let from_host = entry.side == Side::Host;
            let texts = decoder.push(entry.side, &entry.bytes);
            let time_s = entry.time.as_secs_f64();
            lines.extend(texts.into_iter().map(|text| Line { time_s, from_host, text }));
        }
        for (side, from_host) in [(Side::Host, true), (Side::Device, false)] {
            lines.extend(decoder.unfinished(side).map(|text| Line { time_s: end_s, from_host, text }));
        }
        talk.result(&lines, || {
            let line = |line: &Line| {
                let arrow = if line.from_host { '>' } else { '<' };
                format!("{:10.6} {arrow} {}\n", line.time_s, line.text)
            };
            lines.iter().map(line).collect()
        })
    }
}

/// Weeks of a stage's traffic, in bytes.
const LARGEST_RECORDING: u64 = 1 << 28;

fn read(path: &Path) -> Result<Vec<u8>, CliError> {
    if path != Path::new("-") {
        return Ok(read_named(path, LARGEST_RECORDING)?);
    }
    let mut bytes = Vec::new();
    let read = std::io::stdin().take(LARGEST_RECORDING + 1).read_to_end(&mut bytes);
    read.map_err(CliError::file("read", path))?;
    if bytes.len() as u64 > LARGEST_RECORDING {
        return Err(ReadError::TooLarge { path: path.to_owned(), limit: LARGEST_RECORDING }.into());
    }
    Ok(bytes)
}
