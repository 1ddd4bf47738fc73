//! A log in a file. Trouble with it is told once, and stops nothing.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::cli::CliError;
use crate::cli::progress::tell;

/// Takes whole lines.
pub(super) struct LogFile {
    file: File,
    path: PathBuf,
    /// Whether trouble with it has been told.
    told: bool,
}

impl LogFile {
    pub(super) fn new(file: File, path: PathBuf) -> Self {
        Self { file, path, told: false }
    }

    /// The one that a person has named, which may also be a pipe or a terminal.
    pub(super) fn named(path: &Path) -> Result<Self, CliError> {
        let file = File::options().append(true).create(true).open(path);
        let file =
            file.map_err(|source| CliError::File { path: path.to_owned(), action: "write the log", source })?;
        Ok(Self::new(file, path.to_owned()))
    }

    /// Adds a line, or says once that it cannot.
    pub(super) fn put(&mut self, line: &[u8]) {
        if let Err(error) = self.add(line)
            && !std::mem::replace(&mut self.told, true)
        {
            tell(&format!(
                "note: {}: cannot write the log, which has gaps now: {error}",
                self.path.display()
            ));
        }
    }

    /// A line is written as a whole, or what was written of it is taken away.
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
            // A part of a line that stays spoils the next one only.
            let _ = self.file.set_len(metadata.len().saturating_sub(bytes));
        }
    }
}

impl Write for LogFile {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        self.put(line);
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
