//! The sequences in a folder.

use std::fs;
use std::path::{Path, PathBuf};

use super::SequenceError;
use super::reader::START;
use crate::storage::{is_scratch, is_there};

/// The sequences below a folder.
#[derive(Debug, Default)]
pub struct SequencesBelow {
    /// Their folders, in alphabetical order.
    pub folders: Vec<PathBuf>,
    /// Folders that could not be looked into.
    pub closed: Vec<SequenceError>,
}

/// The sequences in `folder` and in all folders below it; `folder` may be one itself. A sequence is not searched for
/// others. Links are not followed.
///
/// # Errors
/// [`SequenceError`] if `folder` cannot be read.
pub fn sequences_below(folder: &Path) -> Result<SequencesBelow, SequenceError> {
    let mut found = SequencesBelow::default();
    look_into(folder, &mut found)?;
    found.folders.sort();
    Ok(found)
}

fn look_into(folder: &Path, found: &mut SequencesBelow) -> Result<(), SequenceError> {
    let failed = |error| SequenceError::io("look into", folder)(error);
    if is_there(&folder.join(START)).map_err(failed)? {
        found.folders.push(folder.to_owned());
        return Ok(());
    }
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder
            && !is_scratch(&entry.file_name())
            && let Err(closed) = look_into(&entry.path(), found)
        {
            found.closed.push(closed);
        }
    }
    Ok(())
}

/// Names of the folders in `folder` that hold a sequence, in alphabetical order. Links are not followed, so
/// none of them leads out of `folder`.
pub fn sequences_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let folders = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
    let held = folders.filter(|entry| is_there(&entry.path().join(START)).unwrap_or(false));
    let mut names: Vec<String> = held.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.retain(|name| !is_scratch(name.as_ref()));
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequences_are_found_at_any_depth_but_not_inside_each_other() {
        let place = tempfile::tempdir().unwrap();
        for name in ["monday/b", "monday/a", "friday/late/c", "monday/a/results", "empty"] {
            fs::create_dir_all(place.path().join(name)).unwrap();
        }
        for name in ["monday/a", "monday/b", "friday/late/c", "monday/a/results"] {
            fs::write(place.path().join(name).join(START), "{}").unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(place.path(), place.path().join("empty/round")).unwrap();
        let found = sequences_below(place.path()).unwrap();
        let expected = ["friday/late/c", "monday/a", "monday/b"].map(|name| place.path().join(name));
        assert_eq!(found.folders, expected);
        assert!(found.closed.is_empty());
        let itself = sequences_below(&expected[1]).unwrap();
        assert_eq!(itself.folders, [expected[1].clone()]);
        assert!(sequences_below(&place.path().join("missing")).is_err());
    }

    #[test]
    fn only_real_folders_with_a_start_record_are_listed() {
        let place = tempfile::tempdir().unwrap();
        for name in ["b", "a", "none"] {
            fs::create_dir(place.path().join(name)).unwrap();
        }
        for name in ["a", "b"] {
            fs::write(place.path().join(name).join(START), "{}").unwrap();
        }
        fs::write(place.path().join("file"), "").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(place.path().join("a"), place.path().join("link")).unwrap();
        assert_eq!(sequences_in(place.path()), ["a", "b"]);
        assert!(sequences_in(&place.path().join("missing")).is_empty());
    }
}
