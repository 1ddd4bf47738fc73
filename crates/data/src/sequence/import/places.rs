//! Where a sequence must not be made.

use std::fs;
use std::path::{Path, PathBuf};

use super::super::error::SequenceError;

/// Refuses a sequence that would lie among the images that it is made of.
pub(super) fn refuse_inside(out: &Path, folder: &Path) -> Result<(), SequenceError> {
    let source = fs::canonicalize(folder).map_err(SequenceError::io("look into", folder))?;
    if resolved(out).is_some_and(|out| out.starts_with(&source)) {
        return Err(SequenceError::InsideSource { out: out.to_owned(), folder: folder.to_owned() });
    }
    Ok(())
}

/// Where a path leads that need not be there yet: its links followed as far as there are any.
fn resolved(path: &Path) -> Option<PathBuf> {
    let path = std::path::absolute(path).ok()?;
    let there = path.ancestors().find_map(|ancestor| Some((ancestor, fs::canonicalize(ancestor).ok()?)));
    let (ancestor, real) = there?;
    Some(real.join(path.strip_prefix(ancestor).ok()?))
}
