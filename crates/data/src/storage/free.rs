//! Free space on a disk.

use std::path::Path;

/// Free space on the disk of `folder`, which need not exist, in bytes; `None` if the system does not tell.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    let folder = std::path::absolute(folder).ok()?;
    let existing = folder.ancestors().find(|folder| folder.exists())?;
    fs4::available_space(existing).ok()
}
