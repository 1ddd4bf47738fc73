//! Single output files that an option names.

use std::ffi::OsStr;
use std::io;
use std::path::Path;

use super::CliError;
use epirig_data::storage::{Disk, RealDisk, Scratch, Step, parent};

/// Writes a whole file, or nothing, if the name is free. Of two programs that write at once, one is refused.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    let failed = |source: io::Error| match source.kind() {
        io::ErrorKind::AlreadyExists => {
            CliError::Usage(format!("{} exists already; give another name", path.display()))
        }
        _ => CliError::File { path: path.to_owned(), action: "write", source },
    };
    // The file is made in a folder of its own, so that no other program uses its name.
    let scratch = Scratch::inside(parent(path)).map_err(failed)?;
    let made = scratch.path().join(path.file_name().unwrap_or(OsStr::new("file")));
    let _step = Step::begin();
    let placed = RealDisk
        .write(&made, bytes)
        .and_then(|()| RealDisk.sync(&made))
        .and_then(|()| place(&made, path))
        .and_then(|()| RealDisk.sync(parent(path)));
    placed.map_err(failed)
}

fn place(made: &Path, path: &Path) -> io::Result<()> {
    match RealDisk.link(made, path) {
        // Some file systems have no hard links.
        Err(error)
            if matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::PermissionDenied) =>
        {
            RealDisk.rename(made, path)
        }
        linked => linked,
    }
}
