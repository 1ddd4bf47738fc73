//! Single output files that an option names.

use std::io;
use std::path::Path;

use super::CliError;
use epirig_data::storage::{self, RealDisk};

/// Refuses the name of a file that exists.
pub(super) fn refuse_taken(path: &Path) -> Result<(), CliError> {
    if path.exists() { Err(taken(path)) } else { Ok(()) }
}

/// The failure for such a name.
pub(super) fn taken(path: &Path) -> CliError {
    CliError::usage(format!("{} exists already; give another name", path.display()))
}

/// Writes a whole file, or nothing, if the name is free. Of two programs that write at once, one is refused.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    storage::write_new(&mut RealDisk, path, bytes).map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => taken(path),
        _ => CliError::file("write", path)(source),
    })
}
