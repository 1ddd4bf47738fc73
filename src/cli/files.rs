//! Single files that a person asks for.

use std::path::Path;

use super::CliError;
use crate::storage::{RealDisk, write_whole};

/// A file under its name only when it is whole.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    write_whole(&mut RealDisk, path, bytes).map_err(|source| CliError::File {
        path: path.to_owned(),
        action: "write",
        source,
    })
}
