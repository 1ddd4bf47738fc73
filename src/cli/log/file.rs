//! A log file. A write error is reported once and does not stop the program.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::cli::CliError;
use crate::cli::progress::tell;

/// Takes whole lines.
pub(super) struct LogFile {
    file: File,
    path: PathBuf,
    /// Whether a write error was reported.
    told: bool,
}

impl LogFile {
    pub(super) fn new(file: File, path: PathBuf) -> Self {
        Self { file, path, told: false }
    }

    /// Opens the file of `--log`, which may also be a pipe or a terminal.
    pub(super) fn named(path: &Path) -> Result<Self, CliError> {
        let file = File::options().append(true).create(true).open(path);
        let file = file.map_err(CliError::file("write the log", path))?;
        Ok(Self::new(file, path.to_owned()))
    }

    /// Appends a line, or reports once that it cannot.
    pub(super) fn put(&mut self, line: &[u8]) {
        if let Err(error) = self.add(line)
            && !std::mem::replace(&mut self.told, true)
        {
            tell(&format!(
                "note: {}: cannot write the log, which is incomplete now: {error}",
                self.path.display()
            ));
        }
    }

    /// Appends a whole line; removes it again if only a part was written.
    fn add(&mut self, line: &[u8]) -> io::Result<()> {
        let mut left = line;
        while !left.is_empty() {
            match self.file.write(left) {
                Ok(count) if count > 0 => left = &left[count..],
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                failed => {
                    self.take_away((line.len() - left.len()) as u64);
                    return Err(failed.err().unwrap_or(io::ErrorKind::WriteZero.into()));
                }
            }
        }
        Ok(())
    }

    fn take_away(&self, bytes: u64) {
        if let Ok(metadata) = self.file.metadata()
            && metadata.is_file()
        {
            // A remaining part of a line makes only the next line unreadable.
            let _ = self.file.set_len(metadata.len().saturating_sub(bytes));
        }
    }
}
