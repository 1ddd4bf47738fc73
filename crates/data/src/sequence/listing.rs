//! The sequences in a folder.

use std::fs;
use std::path::Path;

use super::reader::START;
use crate::storage::{is_scratch, is_there};

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
