//! The log on the terminal.

use std::fmt;
use std::io::{self, Write};
use std::time::Instant;

use tracing_subscriber::fmt::format;
use tracing_subscriber::fmt::time::FormatTime;

use crate::cli::progress::tell;

/// Takes whole lines, and shares the terminal with the progress bar.
pub(super) struct Terminal;

impl Write for Terminal {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        // Words of a device may hold anything; a line stays one.
        tell(&String::from_utf8_lossy(line).trim_end().replace('\n', "\u{fffd}"));
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Seconds since the program began: shorter than a date, and what a person at a rig asks for.
pub(super) struct SinceStart(Instant);

impl SinceStart {
    pub(super) fn now() -> Self {
        Self(Instant::now())
    }
}

impl FormatTime for SinceStart {
    fn format_time(&self, to: &mut format::Writer<'_>) -> fmt::Result {
        write!(to, "{:8.3}", self.0.elapsed().as_secs_f64())
    }
}
