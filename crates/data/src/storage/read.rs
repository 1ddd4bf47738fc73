//! Reading files of unknown size and kind, within limits.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

use epirig_core::fault::{Blame, Fault};
use thiserror::Error;

/// Why a file is not read. Every message names it and says what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system refused.
    #[error("cannot read {}: {source}; {}", path.display(), advice(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// The operating system's message.
        source: io::Error,
    },
    /// A folder, a pipe, a device.
    #[error("{} is {found}, not a file; put the file itself there", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
        /// The kind found.
        found: &'static str,
    },
    /// A name that leads out of its folder.
    #[error("{name} lies outside {}; files of a sequence lie in its folder: put the file itself there", folder.display())]
    Outside {
        /// The folder.
        folder: PathBuf,
        /// The name.
        name: String,
    },
    /// More than makes sense there.
    #[error("{} is larger than the {limit} bytes that such a file can have; it was damaged or is another file: restore it from a copy", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// The limit.
        limit: u64,
    },
    /// Bytes that are no text.
    #[error("{} is not text in UTF-8: byte {at} is no part of a character; save it as UTF-8, or restore it from a copy", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Place of the byte, from 0.
        at: usize,
    },
}

impl Fault for ReadError {
    fn blame(&self) -> Blame {
        match self {
            Self::Io { .. } => Blame::System,
            Self::NotAFile { .. } | Self::Outside { .. } | Self::TooLarge { .. } | Self::NotText { .. } => {
                Blame::Data
            }
        }
    }
}

impl ReadError {
    /// Whether there is no such file.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Io { source, .. } if source.kind() == ErrorKind::NotFound)
    }

    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io { path, source }
    }
}

/// Advice for an error of the operating system.
fn advice(error: &io::Error) -> &'static str {
    match error.kind() {
        ErrorKind::NotFound => "check the path",
        ErrorKind::PermissionDenied => "ask for access to it",
        ErrorKind::NotADirectory => "give a folder",
        ErrorKind::IsADirectory => "give a file",
        _ => "check the disk and the path, then run the command again",
    }
}

/// Opens a regular file for reading; anything else is refused at once.
///
/// # Errors
/// [`ReadError`].
pub fn open_file(path: &Path) -> Result<File, ReadError> {
    let file = open(path).map_err(ReadError::io(path))?;
    let metadata = file.metadata().map_err(ReadError::io(path))?;
    match metadata.is_file() {
        true => Ok(file),
        false => Err(ReadError::NotAFile { path: path.to_owned(), found: kind(metadata.file_type()) }),
    }
}

/// Reads a file of at most `limit` bytes. Anything but a regular file is refused at once: a pipe would be
/// waited for, and a device never ends.
///
/// # Errors
/// [`ReadError`].
pub fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    read_open(open(path).map_err(ReadError::io(path))?, path, limit)
}

/// Bytes that are read of a device: more than a person types.
const LARGEST_OF_A_DEVICE: u64 = 1 << 20;

/// Names of what the program was started with. A shell gives them to its pipes (`<(command)`).
const GIVEN: [&str; 3] = ["/dev/fd/", "/proc/self/fd/", "/dev/stdin"];

/// Reads at most `limit` bytes of a file that a person has named, or of what the program was started with
/// (`/dev/stdin`, `/dev/fd/63`), which may also be a pipe or a terminal. Other pipes and devices are
/// refused at once: they might never end.
///
/// # Errors
/// [`ReadError`].
pub fn read_named(path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    if !path.to_str().is_some_and(|name| GIVEN.iter().any(|given| name.starts_with(given))) {
        return read_file(path, limit);
    }
    let file = File::open(path).map_err(ReadError::io(path))?;
    let metadata = file.metadata().map_err(ReadError::io(path))?;
    // A terminal has an end; of a device that has none, little is read.
    let limit = if kind(metadata.file_type()) == "a device" { limit.min(LARGEST_OF_A_DEVICE) } else { limit };
    read_to_limit(file, path, limit, 0)
}

/// The same as text.
///
/// # Errors
/// [`ReadError`].
pub fn read_text(path: &Path, limit: u64) -> Result<String, ReadError> {
    text(read_named(path, limit)?, path)
}

/// The text that a file's bytes are.
pub(super) fn text(bytes: Vec<u8>, path: &Path) -> Result<String, ReadError> {
    String::from_utf8(bytes)
        .map_err(|error| ReadError::NotText { path: path.to_owned(), at: error.utf8_error().valid_up_to() })
}

/// Opens without waiting for the other end of a pipe.
fn open(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    options.read(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, WITHOUT_WAITING.bits() as i32);
    options.open(path)
}

/// How files are opened that may turn out to be something else.
#[cfg(unix)]
pub(super) const WITHOUT_WAITING: rustix::fs::OFlags =
    rustix::fs::OFlags::NONBLOCK.union(rustix::fs::OFlags::NOCTTY).union(rustix::fs::OFlags::CLOEXEC);

/// Reads the open `file`, if it is a regular one of at most `limit` bytes; `path` is its name for messages.
pub(super) fn read_open(file: File, path: &Path, limit: u64) -> Result<Vec<u8>, ReadError> {
    let metadata = file.metadata().map_err(ReadError::io(path))?;
    if !metadata.is_file() {
        return Err(ReadError::NotAFile { path: path.to_owned(), found: kind(metadata.file_type()) });
    }
    if metadata.len() > limit {
        return Err(ReadError::TooLarge { path: path.to_owned(), limit });
    }
    read_to_limit(file, path, limit, metadata.len())
}

/// Reads at most `limit` bytes of a file that has `expected` of them.
fn read_to_limit(file: File, path: &Path, limit: u64, expected: u64) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    // A file may say that it is larger than memory, which is no reason to end the program.
    let room = usize::try_from(expected.min(limit)).unwrap_or(usize::MAX);
    bytes.try_reserve_exact(room).map_err(|_| ReadError::io(path)(io::ErrorKind::OutOfMemory.into()))?;
    // It may grow while it is read, or be longer than it says.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(ReadError::io(path))?;
    if bytes.len() as u64 > limit {
        return Err(ReadError::TooLarge { path: path.to_owned(), limit });
    }
    Ok(bytes)
}

/// The kind of something that is not a regular file, in words.
pub fn kind(kind: std::fs::FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        match () {
            () if kind.is_fifo() => return "a pipe",
            () if kind.is_socket() => return "a socket",
            () if kind.is_char_device() || kind.is_block_device() => return "a device",
            () => {}
        }
    }
    if kind.is_dir() { "a folder" } else { "something else" }
}

/// BLAKE3 of the bytes of a file, as records have it: 64 hexadecimal digits.
pub fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_bounded_size_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, [b'a'; 100]).unwrap();
        assert_eq!(read_file(&path, 100).unwrap().len(), 100);
        assert!(matches!(read_file(&path, 99), Err(ReadError::TooLarge { limit: 99, .. })));
        assert!(matches!(read_file(folder.path(), 9), Err(ReadError::NotAFile { found: "a folder", .. })));
        assert!(read_file(&folder.path().join("none"), 9).unwrap_err().is_missing());
        std::fs::write(&path, b"caf\xe9").unwrap();
        assert!(matches!(read_text(&path, 100), Err(ReadError::NotText { at: 3, .. })));
    }

    #[test]
    #[cfg(unix)]
    fn pipes_and_devices_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, 0o600.into(), 0).unwrap();
        assert!(matches!(read_file(&pipe, 9), Err(ReadError::NotAFile { found: "a pipe", .. })));
        let device = Path::new("/dev/zero");
        assert!(matches!(read_file(device, 9), Err(ReadError::NotAFile { found: "a device", .. })));
        // Also if a person names them, but for what the program was started with.
        assert!(matches!(read_text(&pipe, 9), Err(ReadError::NotAFile { found: "a pipe", .. })));
        assert!(matches!(read_text(device, 9), Err(ReadError::NotAFile { found: "a device", .. })));
        let given = File::open(device).unwrap();
        let name = format!("/dev/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&given));
        assert!(matches!(read_text(Path::new(&name), 9), Err(ReadError::TooLarge { .. })));
    }
}
