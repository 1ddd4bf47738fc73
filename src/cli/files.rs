//! Single files that a person asks for.

use std::ffi::OsStr;
use std::io;
use std::path::Path;

use super::CliError;
use epirig_data::storage::{Disk, RealDisk, Scratch, Step, parent};

/// A file under its name only when it is whole, in place of one that has it.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    put(path, bytes, |made| RealDisk.rename(made, path))
}

/// The same of a file that must not be there yet: of two programs at once, one is refused.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    put(path, bytes, |made| match RealDisk.link(made, path) {
        // Some file systems know no second names.
        Err(error)
            if matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::PermissionDenied) =>
        {
            RealDisk.rename(made, path)
        }
        linked => linked,
    })
}

/// Makes the file in a folder of its own, so that nobody else has its name, and lets `place` put it where it belongs.
fn put(path: &Path, bytes: &[u8], place: impl FnOnce(&Path) -> io::Result<()>) -> Result<(), CliError> {
    let failed = |source: io::Error| match source.kind() {
        io::ErrorKind::AlreadyExists => {
            CliError::Usage(format!("{} exists already; give another name", path.display()))
        }
        _ => CliError::File { path: path.to_owned(), action: "write", source },
    };
    let scratch = Scratch::inside(parent(path)).map_err(failed)?;
    let made = scratch.path().join(path.file_name().unwrap_or(OsStr::new("file")));
    let _step = Step::begin();
    let placed = RealDisk
        .write(&made, bytes)
        .and_then(|()| RealDisk.sync(&made))
        .and_then(|()| place(&made))
        .and_then(|()| RealDisk.sync(parent(path)));
    placed.map_err(failed)
}
